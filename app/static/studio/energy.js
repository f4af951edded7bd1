// Where the energy goes: its parts as one stacked bar; and the savings against other planners, down to the proven bound.
import { $, el, figure, percent } from "./dom.js";
import { follow, state } from "./store.js";

const PARTS = {
  idle: ["electronics", "Power of the electronics times the duration."],
  friction: ["friction", "Friction loss in the joints."],
  copper: ["copper", "Copper loss in the motor windings."],
  inverter: ["inverters", "Loss in the inverters."],
  potential: ["lifting", "Gain of potential energy from start to goal; negative on the way down."],
  kinetic: ["kinetic", "Gain of kinetic energy; zero from standstill to standstill."],
  braking: ["braking", "Regenerated energy that no joint uses and no storage takes."],
  recovered: ["given back", "The part of braking that the supply takes back."],
  storage_loss: ["storage", "Loss in the energy storage on the bus."],
  dwell: ["waiting", "Energy drawn while the arm waits at the goal."],
};
const LEAST = 5e-3; // parts below this share of the total are not listed
const NAMES = {
  trapezoid: "trapezoid", quintic: "quintic", ruckig: "time-optimal (ruckig)", ruckig_slowed: "time-optimal, slowed", controller_default: "controller default",
  move_by_move: "each move by itself", same_factor: "all moves slowed alike", fastest_then_wait: "fastest, then a wait", given_order: "in the given order",
};

export function createEnergy() {
  follow("answer", () => {
    if (!state.answer) return;
    $("breakdown").replaceChildren(...breakdown(state.answer.energy.electrical));
    $("waterfall").replaceChildren(...waterfall(state.answer));
  });
}

/** A stacked bar of an `ElectricalEnergy`, and the list of its parts. */
export function breakdown(electrical) {
  const drawn = Object.keys(PARTS).map((key) => ({ key, value: electrical[key] ?? 0 })).filter(({ value }) => Math.abs(value) > 1e-9);
  const part = ({ key, value }) => {
    const node = el("i", { class: `part-${key}`, title: `${PARTS[key][0]}: ${figure(value)} J. ${PARTS[key][1]}` });
    node.style.flexGrow = Math.abs(value);
    return node;
  };
  const back = drawn.filter(({ value }) => value < 0).toReversed();
  const spent = drawn.filter(({ value }) => value > 0);
  const zero = back.length ? el("i", { class: "zero" }) : null;
  const bar = el("div", { class: "stack", role: "img", "aria-label": "Parts of the energy" }, back.map(part), zero, spent.map(part));
  const listed = drawn.filter(({ value }) => Math.abs(value) > LEAST * Math.abs(electrical.total));
  const list = el("ul", { class: "parts" }, listed.map(({ key, value }) =>
    el("li", { title: PARTS[key][1] }, el("i", { class: `swatch part-${key}` }), el("span", {}, PARTS[key][0]), el("b", {}, `${figure(value)} J`))));
  return [bar, list];
}

function waterfall(answer) {
  const objective = answer.objective;
  const ours = answer.energy[objective].total;
  const rows = [
    ...answer.baselines.map((each) => ({ name: NAMES[each.name] ?? each.name, energy: each[objective], duration: each.duration, reason: each.reason })),
    { name: "this motion", energy: ours, duration: answer.duration, ours: true },
    { name: "proven bound", energy: answer.energy.lower_bound, bound: true },
  ];
  // rows that are of the same height keep their order: this motion above the bound
  rows.sort((a, b) => b.energy - a.energy);
  const most = Math.max(...rows.map(({ energy }) => energy), 1e-9);
  return [el("ol", { class: "bars steps" }, rows.map((row, k) => bar(row, rows[k - 1]?.energy, ours, most))),
    el("p", { class: "hint" }, "Hatched: breaks a limit, so it is no alternative. No motion of any kind needs less than the proven bound.")];
}

/** A row; from the one above (`before` [J]), a step leads down to it. */
function bar({ name, energy, duration, reason, ours: own, bound }, before, ours, most) {
  const kind = own ? "own" : bound ? "bound" : reason ? "broken" : "other";
  const saving = energy ? (energy - ours) / Math.abs(energy) : 0;
  const against = own || bound || reason ? null : el("em", {}, `${saving >= 0 ? "−" : "+"}${percent(Math.abs(saving), 2)}`);
  const fill = el("span", { class: `fill ${kind}` });
  const share = (value) => Math.max(0, (100 * value) / most);
  fill.style.width = `${share(energy)}%`;
  const step = el("i", { class: "step" });
  step.style.left = fill.style.width;
  step.style.width = `${Math.max(0, share(before ?? energy) - share(energy))}%`;
  return el("li", { class: kind },
    el("span", { class: "name" }, name, duration ? el("small", {}, ` ${figure(duration)} s`) : null),
    el("span", { class: "track" }, fill, step),
    el("span", { class: "value" }, figure(energy), against),
    reason ? el("small", { class: "reason" }, `breaks: ${reason}`) : null);
}
