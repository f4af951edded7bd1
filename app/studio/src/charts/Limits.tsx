import { goTo } from "../picture/clock";
import { answered } from "../store/state";
import { figure, percent, words } from "../store/units";
import { worstTime } from "./limited";

const NAMES: Record<string, string> = {
  velocity: "speed",
  tcp_speed: "TCP speed",
  elbow_speed: "elbow speed",
  path_position: "path, position",
  path_rotation: "path, rotation",
  path_speed: "minimum path speed",
};
const FULL = 0.995; // share of a limit that counts as reached

/** How much of each limit the motion uses. A click goes to the instant where it uses most. */
export function Limits() {
  const shown = answered.value!;
  const rows = Object.entries(shown.solution.certificate.worst_ratio).filter(
    ([, share]) => typeof share === "number",
  );
  return (
    <ol class="bars" id="limits">
      {rows.map(([name, value]) => {
        const share = value ?? 0;
        const time = worstTime(shown, name);
        const parts = (
          <>
            <span class="name">{NAMES[name] ?? words(name)}</span>
            <span class="track">
              <span
                class={`fill ${share > FULL ? "own" : "other"}`}
                style={{ width: `${Math.min(100, share * 100)}%` }}
              />
            </span>
            <span class="value">{percent(share, 3)}</span>
          </>
        );
        return (
          <li key={name}>
            {time === null ? (
              <div class="bar-row">{parts}</div>
            ) : (
              <button
                type="button"
                class="plain bar-row"
                title={`Largest at ${figure(time)} s`}
                onClick={() => goTo(time)}
              >
                {parts}
              </button>
            )}
          </li>
        );
      })}
    </ol>
  );
}
