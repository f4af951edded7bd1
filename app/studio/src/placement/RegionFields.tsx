import { Button } from "../ui/Button";
import { Note } from "../ui/Note";
import { Progress } from "../ui/Progress";
import { Section } from "../ui/Section";
import { COORDINATES, refused, regionOf, regionTyped, search, UNIT } from "../store/placement";
import type { Coordinate } from "../store/placement";
import { MOUNTS, type Mount } from "../store/places";
import { lackOf } from "../store/request";
import { kind, looked, request, run } from "../store/state";
import { UNITS } from "../store/units";

/** Where the base may be moved, and the button that searches. */
export function RegionFields() {
  const given = regionTyped.value;
  const checked = regionOf(given, 0);
  const why =
    kind.value === "path"
      ? "Only moves and cycles can be placed: choose Cycle, and make the path a stop."
      : (lackOf(request.value)?.text ?? ("why" in checked ? checked.why : null));
  const running = run.value?.endpoint === "placement";
  const mount = (name: Mount, on: boolean) => {
    const mounts = MOUNTS.filter((each) => (each === name ? on : given.mounts.includes(each)));
    regionTyped.value = { ...given, mounts };
  };
  return (
    <Section title="Region of the base" note="offsets from the current place" id="region">
      {COORDINATES.map((name) => (
        <Range key={name} name={name} />
      ))}
      <fieldset class="field">
        <legend>Mounts, including the current one</legend>
        {MOUNTS.map((name) => (
          <label key={name}>
            <input
              type="checkbox"
              checked={given.mounts.includes(name)}
              onChange={(event) => mount(name, event.currentTarget.checked)}
            />{" "}
            {name}
          </label>
        ))}
      </fieldset>
      <Amount text="Spacing of places" field="step" sign="mm" empty="auto" />
      <Amount text="Search time" field="deadline" sign="s" />
      {refused.value && <Note kind="error">{refused.value}</Note>}
      {running ? (
        <Progress />
      ) : (
        <>
          <Button
            id="search-places"
            kind={looked.value ? undefined : "primary"}
            disabled={why !== null || Boolean(run.value)}
            onClick={search}
          >
            Search for the best place
          </Button>
          <p class="hint" role="status">
            {why ?? "Collisions are checked at every place. The best place is shown."}
          </p>
        </>
      )}
    </Section>
  );
}

/** From where to where a coordinate may be. */
function Range({ name }: { name: Coordinate }) {
  const given = regionTyped.value;
  const { sign } = UNITS[UNIT[name]];
  const [low, high] = given[name];
  const free = given.free[name];
  const end = (value: string, label: string, next: (text: string) => [string, string]) => (
    <input
      type="text"
      inputMode="decimal"
      class="short"
      aria-label={`${name} ${label} in ${sign}`}
      disabled={!free}
      value={value}
      onInput={(event) =>
        (regionTyped.value = { ...given, [name]: next(event.currentTarget.value) })
      }
    />
  );
  return (
    <div class="field">
      <label>
        <input
          type="checkbox"
          checked={free}
          onChange={(event) =>
            (regionTyped.value = {
              ...given,
              free: { ...given.free, [name]: event.currentTarget.checked },
            })
          }
        />{" "}
        {name}
      </label>
      {end(low, "from", (text) => [text, high])} to {end(high, "to", (text) => [low, text])} {sign}
    </div>
  );
}

/** A number of the search with its unit. */
function Amount({
  text,
  field,
  sign,
  empty,
}: {
  text: string;
  field: "step" | "deadline";
  sign: string;
  empty?: string;
}) {
  const given = regionTyped.value;
  return (
    <label class="field">
      <span>{text}</span>
      <input
        type="text"
        inputMode="decimal"
        class="short"
        placeholder={empty}
        value={given[field]}
        onInput={(event) => (regionTyped.value = { ...given, [field]: event.currentTarget.value })}
      />{" "}
      {sign}
    </label>
  );
}
