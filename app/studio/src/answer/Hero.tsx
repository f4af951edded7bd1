import { Icon } from "../ui/icons";
import { answered, stale, type Answered } from "../store/state";
import { atMost, ends, figure } from "../store/units";
import { brokenLimit, capital, energyOf, gapOf, nounOf } from "../store/facts";
import { Parts } from "./Parts";

/** The energy with its interval and its assumptions. */
export function Hero() {
  const shown = answered.value;
  if (!shown) return null;
  const { solution } = shown;
  const gap = gapOf(shown);
  const broken = brokenLimit(shown);
  const total = energyOf(shown);
  return (
    <section class={`hero${stale.value ? " stale" : ""}`} aria-label="Energy">
      <div class="hero-head">
        <div>
          <p class="hint">
            {solution.objective === "mechanical" ? "Mechanical work" : "Energy"} of this{" "}
            {nounOf(shown)}
          </p>
          <p class="big" id="joules">
            {stale.value ? <s>{figure(total)}</s> : figure(total)} <small>J</small>
          </p>
        </div>
        <div class="hero-side">
          {broken ? (
            <span class="chip bad">
              <Icon name="alert" />
              Limit violated: {broken}
            </span>
          ) : (
            <span class="chip good">
              <Icon name="circleCheck" />
              Keeps all limits
            </span>
          )}
          <Interval shown={shown} />
        </div>
      </div>
      <dl class="facts" id="facts">
        <div>
          <dt>time</dt>
          <dd>{figure(solution.duration)} s</dd>
        </div>
        <div>
          <dt>mean</dt>
          <dd>{figure(solution.energy.mean_power, 2)} W</dd>
        </div>
        <div>
          <dt>peak</dt>
          <dd>{figure(solution.energy.peak_power)} W</dd>
        </div>
        <div>
          <dt>above the least possible</dt>
          <dd id="gap">{gap === null ? "no bound" : `≤ ${atMost(gap)}`}</dd>
        </div>
      </dl>
      <Parts electrical={solution.energy.electrical} />
      <p
        class="hint trust"
        title={Object.entries(shown.robot.trust)
          .map(([letter, text]) => `${letter}: ${text}`)
          .join("\n")}
      >
        {shown.asked?.figures
          ? "Computed with identified figures of your arm."
          : shown.robot.energy_trust}
      </p>
      {solution.status !== "optimal" && (
        <p class="warning-text">
          {capital(solution.status)}: the search ended before every other candidate was ruled out.
        </p>
      )}
    </section>
  );
}

/** How well the energy is known. */
function Interval({ shown }: { shown: Answered }) {
  const { interval, total } = shown.solution.energy.electrical;
  if (!interval || shown.solution.objective !== "electrical") return null;
  const { p5, p95 } = interval;
  const room = 0.15 * (p95 - p5 || 1);
  const [from, to] = [Math.min(p5, total) - room, Math.max(p95, total) + room];
  const place = (value: number) => `${(100 * (value - from)) / (to - from)}%`;
  return (
    <>
      <div class="interval" aria-hidden="true">
        <i
          class="band"
          style={{ left: place(p5), right: `${100 - (100 * (p95 - from)) / (to - from)}%` }}
        />
        <i class="best" style={{ left: place(total) }} />
      </div>
      <p class="hint" id="likely">
        90 % interval {ends(interval)} J
      </p>
    </>
  );
}
