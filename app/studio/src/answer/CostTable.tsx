import { useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { PlainNumber } from "../ui/PlainNumber";
import { Section } from "../ui/Section";
import { costsOf, DEFAULT_ECONOMICS, type Economics, type Sourced } from "../store/economics";
import { answered, economics, stale, type Answered } from "../store/state";
import { nounOf, periodOf } from "../store/facts";
import { figure, fixed } from "../store/units";
import { adviceFailed, advised, waits } from "./advice";

/** The parts of what one move or cycle costs. */
function partsOf(shown: Answered): { name: string; joules: number }[] {
  const { total, dwell = 0 } = shown.solution.energy.electrical;
  const waiting = advised.value?.waiting ?? 0;
  const parts = shown.cycle
    ? [
        { name: "Moves", joules: total - dwell },
        { name: "At the stops", joules: dwell },
        { name: "Waiting with motors on", joules: waiting },
      ]
    : [
        { name: "Move", joules: total - dwell },
        { name: "Waiting with motors on", joules: dwell || waiting },
      ];
  return parts.filter(({ joules }, k) => k === 0 || joules > 0);
}

/** What the motion costs in a cycle, a shift and a year. */
export function CostTable() {
  const shown = answered.value;
  const [open, setOpen] = useState(false);
  if (!shown) return null;
  const given = economics.value;
  const costs = costsOf(partsOf(shown), periodOf(shown, given.cycleTime), given);
  const unpriced = waits(shown, given.cycleTime) && !advised.value && !stale.value;
  const kwh = (value: number) => `${figure(value)} kWh`;
  return (
    <Section
      title="Energy costs"
      id="costs"
      action={
        <Button kind="link" onClick={() => setOpen(!open)}>
          Assumptions
        </Button>
      }
    >
      <table class={stale.value ? "stale" : undefined}>
        <thead>
          <tr>
            <td />
            <th scope="col">
              <b>cycle</b> {`${figure(costs.cycleTime)}\u00a0s`}
            </th>
            <th scope="col">
              <b>shift</b> {fixed(costs.cyclesPerShift, 0)}×
            </th>
            <th scope="col">
              <b>year</b> {fixed(given.shiftsPerYear, 0)} shifts
            </th>
          </tr>
        </thead>
        <tbody>
          {costs.rows.map((row) => (
            <tr key={row.name}>
              <th scope="row">{row.name}</th>
              <td>{figure(row.joules)} J</td>
              <td>{kwh(row.shift)}</td>
              <td>{kwh(row.year)}</td>
            </tr>
          ))}
          {costs.rows.length > 1 && (
            <tr class="total">
              <th scope="row">Total</th>
              <td>{figure(costs.total.joules)} J</td>
              <td>{kwh(costs.total.shift)}</td>
              <td>{kwh(costs.total.year)}</td>
            </tr>
          )}
          <tr class="sub">
            <th scope="row">Cost, CO₂e</th>
            <td />
            <td>
              {figure(costs.money.shift, 2)} €, {figure(costs.carbon.shift, 2)} kg
            </td>
            <td>
              {figure(costs.money.year, 2)} €, {figure(costs.carbon.year, 2)} kg
            </td>
          </tr>
        </tbody>
      </table>
      <p class="hint">
        <span title={given.price.source}>
          {fixed(given.price.value, 2)} € per kWh ({short(given.price)})
        </span>
        ,{" "}
        <span title={given.carbon.source}>
          {fixed(given.carbon.value, 2)} kg CO₂e per kWh ({short(given.carbon)})
        </span>
        . {given.box ? "" : "The control box is not included: enter its measured power. "}
        {given.cycleTime === null && !shown.cycle && !shown.asked?.dwell
          ? "The moves follow each other without pause: enter a cycle time to include a wait. "
          : ""}
        {given.cycleTime !== null && given.cycleTime < shown.solution.duration
          ? `This ${nounOf(shown)} takes longer than the cycle time of ${figure(given.cycleTime)} s. `
          : ""}
        {unpriced
          ? adviceFailed.value
            ? "The energy of the wait could not be computed."
            : "The energy of the wait is being computed."
          : ""}
      </p>
      {open && <Assumptions />}
    </Section>
  );
}

/** A source by its first words, with its trust letter; the whole of it is among the assumptions. */
const short = ({ source, letter }: Sourced) =>
  `${source.split(":")[0]!}${letter ? `, ${letter}` : ""}`;

const LETTERS: Record<string, string> = { C: "second-hand" };
const sourceOf = ({ source, letter }: Sourced) =>
  letter ? `${letter}, ${LETTERS[letter] ?? ""}: ${source}` : source;

/** The assumptions behind the costs; users replace them by their own. */
function Assumptions() {
  const given = economics.value;
  const set = (next: Partial<Economics>) => (economics.value = { ...given, ...next });
  const row = (
    text: string,
    unit: string,
    value: number | null,
    source: string,
    take: (value: number | null) => void,
    empty?: string,
  ) => (
    <div class="field" key={text}>
      <span>{text}</span>
      <PlainNumber
        label={`${text} in ${unit}`}
        unit={unit}
        value={value}
        least="zero"
        empty={empty}
        onValue={take}
      />
      <small class="source">{source}</small>
    </div>
  );
  const yours = (value: number): Sourced => ({ value, source: "yours" });
  return (
    <div class="fields" id="assumptions">
      {row(
        "Electricity",
        "€ per kWh",
        given.price.value,
        sourceOf(given.price),
        (value) => value !== null && set({ price: yours(value) }),
      )}
      {row(
        "Carbon",
        "kg CO₂e per kWh",
        given.carbon.value,
        sourceOf(given.carbon),
        (value) => value !== null && set({ carbon: yours(value) }),
      )}
      {row(
        "Shift",
        "h",
        given.shift,
        given.shift === DEFAULT_ECONOMICS.shift ? "assumed" : "yours",
        (value) => value !== null && set({ shift: value }),
      )}
      {row(
        "Shifts per year",
        "shifts",
        given.shiftsPerYear,
        given.shiftsPerYear === DEFAULT_ECONOMICS.shiftsPerYear
          ? "assumed: two shifts on 230 days"
          : "yours",
        (value) => value !== null && set({ shiftsPerYear: value }),
      )}
      {row(
        "Control box",
        "W",
        given.box?.value ?? null,
        given.box
          ? "yours"
          : "power from the mains while the arm is at rest, minus the arm’s own power",
        (value) => set({ box: value === null ? null : yours(value) }),
        "not included",
      )}
    </div>
  );
}
