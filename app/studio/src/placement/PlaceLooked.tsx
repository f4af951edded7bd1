import { useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { useDraft } from "../ui/draft";
import { Section } from "../ui/Section";
import { tool } from "../picture/drag";
import { IDENTITY } from "../store/chain";
import { accept, BASE, COORDINATES, look, mapShown, stopLooking, UNIT } from "../store/placement";
import type { Coordinate } from "../store/placement";
import { coordinatesOf, movedTo, worldOf } from "../store/places";
import { energyOf } from "../store/facts";
import { answered, looked, request, selected, stale, tab } from "../store/state";
import { trying } from "../store/trouble";
import { figure, percent, shown, typedValue, UNITS } from "../store/units";
import { robotNow } from "../picture/pictured";

/** The selected place of the base: its coordinates, its energy, and the button that accepts it. */
export function PlaceLooked() {
  const now = looked.value;
  const robot = robotNow.value;
  const [wrong, setWrong] = useState<Coordinate | null>(null);
  if (!robot) return null;
  const world = worldOf(request.value, robot);
  const pose = now?.pose ?? IDENTITY;
  const { at, yaw } = coordinatesOf(pose, world);
  const values: Record<Coordinate, number> = { x: at[0], y: at[1], z: at[2], yaw };
  const go = (name: Coordinate, text: string) => {
    const value = typedValue(text, UNIT[name]);
    setWrong(value === null ? name : null);
    if (value === null) return;
    const next = { ...values, [name]: value };
    trying(() => look(movedTo(pose, world, { at: [next.x, next.y, next.z], yaw: next.yaw })))();
  };
  const drag = () => {
    selected.value = BASE;
    tool.value = "move";
    tab.value = "picture";
  };
  return (
    <Section
      title="Selected place"
      note={now ? "offset from the current place" : "current place"}
      id="place-looked"
      action={
        <Button kind="link" onClick={drag}>
          Drag the base
        </Button>
      }
    >
      <div class="six">
        {COORDINATES.map((name) => (
          <label key={name} class="six-cell">
            <span aria-hidden="true">
              {name} {UNITS[UNIT[name]].sign}
            </span>
            <BaseCell
              name={name}
              text={shown(values[name], UNIT[name])}
              isWrong={wrong === name}
              onText={(text) => go(name, text)}
            />
          </label>
        ))}
      </div>
      {wrong && (
        <p class="error" role="alert">
          Enter a number for {wrong}.
        </p>
      )}
      <p role="status" id="place-joules">
        {joules()}
      </p>
      {now && (
        <div class="row">
          <Button
            id="accept-place"
            kind={now.state === "shown" ? "primary" : undefined}
            disabled={now.state !== "shown"}
            onClick={accept}
          >
            Accept this place
          </Button>
          <Button onClick={stopLooking}>Back to the current place</Button>
        </div>
      )}
    </Section>
  );
}

/** What the task needs there, in words. */
function joules(): string {
  const now = looked.value;
  const here = hereNow();
  if (!now)
    return here === null ? "Click a point of the map, or drag the base." : `${figure(here)} J`;
  if (now.state === "moving") return "Release the base to compute the energy.";
  if (now.state === "failed") return now.why;
  const known = now.energy === null ? "" : `${figure(now.energy)} J${against(now.energy, here)}`;
  return now.state === "computing" ? `${known ? `${known} · ` : ""}Computing …` : known;
}

/** Energy at the current place of the robot [J]; null if it is not known. */
const hereNow = () =>
  mapShown.value?.answer.nominal?.energy ??
  (answered.value && !stale.value ? energyOf(answered.value) : null);

function against(energy: number, here: number | null): string {
  if (!here) return "";
  const saving = 1 - energy / here;
  if (Math.abs(saving) < 0.0005) return ", the same as now";
  return `, ${percent(Math.abs(saving))} ${saving > 0 ? "less" : "more"} than now`;
}

/** A coordinate of the base; what is typed stays while the energy of another place comes. */
function BaseCell(props: {
  name: Coordinate;
  text: string;
  isWrong: boolean;
  onText: (text: string) => void;
}) {
  const { field } = useDraft(props.text);
  return (
    <input
      type="text"
      inputMode="decimal"
      aria-label={`Base ${props.name} in ${UNITS[UNIT[props.name]].sign}`}
      aria-invalid={props.isWrong ? "true" : undefined}
      {...field}
      onChange={(event) => props.onText(event.currentTarget.value)}
      onKeyDown={(event) => event.key === "Enter" && event.currentTarget.blur()}
    />
  );
}
