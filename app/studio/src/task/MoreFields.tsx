import { Button } from "../ui/Button";
import { Errors } from "../ui/Errors";
import { NumberCell } from "../ui/NumberCell";
import { at, put } from "../store/pointer";
import { asJson, edit, request, write } from "../store/state";
import { words } from "../store/units";
import { BranchField } from "./BranchField";
import { FiguresField } from "./FiguresField";

// fields that have a control elsewhere
const SHOWN = [
  "robot",
  "start",
  "goal",
  "stops",
  "path",
  "tcp",
  "tool",
  "payload",
  "scene",
  "order",
  "closed",
  "duration",
  "dwell",
  "time",
];
const HERE = [
  "gravity",
  "figures",
  "limits",
  "branch",
  "objective",
  "method",
  "windings",
  "collisions",
  "deadline",
];
const MOUNTS = [
  { name: "on the floor", gravity: null },
  { name: "on the ceiling", gravity: [0, 0, 9.81] },
  { name: "on a wall, x up", gravity: [-9.81, 0, 0] },
  { name: "on a wall, y up", gravity: [0, -9.81, 0] },
];
const METHODS = ["bspline", "time_scaling", "lagrange", "uniform_scaling", "polynomial_ga"];
const LIMITS = ["tcp_speed", "elbow_speed"];

/** What is rarely needed; fields without a control are in the JSON. */
export function MoreFields() {
  const asked = request.value;
  const set = HERE.filter((name) => asked[name] !== undefined && asked[name] !== null);
  const others = Object.keys(asked).filter((name) => !SHOWN.includes(name) && !HERE.includes(name));
  const field = (name: string, text: string, pointer: string, unit: "mmps" | "s") => (
    <div class="field">
      <span>{text}</span>
      <NumberCell label={text} pointer={pointer} value={at(asked, pointer)} unit={unit} withUnit />
      {at(asked, pointer) !== undefined && at(asked, pointer) !== null && (
        <Button
          kind="quiet"
          small
          icon="close"
          label={`No ${name}`}
          onClick={() => write(pointer, undefined)}
        />
      )}
    </div>
  );
  return (
    <details class="section fold" id="more">
      <summary>
        <b>More</b>{" "}
        <small>
          {set.length ? set.map(words).join(", ") : "limits, mounting, branches: defaults"}
        </small>
      </summary>
      <div class="fields">
        <Mount />
        <FiguresField />
        {LIMITS.map((name) => (
          <div key={name}>
            {field(
              words(name),
              `Largest ${words(name).replace("tcp", "TCP")}`,
              `/limits/${name}`,
              "mmps",
            )}
          </div>
        ))}
        <BranchField />
        <Pick name="objective" options={["electrical", "mechanical"]} />
        <Pick name="method" options={METHODS} />
        <Tick name="windings" text="use full-turn alternatives" />
        <Tick name="collisions" text="check collisions" />
        {field("deadline", "Computing time", "/deadline", "s")}
      </div>
      {[
        "limits",
        "branch",
        "gravity",
        "objective",
        "method",
        "deadline",
        "windings",
        "collisions",
      ].map((name) => (
        <Errors key={name} under={`/${name}`} />
      ))}
      {others.length > 0 && (
        <p class="hint">
          Also set:{" "}
          {others.map((name) => (
            <code key={name} data-path={name}>
              {name}{" "}
            </code>
          ))}
          <Button kind="link" onClick={() => (asJson.value = true)}>
            edit as JSON
          </Button>
        </p>
      )}
      {others.map((name) => (
        <Errors key={name} under={`/${name}`} />
      ))}
    </details>
  );
}

function Mount() {
  const now = JSON.stringify(request.value.gravity ?? null);
  const index = MOUNTS.findIndex(
    ({ gravity }) => JSON.stringify(gravity) === now || (gravity === null && now === "[0,0,-9.81]"),
  );
  return (
    <label class="field">
      <span>Mounted</span>
      <select
        value={index}
        onChange={(event) =>
          edit(
            put(
              request.value,
              "/gravity",
              MOUNTS[Number(event.currentTarget.value)]!.gravity ?? undefined,
            ),
          )
        }
      >
        {MOUNTS.map(({ name }, k) => (
          <option key={name} value={k}>
            {name}
          </option>
        ))}
        {index < 0 && <option value={-1}>as in JSON</option>}
      </select>
    </label>
  );
}

function Pick({ name, options }: { name: string; options: string[] }) {
  return (
    <label class="field">
      <span>{name === "method" ? "Method" : "Minimise"}</span>
      <select
        value={String(request.value[name] ?? options[0])}
        onChange={(event) =>
          edit(
            put(
              request.value,
              `/${name}`,
              event.currentTarget.value === options[0] ? undefined : event.currentTarget.value,
            ),
          )
        }
      >
        {options.map((each) => (
          <option key={each} value={each}>
            {words(each)}
            {name === "objective" ? " energy" : ""}
          </option>
        ))}
      </select>
    </label>
  );
}

function Tick({ name, text }: { name: string; text: string }) {
  return (
    <label class="field">
      <input
        type="checkbox"
        checked={request.value[name] !== false}
        onChange={(event) =>
          edit(put(request.value, `/${name}`, event.currentTarget.checked ? undefined : false))
        }
      />
      <span>{text}</span>
    </label>
  );
}
