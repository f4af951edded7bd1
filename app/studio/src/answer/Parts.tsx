import type { Electrical } from "../store/types";
import { figure } from "../store/units";

const PARTS: Record<string, [string, string]> = {
  idle: ["electronics", "Power of the electronics times the duration."],
  friction: ["friction", "Friction loss in the joints."],
  copper: ["copper", "Copper loss in the motor windings."],
  inverter: ["inverters", "Loss in the inverters."],
  potential: ["lifting", "Gain of potential energy from start to goal; negative on the way down."],
  kinetic: ["kinetic", "Gain of kinetic energy; zero from standstill to standstill."],
  braking: ["brake resistor", "Regenerated energy that no joint uses and no storage takes."],
  recovered: ["fed back", "The part of braking that the supply takes back."],
  storage_loss: ["storage", "Loss in the energy storage on the bus."],
  dwell: ["waiting", "Energy drawn while the arm is at rest."],
};
const LEAST = 5e-3; // parts below this share of the total are not listed

/**
 * Where the energy goes: one stacked bar, and the list of its parts. Energy that is fed back is left
 * of the line.
 */
export function Parts({ electrical }: { electrical: Electrical }) {
  const parts = Object.keys(PARTS)
    .map((key) => ({
      key,
      value: electrical[key] ?? 0,
      text: PARTS[key]![0],
      title: PARTS[key]![1],
    }))
    .filter(({ value }) => Math.abs(value) > 1e-9);
  const back = parts.filter(({ value }) => value < 0).reverse();
  const spent = parts.filter(({ value }) => value > 0);
  const bar = ({ key, value, text, title }: (typeof parts)[number]) => (
    <i
      key={key}
      class={`part-${key}`}
      style={{ flexGrow: Math.abs(value) }}
      title={`${text}: ${figure(value)} J. ${title}`}
    />
  );
  const listed = parts.filter(({ value }) => Math.abs(value) > LEAST * Math.abs(electrical.total));
  return (
    <div id="breakdown">
      <div class="stack" role="img" aria-label="Parts of the energy">
        {back.map(bar)}
        {back.length > 0 && <i class="zero" />}
        {spent.map(bar)}
      </div>
      <ul class="parts">
        {listed.map(({ key, value, text, title }) => (
          <li key={key} title={title}>
            <i class={`swatch part-${key}`} />
            {text} <b>{figure(value)} J</b>
          </li>
        ))}
      </ul>
    </div>
  );
}
