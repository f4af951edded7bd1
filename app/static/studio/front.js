// The front of energy over time. A click on a point loads its motion.
import { get } from "./api.js";
import { chart } from "./chart.js";
import { $, el, figure, style } from "./dom.js";
import { compute, problem, showAnswer } from "./request.js";
import { follow, state } from "./store.js";

let front = null; // {points, asked}

export function createFront() {
  $("compute-front").onclick = () => ask().catch(problem);
  follow("answer", draw);
  follow("cycle", () => { $("compute-front").disabled = Boolean(state.cycle); });
}

async function ask() {
  const asked = state.asked ?? state.request;
  const range = typeof asked.duration === "number" ? null : (asked.duration ?? null);
  const { path, ...rest } = asked;
  const answer = await compute("pareto", { ...rest, ...(path ? { path } : {}), duration: range, candidates: "none", deadline: Math.max(30, asked.deadline ?? 10) });
  if (!answer) return;
  front = { points: answer.points, asked };
  draw();
}

function draw() {
  const box = $("front");
  if (!front || state.asked !== front.asked) return box.replaceChildren(el("p", { class: "hint" }, "How much a slower or faster motion would need."));
  box.replaceChildren();
  const own = { duration: state.answer.duration, energy: state.answer.energy[state.answer.objective].total };
  const { points } = front;
  const range = (key) => {
    const values = [...points, own].map((each) => each[key]);
    const [least, most] = [Math.min(...values), Math.max(...values)];
    const room = 0.08 * (most - least || most || 1);
    return [least - room, most + room];
  };
  const [x, y] = [range("duration"), range("energy")];
  const plot = chart(box, [{ stroke: style("--good"), width: 2, points: { show: false } }], [points.map(({ duration }) => duration), points.map(({ energy }) => energy)], { x, y });
  const place = (node, { duration, energy }) => {
    node.style.left = `${(100 * (duration - x[0])) / (x[1] - x[0])}%`;
    node.style.top = `${(100 * (y[1] - energy)) / (y[1] - y[0])}%`;
    return node;
  };
  plot.over.append(...points.map((point) => {
    const text = `${figure(point.duration)} s, ${figure(point.energy)} J`;
    return place(el("button", { type: "button", class: "point", title: text, "aria-label": `Load the motion of ${text}`, onclick: () => load(point.answer).catch(problem) }), point);
  }), place(el("i", { class: "present", title: "the motion shown" }), own));
  box.append(el("p", { class: "hint" }, "J over s: each point is the least energy of its duration. The large one is shown; click another to load it."));
}

const load = async (path) => showAnswer((await get(path)).answer, front.asked);
