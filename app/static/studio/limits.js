// How much of each limit the motion uses. A click goes to the instant where it uses most.
import { $, el, figure, percent } from "./dom.js";
import { goTo } from "./player.js";
import { limitedTorque } from "./plots.js";
import { follow, state } from "./store.js";

const NAMES = {
  position: "position", velocity: "speed", acceleration: "acceleration", jerk: "jerk", torque: "torque", tool_cone: "tool cone",
  tcp_speed: "TCP speed", elbow_speed: "elbow speed", path_position: "path, position", path_rotation: "path, turn", path_speed: "least path speed",
};
const FULL = 0.995; // share of a limit that counts as reached

export const createLimits = () => follow("answer robot", () => state.answer && $("limits").replaceChildren(...content()));

function content() {
  const { worst_ratio, clearance, goal_error } = state.answer.certificate;
  const rows = Object.entries(worst_ratio).filter(([, share]) => share !== null && share !== undefined);
  const list = el("ol", { class: "bars" }, rows.map(([name, share]) => row(name, share)));
  const facts = [];
  if (clearance) {
    const text = `clearance beyond the margins ${figure(clearance.sampled * 1000)} mm, proven ${figure(clearance.min_clearance * 1000)} mm: ${clearance.pair.join(" – ")}`;
    facts.push(el("button", { type: "button", class: "jump", onclick: () => goTo(clearance.time) }, text));
  }
  facts.push(el("p", { class: "hint" }, `The goal is met within ${figure(goal_error.position * 1000, 2)} mm and ${figure(goal_error.rotation, 2)} rad. Checked by a second program, apart from the solver.`));
  return [list, ...facts];
}

function row(name, share) {
  const time = worstTime(name);
  const fill = el("span", { class: `fill ${share > FULL ? "own" : "other"}` });
  fill.style.width = `${Math.min(100, share * 100)}%`;
  const parts = [el("span", { class: "name" }, NAMES[name] ?? name), el("span", { class: "track" }, fill), el("span", { class: "value" }, percent(share))];
  if (time === null) return el("li", {}, parts);
  return el("li", {}, el("button", { type: "button", class: "jump row", title: `Worst at ${figure(time)} s`, onclick: () => goTo(time) }, parts));
}

/** Time of the sample that uses most of a limit; null where the samples do not tell. */
export function worstTime(name) {
  const { trajectory, limits } = state.answer;
  const { t, q, v, a } = trajectory;
  const shares = {
    position: () => q.map((row) => row.map((x, j) => Math.abs(2 * x - limits.position_min[j] - limits.position_max[j]) / (limits.position_max[j] - limits.position_min[j]))),
    velocity: () => of(v, limits.velocity),
    acceleration: () => of(a, limits.acceleration),
    jerk: () => of(a.slice(1).map((row, k) => row.map((x, j) => (x - a[k][j]) / (t[k + 1] - t[k]))), limits.jerk),
    torque: () => of(limitedTorque(state), limits.torque),
  }[name];
  if (!shares) return null;
  const worst = shares().map((row) => Math.max(...row));
  return t[worst.indexOf(Math.max(...worst))];
}

const of = (rows, most) => rows.map((row) => row.map((x, j) => (most[j] === null ? 0 : Math.abs(x) / most[j])));
