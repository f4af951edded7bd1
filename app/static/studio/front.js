// The front of energy over time. A click on a point loads its motion.
import { get } from "./api.js";
import { $, el, figure, svg } from "./dom.js";
import { compute, problem, showAnswer } from "./request.js";
import { follow, state } from "./store.js";

const [WIDTH, HEIGHT, LEFT, BOTTOM] = [380, 190, 44, 26];

let front = null; // {points, asked}

export function createFront() {
  $("compute-front").onclick = () => ask().catch(problem);
  follow("answer", draw);
  follow("round", () => { $("compute-front").disabled = Boolean(state.round); });
}

async function ask() {
  const { asked } = state;
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
  const { points } = front;
  const own = { duration: state.answer.duration, energy: state.answer.energy[state.answer.objective].total };
  const all = [...points, own];
  const range = (key) => {
    const values = all.map((each) => each[key]);
    const [least, most] = [Math.min(...values), Math.max(...values)];
    const room = 0.08 * (most - least || most || 1);
    return [least - room, most + room];
  };
  const [t, e] = [range("duration"), range("energy")];
  const x = (duration) => LEFT + ((duration - t[0]) / (t[1] - t[0])) * (WIDTH - LEFT - 8);
  const y = (energy) => HEIGHT - BOTTOM - ((energy - e[0]) / (e[1] - e[0])) * (HEIGHT - BOTTOM - 8);
  const chart = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "front", role: "group", "aria-label": "Energy over duration" });
  for (const [k, value] of ticks(t)) chart.append(svg("line", { x1: x(value), x2: x(value), y1: 4, y2: HEIGHT - BOTTOM, class: "grid" }), svg("text", { x: x(value), y: HEIGHT - 9, class: "tick middle" }, `${figure(value)}${k ? "" : " s"}`));
  for (const [k, value] of ticks(e)) chart.append(svg("line", { x1: LEFT, x2: WIDTH - 8, y1: y(value), y2: y(value), class: "grid" }), svg("text", { x: LEFT - 5, y: y(value) + 4, class: "tick end" }, `${figure(value)}${k ? "" : " J"}`));
  chart.append(svg("polyline", { points: points.map((each) => `${x(each.duration)},${y(each.energy)}`).join(" "), class: "curve" }));
  for (const point of points) {
    const text = `${figure(point.duration)} s, ${figure(point.energy)} J`;
    const dot = svg("circle", { cx: x(point.duration), cy: y(point.energy), r: 5.5, class: "point", tabindex: 0, role: "button", "aria-label": `Load the motion of ${text}` }, svg("title", {}, text));
    dot.onclick = () => load(point).catch(problem);
    dot.onkeydown = (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); event.stopPropagation(); dot.onclick(); } };
    chart.append(dot);
  }
  chart.append(svg("circle", { cx: x(own.duration), cy: y(own.energy), r: 8, class: "present" }, svg("title", {}, "the motion shown")));
  box.replaceChildren(chart, el("p", { class: "hint" }, "Each point is the least energy of its duration. The large one is shown; click another to load it."));
}

/** Some round values of a range. */
function ticks([least, most]) {
  const rough = (most - least) / 4;
  const unit = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * unit).find((each) => each >= rough);
  const found = [];
  for (let value = Math.ceil(least / step) * step; value <= most; value += step) found.push([found.length, value]);
  return found;
}

async function load(point) {
  const { answer } = await get(point.answer);
  await showAnswer(answer, front.asked);
}
