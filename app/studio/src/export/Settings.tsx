import type { Answered } from "../store/state";
import { figure } from "../store/units";
import type { Options } from "./file";

/** Speed and gripper output of the file. */
export function Settings({
  format,
  options,
  onChange,
  shown,
}: {
  format: string;
  options: Options;
  onChange: (next: Options) => void;
  shown: Answered;
}) {
  const switches = ["urscript", "krl", "movej"].includes(format);
  const { duration } = shown.solution;
  const resting =
    shown.cycle?.legs.filter(({ answer }) => !answer).reduce((sum, leg) => sum + leg.duration, 0) ??
    0;
  return (
    <>
      <h3>Speed</h3>
      <label class="row">
        <input
          type="range"
          id="export-speed"
          min={1}
          max={100}
          step={1}
          value={options.speed * 100}
          aria-label="Speed in %"
          onInput={(event) =>
            onChange({ ...options, speed: Number(event.currentTarget.value) / 100 })
          }
        />
        <output>{Math.round(options.speed * 100)} %</output>
      </label>
      <p class="hint">
        {format === "movej"
          ? "Share of the controller’s default speed."
          : `${figure((duration - resting) / options.speed + resting)} s. The limits are proven again at this speed.`}{" "}
        Begin with 10 %, then use 30, 60 and 100 %.
      </p>
      {switches && (
        <label class="row">
          <b>Gripper</b>
          <select
            aria-label="Gripper output"
            value={options.output ?? ""}
            onChange={(event) =>
              onChange({
                ...options,
                output: event.currentTarget.value === "" ? null : Number(event.currentTarget.value),
              })
            }
          >
            <option value="">no output is switched</option>
            {[0, 1, 2, 3, 4, 5, 6, 7].map((each) => (
              <option key={each} value={each}>
                DO {each} on from each grasp to the release
              </option>
            ))}
          </select>
        </label>
      )}
    </>
  );
}
