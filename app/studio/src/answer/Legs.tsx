import { Section } from "../ui/Section";
import { goTo } from "../picture/clock";
import { legAt, legName } from "../store/cycle";
import { answered, stale, time } from "../store/state";
import type { Leg } from "../store/types";
import { atMost, figure } from "../store/units";

const MOST = 11; // ratio to the bound from which on a gap says nothing

/** By how much a leg is at most above the least, in words; a dash where that says nothing. */
export function gapOf(leg: Leg, objective: "electrical" | "mechanical"): string {
  const { answer, lower_bound: bound, [objective]: needed } = leg;
  return answer && bound > 0 && needed < MOST * bound ? atMost(needed / bound - 1) : "–";
}

/** The legs of a cycle, each with its own gap. */
export function Legs() {
  const shown = answered.value;
  const cycle = shown?.cycle;
  if (!cycle) return null;
  const now = legAt(cycle.legs, time.value);
  return (
    <Section title="Legs" note="gap: energy above the lower bound" id="legs">
      <table class={stale.value ? "stale" : undefined}>
        <thead>
          <tr>
            <td />
            <th scope="col">kg</th>
            <th scope="col">s</th>
            <th scope="col">J</th>
            <th scope="col">gap</th>
          </tr>
        </thead>
        <tbody>
          {cycle.legs.map((leg, k) => (
            <tr
              key={k}
              class={leg.answer ? undefined : "rest"}
              data-now={k === now ? "" : undefined}
            >
              <th scope="row">
                <button type="button" class="plain" onClick={() => goTo(leg.t0)}>
                  {legName(leg)}
                </button>
              </th>
              <td>{leg.payload_mass ? figure(leg.payload_mass) : "–"}</td>
              <td>{figure(leg.duration)}</td>
              <td>{figure(leg.electrical)}</td>
              <td>{gapOf(leg, shown.solution.objective)}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </Section>
  );
}
