import { Section } from "../ui/Section";
import { goTo } from "../picture/clock";
import { legAt, legName } from "../store/cycle";
import { answered, stale, time } from "../store/state";
import { atMost, figure } from "../store/units";

const MOST = 11; // ratio to the bound from which on a gap says nothing

/** The legs of a round, each with its own gap. */
export function Legs() {
  const cycle = answered.value?.cycle;
  if (!cycle) return null;
  const now = legAt(cycle.legs, time.value);
  return (
    <Section title="Legs" note="gap: at most so much above the least" id="legs">
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
              <td>
                {leg.answer && leg.electrical < MOST * leg.lower_bound
                  ? atMost(leg.electrical / leg.lower_bound - 1)
                  : "–"}
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </Section>
  );
}
