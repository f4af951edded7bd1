// Whole cycles: their legs on a time line, played as one motion, and where time and joules go.
import { get } from "./api.js";
import { cellOf } from "./chain.js";
import { $, el, figure, table } from "./dom.js";
import { goTo } from "./player.js";
import { robotOf } from "./request.js";
import { follow, set, state } from "./store.js";

const REST = 0.1; // time between the samples of a rest [s]

export function createCycle() {
  follow("cycle", draw);
  follow("time", mark);
}

/** Shows an answer of POST /cycle: its moves, which are kept answers, and its rests become one motion. Throws Problem. */
export async function showCycle(cycle, request) {
  const robot = await robotOf(cycle.robot);
  const moves = await Promise.all(cycle.legs.map(async ({ answer }) => (answer ? (await get(answer)).answer : null)));
  const first = moves.find(Boolean);
  const trajectory = joined(cycle.legs, moves);
  const worst = cycle.certificate.clearance;
  const clearance = worst && { ...worst, time: worst.time + cycle.legs[worst.leg].t0 };
  // what the page shows of a motion, of the whole cycle; the proven bound of a cycle is that of its energy
  const answer = {
    ...first, answer: cycle.answer ?? null, arm: null, trajectory, duration: cycle.duration, status: cycle.status, energy: cycle.energy, objective: "electrical",
    baselines: cycle.baselines.map((each) => ({ ...each, mechanical: 0, reason: each.within_limits ? null : "a limit of a move" })),
    candidates: [], candidate_counts: {}, certificate: { ...first.certificate, ...cycle.certificate, clearance }, warnings: cycle.warnings,
    branch: { start: cycle.legs[0].start, goal: cycle.legs.at(-1).goal },
  };
  const asked = { ...first.arm, ...request };
  const cell = cellOf({ ...asked, robot: cycle.robot }, robot);
  const shown = { ...cycle, loads: loadsOf(cycle.legs, moves, asked) };
  set({ asked: request, cell, robot, answer, chosen: [], time: 0, duration: cycle.duration, arms: [{ name: "cycle", answer }], cycle: shown });
}

/** The samples of all legs in a row. A rest holds its configuration, and draws its mean power. */
function joined(legs, moves) {
  const names = ["q", "v", "a", "tau", "tau_motor", "power"];
  const whole = { t: [], ...Object.fromEntries(names.map((name) => [name, []])) };
  legs.forEach((leg, k) => {
    const move = moves[k]?.trajectory ?? resting(leg);
    move.t.forEach((time, sample) => {
      whole.t.push(leg.t0 + time);
      for (const name of names) whole[name].push(move[name][sample]);
    });
  });
  return whole;
}

function resting({ duration, start, electrical }) {
  const count = Math.max(2, Math.ceil(duration / REST));
  const t = Array.from({ length: count }, (_, k) => (duration * k) / (count - 1));
  const still = start.q.map(() => 0);
  const of = (value) => t.map(() => value);
  return { t, q: of(start.q), v: of(still), a: of(still), tau: of(still), tau_motor: of(still), power: of(electrical / (duration || 1)) };
}

const legName = ({ kind, start, passes, goal }) => (kind === "move" ? [start, ...(passes ?? []), goal].map(({ stop }) => stop).join(" → ") : `${kind} at ${goal.stop}`);

/** What the arm carries from each leg on, and the obstacles that do not count then: as the moves' answers say. */
function loadsOf(legs, moves, { payload = null, scene }) {
  const all = (scene?.obstacles ?? []).map(({ name }) => name);
  return legs.map(({ t0 }, k) => {
    // at a stop the arm carries what it carries on its next move
    const arm = [...moves.slice(k), ...moves.slice(0, k).toReversed()].find(Boolean).arm ?? { payload };
    const counted = new Set((arm.scene ?? { obstacles: [] }).obstacles.map(({ name }) => name));
    return { t0, payload: arm.payload ?? null, ignored: arm.scene ? all.filter((name) => !counted.has(name)) : [] };
  });
}

/** Number of the leg at a time of the cycle. */
export const legAt = (legs, time) => Math.max(0, legs.findLastIndex(({ t0 }) => t0 <= time + 1e-9));

function draw() {
  const { cycle } = state;
  $("cycle").hidden = !cycle;
  if (!cycle) return;
  const most = Math.max(...cycle.legs.map(({ electrical, duration }) => electrical / (duration || Infinity)));
  const legs = cycle.legs.map((leg) => {
    const text = `${legName(leg)}: ${figure(leg.duration)} s, ${figure(leg.electrical)} J, ${figure(leg.payload_mass)} kg`;
    const button = el("button", { type: "button", class: `leg ${leg.kind}`, title: text, "aria-label": text, onclick: () => goTo(leg.t0) }, el("span", {}, figure(leg.electrical)));
    button.style.flexGrow = leg.duration;
    button.style.setProperty("--height", `${(100 * leg.electrical) / (leg.duration || 1) / most}%`);
    return button;
  });
  const jump = (leg) => el("button", { type: "button", class: "jump", onclick: () => goTo(leg.t0) }, legName(leg));
  const rows = cycle.legs.map((leg) => ({ class: leg.answer ? null : "rest", cells: [jump(leg), leg.duration, leg.electrical, leg.lower_bound, leg.payload_mass] }));
  $("timeline").replaceChildren(el("div", { class: "legs", role: "group", "aria-label": "Legs of the cycle" }, legs),
    el("p", { class: "hint" }, "As wide as the time, as high as the mean power; the figures are joules. Click to go there."),
    table(["leg", "s", "J", "bound J", "kg"], rows));
  mark();
}

/** Which leg the arm is on now. */
function mark() {
  if (!state.cycle) return;
  const now = legAt(state.cycle.legs, state.time);
  for (const list of $("timeline").querySelectorAll(".legs, tbody")) [...list.children].forEach((each, k) => each.toggleAttribute("data-now", k === now));
}
