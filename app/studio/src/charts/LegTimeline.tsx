import { goTo } from "../picture/clock";
import { legAt, legName } from "../store/cycle";
import { time, type CycleShown } from "../store/state";
import { figure } from "../store/units";

const FITS = 22; // height from which on the joules fit into a leg [%]

/** Legs as wide as their time and as high as their mean power; the figures are joules. */
export function LegTimeline({ cycle: { legs, loads } }: { cycle: CycleShown }) {
  const most = Math.max(
    ...legs.map(({ electrical, duration }) => electrical / (duration || Infinity)),
  );
  const now = legAt(legs, time.value);
  return (
    <div class="timeline" id="timeline">
      <p class="hint">Legs as wide as their time, as high as their mean power; joules inside</p>
      <div class="legs" role="group" aria-label="Legs of the round">
        {legs.map((leg, k) => {
          const text = `${legName(leg)}: ${figure(leg.duration)} s, ${figure(leg.electrical)} J, ${figure(leg.payload_mass)} kg`;
          const height = (100 * leg.electrical) / (leg.duration || 1) / most;
          const kind = leg.answer ? (loads[k]?.payload ? "loaded" : "unloaded") : "rest";
          return (
            <button
              type="button"
              key={k}
              class={`leg ${kind}`}
              title={text}
              aria-label={text}
              data-now={k === now ? "" : undefined}
              style={{ flexGrow: leg.duration, height: `${Math.max(8, height)}%` }}
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
