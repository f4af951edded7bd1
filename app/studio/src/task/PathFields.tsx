import { Errors } from "../ui/Errors";
import { NumberCell } from "../ui/NumberCell";
import { Section } from "../ui/Section";
import { Segment } from "../ui/Segment";
import { withSpeed } from "../store/edits";
import { at, put } from "../store/pointer";
import { isObject } from "../store/request";
import { edit, request, typed } from "../store/state";

const SHAPES = [
  { value: "lines", text: "Lines" },
  { value: "curve", text: "Curve" },
  { value: "arc", text: "Arc" },
] as const;

const RAMP = 0.02; // default length of the ramps of a held speed [m]

/** How the TCP moves along the path. */
export function PathFields() {
  const shape = String(
    at(request.value, "/path/shape") ?? "lines",
  ) as (typeof SHAPES)[number]["value"];
  return (
    <Section title="Path">
      <Segment
        label="Shape of the path"
        options={SHAPES}
        value={shape}
        onChange={(next) => edit(put(request.value, "/path/shape", next))}
      />
      <div class="fields">
        <Speed />
        {shape === "lines" && (
          <div class="field">
            <span>Corners rounded by</span>
            <NumberCell
              label="Blend"
              pointer="/path/blend"
              value={at(request.value, "/path/blend") ?? 0}
              unit="mm"
              withUnit
            />
          </div>
        )}
      </div>
      <Errors under="/path" except={["/path/via"]} />
    </Section>
  );
}

/** The largest speed of the TCP, and whether it is constant, for example for a bead of glue. */
function Speed() {
  const given = at(request.value, "/path/speed") ?? undefined;
  const most = isObject(given) ? given.max : given;
  const held = isObject(given) && given.min === most;
  const pointer = held ? "/path/speed/max" : "/path/speed";
  const set = (value: number | undefined, fixed: boolean, text?: string) =>
    edit(
      withSpeed(request.value, value, fixed),
      text === undefined ? typed.value : { ...typed.value, [pointer]: text },
    );
  if (given !== undefined && (typeof most !== "number" || (isObject(given) && !held)))
    return <p class="hint">TCP speed: as in JSON</p>;
  return (
    <>
      <label class="field">
        <span>Largest TCP speed</span>
        <input
          type="checkbox"
          aria-label="Limit the speed"
          checked={given !== undefined}
          onChange={(event) => set(event.currentTarget.checked ? 0.1 : undefined, false)}
        />
        {given === undefined ? (
          <small>as fast as the limits allow</small>
        ) : (
          <NumberCell
            label="TCP speed"
            pointer={pointer}
            value={most}
            unit="mmps"
            onValue={(value, text) => set(value, held, text)}
            withUnit
          />
        )}
      </label>
      {typeof most === "number" && (
        <label class="field">
          <input
            type="checkbox"
            checked={held}
            onChange={(event) => set(most, event.currentTarget.checked)}
          />
          <span>constant speed, for example for glue</span>
        </label>
      )}
      {held && (
        <div class="field">
          <span>ramps at both ends</span>
          <NumberCell
            label="Ramp"
            pointer="/path/speed/ramp"
            value={at(given, "/ramp") ?? RAMP}
            unit="mm"
            withUnit
          />
        </div>
      )}
    </>
  );
}
