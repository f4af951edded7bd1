import { goTo } from "../picture/clock";
import { legAt, legName } from "../store/cycle";
import { time, type CycleShown } from "../store/state";
import type { Leg } from "../store/types";
import { figure } from "../store/units";

const FITS = 22; // height from which on the joules fit into a leg [%]

const LEAST = 8; // height of a leg that needs next to nothing [%]

/** Heights of legs [%], in proportion to their mean powers; of legs that give energy, the least. */
export function heightsOf(legs: Pick<Leg, "electrical" | "duration">[]): number[] {
  const powers = legs.map(({ electrical, duration }) => electrical / (duration || Infinity));
  const most = Math.max(...powers);
  return powers.map((power) => Math.max(LEAST, most > 0 ? (100 * power) / most : 0));
}

/** A bar for each leg: its width is the duration, its height the mean power. */
export function LegTimeline({ cycle: { legs, loads } }: { cycle: CycleShown }) {
  const heights = heightsOf(legs);
  const now = legAt(legs, time.value);
  return (
    <div class="timeline" id="timeline">
      <p class="hint">
        Each bar is a leg: its width is the duration, its height the mean power, its number the
        energy in J.
      </p>
      <div class="legs" role="group" aria-label="Legs of the cycle">
        {legs.map((leg, k) => {
          const text = `${legName(leg)}: ${figure(leg.duration)} s, ${figure(leg.electrical)} J, ${figure(leg.payload_mass)} kg`;
          const height = heights[k]!;
          const kind = leg.answer ? (loads[k]?.payload ? "loaded" : "unloaded") : "rest";
          return (
            <button
              type="button"
              key={k}
              class={`leg ${kind}`}
              title={text}
              aria-label={text}
              data-now={k === now ? "" : undefined}
              style={{ flexGrow: leg.duration, height: `${height}%` }}
              onClick={() => goTo(leg.t0)}
            >
              <span>{leg.answer && height > FITS ? figure(leg.electrical) : ""}</span>
            </button>
          );
        })}
      </div>
    </div>
  );
}
