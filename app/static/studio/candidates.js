// The table of candidates: choose branches to see them as ghosts, compute one to let both arms move on one clock.
import { $, el, table } from "./dom.js";
import { play } from "./player.js";
import { compute, optimise, problem } from "./request.js";
import { embedded } from "./standalone.js";
import { follow, set, state } from "./store.js";

const MOST = 4; // ghosts at a time
const MOST_ROWS = 200;
const COLUMNS = [["goal", "goal"], ["status", "status"], ["lower_bound", "bound J"], ["energy", "energy J"], ["duration", "time s"]];

let order = "lower_bound";

export function createCandidates() {
  $("candidate-filter").onchange = draw;
  follow("answer chosen", draw);
}

function draw() {
  const { answer } = state;
  if (!answer) return;
  const counts = Object.entries(answer.candidate_counts).filter(([, count]) => count);
  const total = counts.reduce((sum, [, count]) => sum + count, 0);
  $("candidate-counts").textContent = counts.map(([status, count]) => `${count} ${status}`).join(", ");
  const filter = $("candidate-filter").value;
  const rows = answer.candidates.filter(({ status }) => !filter || status === filter).toSorted(compare);
  const head = COLUMNS.map(([key, name]) => el("th", { "aria-sort": key === order ? "ascending" : "none" }, el("button", { type: "button", onclick: () => { order = key; draw(); } }, name)));
  const more = [];
  if (rows.length > MOST_ROWS) more.push(el("p", { class: "hint" }, `${MOST_ROWS} of ${rows.length} are listed.`));
  if (answer.candidates.length < total && !embedded()) more.push(el("button", { type: "button", onclick: () => optimise({ ...state.asked, candidates: "all" }).catch(problem) }, `List all ${total} (computes again)`));
  $("candidates").replaceChildren(rows.length ? table(["show", ...head, ""], rows.slice(0, MOST_ROWS).map(row)) : el("p", { class: "hint" }, "None with this status."), ...more);
}

const compare = (a, b) => {
  const [x, y] = [a[order], b[order]];
  if (typeof x === "string") return x.localeCompare(y);
  return (x ?? Infinity) - (y ?? Infinity);
};

function row(candidate) {
  const chosen = state.chosen.includes(candidate);
  const label = `${candidate.start} to ${candidate.goal}`;
  const box = el("input", { type: "checkbox", checked: chosen, "aria-label": `Show ${label}` });
  box.onchange = () => {
    const others = state.chosen.filter((each) => each !== candidate);
    set({ chosen: box.checked ? [...others, candidate].slice(-MOST) : others });
  };
  const best = candidate.q_goal.every((x, j) => Math.abs(x - state.answer.branch.goal.q[j]) < 1e-6) && candidate.q_start.every((x, j) => Math.abs(x - state.answer.branch.start.q[j]) < 1e-6);
  const [goal, start] = [candidate.goal, candidate.start].map((text) => text.replaceAll("/", "/\u200b")); // may break there
  const name = [goal, start === goal ? null : el("small", {}, ` from ${start}`)];
  const button = best || embedded() ? "" : el("button", { type: "button", onclick: () => beside(candidate).catch(problem) }, "compute");
  return { title: candidate.reason, class: best ? "best" : candidate.status, cells: [box, name, best ? "this motion" : candidate.refined === false ? "solved roughly" : candidate.status, candidate.lower_bound, candidate.energy, candidate.duration, button] };
}

/** Computes one branch, and lets its arm move beside the answer's. Throws Problem. */
async function beside({ q_start, q_goal, goal }) {
  const { asked, arms, duration } = state;
  const answer = await compute("optimize", { ...asked, start: { q: q_start }, goal: { q: q_goal }, branch: null, windings: false });
  if (!answer) return;
  const colours = [0, 0xee6677, 0x228833, 0xaa3377];
  const others = arms.filter(({ name }) => name !== goal).slice(0, MOST - 1);
  set({ arms: [...others, { name: goal, answer, colour: colours[others.length] }], duration: Math.max(duration, answer.duration), time: 0, playing: false });
  play();
}
