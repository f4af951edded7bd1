// Whole rounds: their legs on a time line, played as one motion, and where time and joules go.
import { get } from "./api.js";
import { cellOf } from "./chain.js";
import { $, el, figure } from "./dom.js";
import { goTo } from "./player.js";
import { robotOf } from "./request.js";
import { follow, set, state } from "./store.js";

const REST = 0.1; // time between the samples of a rest [s]

export const createRound = () => follow("round", draw);

/** Shows an answer of POST /cycle: its moves, which are kept answers, and its rests become one motion. Throws Problem. */
export async function showRound(round, request) {
  const robot = await robotOf(round.robot);
  const moves = await Promise.all(round.legs.map(async ({ answer }) => (answer ? (await get(answer)).answer : null)));
  const first = moves.find(Boolean);
  const trajectory = joined(round.legs, moves);
  const worst = round.certificate.clearance;
  const clearance = worst && { ...worst, time: worst.time + round.legs[worst.leg].t0 };
  // what the page shows of a motion, of the whole round; the proven bound of a round is that of its energy
  const answer = {
    ...first, answer: null, arm: null, trajectory, duration: round.duration, status: round.status, energy: round.energy, objective: "electrical",
    baselines: round.baselines.map((each) => ({ ...each, mechanical: 0, reason: each.within_limits ? null : "a limit of a move" })),
    candidates: [], candidate_counts: {}, certificate: { ...first.certificate, ...round.certificate, clearance }, warnings: round.warnings,
    branch: { start: round.legs[0].start, goal: round.legs.at(-1).goal },
  };
  const cell = cellOf({ ...first.arm, ...request, payload: null, robot: round.robot }, robot);
  set({ asked: request, cell, robot, answer, chosen: [], time: 0, duration: round.duration, arms: [{ name: "round", answer }], round });
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

const legName = ({ kind, start, goal }) => (kind === "move" ? `${start.stop} → ${goal.stop}` : `${kind} at ${goal.stop}`);

function draw() {
  const { round } = state;
  $("round").hidden = !round;
  if (!round) return;
  const most = Math.max(...round.legs.map(({ electrical, duration }) => electrical / (duration || Infinity)));
  const legs = round.legs.map((leg) => {
    const name = legName(leg);
    const text = `${name}: ${figure(leg.duration)} s, ${figure(leg.electrical)} J, ${figure(leg.payload_mass)} kg`;
    const button = el("button", { type: "button", class: `leg ${leg.kind}`, title: text, "aria-label": text, onclick: () => goTo(leg.t0) }, el("span", {}, figure(leg.electrical)));
    button.style.flexGrow = leg.duration;
    button.style.setProperty("--height", `${(100 * leg.electrical) / (leg.duration || 1) / most}%`);
    return button;
  });
  const rows = round.legs.filter(({ kind }) => kind === "move" || kind === "path").map((leg) => el("tr", {}, el("td", {}, legName(leg)),
    [leg.duration, leg.electrical, leg.lower_bound].map((value) => el("td", { class: "number" }, figure(value)))));
  const head = el("tr", {}, ["move", "time s", "energy J", "bound J"].map((name) => el("th", {}, name)));
  $("timeline").replaceChildren(el("div", { class: "legs", role: "group", "aria-label": "Legs of the round" }, legs),
    el("p", { class: "hint" }, "As wide as the time, as high as the mean power; the figures are joules. Click to go there."),
    el("table", {}, el("thead", {}, head), el("tbody", {}, rows)));
}
