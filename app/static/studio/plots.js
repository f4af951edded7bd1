// Plots over time, tied to the clock: the power, and one quantity of the joints, in SI units or as shares of the limits.
import uPlot from "uplot";
import { $, el, figure, style, tabs } from "./dom.js";
import { goTo } from "./player.js";
import { follow, state } from "./store.js";

const QUANTITIES = {
  v: { name: "speed", unit: "rad/s", limit: "velocity" },
  q: { name: "position", unit: "rad" },
  a: { name: "acceleration", unit: "rad/s²", limit: "acceleration" },
  tau: { name: "torque", unit: "N·m", limit: "torque" },
};
// each joint has a dash beside its colour
const DASHES = [[], [7, 3], [2, 3], [10, 3, 2, 3], [4, 2], [12, 4], [1, 2]];

let quantity = "v";
const plots = {};
const hidden = new Set();

export function createPlots() {
  const list = $("quantities");
  for (const [key, { name }] of Object.entries(QUANTITIES))
    list.append(el("button", { role: "tab", "aria-selected": String(key === quantity), tabindex: key === quantity ? 0 : -1, "data-key": key, "aria-controls": "plot-joints", type: "button" }, name));
  tabs(list, (button) => {
    quantity = button.dataset.key;
    drawJoints();
  });
  $("shares").onchange = drawJoints;
  follow("answer", drawAll);
  follow("time", () => Object.values(plots).forEach(moveCursor));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);
  let waiting;
  new ResizeObserver(() => {
    clearTimeout(waiting);
    waiting = setTimeout(() => Object.values(plots).forEach((plot) => plot.setSize(sizeOf(plot.root.parentNode))), 60);
  }).observe($("plot-power"));
}

function drawAll() {
  if (!state.answer) return;
  drawPower();
  drawJoints();
}

const sizeOf = (box) => ({ width: Math.max(200, box.clientWidth), height: rem(9.4) });
const rem = (size) => size * parseFloat(getComputedStyle(document.documentElement).fontSize);

function axis(extra = {}) {
  const grid = { stroke: style("--line"), width: 1 };
  return { stroke: style("--ink-2"), grid, ticks: { ...grid, size: 4 }, font: `${rem(0.69)}px system-ui, sans-serif`, ...extra };
}

function draw(id, series, data, extra = {}) {
  const box = $(id);
  plots[id]?.destroy();
  const options = {
    ...sizeOf(box),
    scales: { x: { time: false, range: [0, Math.max(state.duration, 1e-3)] }, ...extra.scales },
    axes: [axis({ size: rem(1.5), values: (_, values) => values.map((t) => `${+t.toFixed(3)} s`) }), axis({ size: rem(2.9) })],
    legend: { show: false },
    cursor: { drag: { x: false, y: false }, points: { size: 6 } },
    padding: [8, 10, 0, 0],
    series: [{}, ...series],
    hooks: extra.hooks ?? {},
  };
  const plot = new uPlot(options, data, box);
  plot.line = el("div", { class: "now" });
  plot.over.append(plot.line);
  plot.over.onpointerdown = (event) => {
    plot.over.setPointerCapture(event.pointerId);
    seek(plot, event);
  };
  plot.over.onpointermove = (event) => {
    if (event.buttons) seek(plot, event);
  };
  plots[id] = plot;
  moveCursor(plot);
  return plot;
}

const seek = (plot, event) => goTo(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x"));

const moveCursor = (plot) => { plot.line.style.transform = `translateX(${plot.valToPos(state.time, "x")}px)`; };

function drawPower() {
  const { t, power } = state.answer.trajectory;
  const green = style("--good");
  const floor = Math.min(0, ...power);
  const plot = draw("plot-power", [{ stroke: green, width: 2, fill: `${green}2e`, fillTo: 0 }], [t, power], {
    scales: { y: { range: [floor * 1.08, Math.max(1, ...power) * 1.08] } },
    hooks: { draw: [zeroAndRecovered] },
  });
  plot.root.setAttribute("role", "img");
  plot.root.setAttribute("aria-label", `Power from ${figure(Math.min(...power))} to ${figure(Math.max(...power))} W`);
}

/** The zero line, and hatching over what flows back to the supply. */
function zeroAndRecovered(plot) {
  const { ctx, bbox } = plot;
  const zero = plot.valToPos(0, "y", true);
  ctx.save();
  ctx.strokeStyle = style("--ink-2");
  ctx.beginPath();
  ctx.moveTo(bbox.left, zero);
  ctx.lineTo(bbox.left + bbox.width, zero);
  ctx.stroke();
  const [t, power] = plot.data;
  ctx.beginPath();
  ctx.moveTo(plot.valToPos(t[0], "x", true), zero);
  t.forEach((time, k) => ctx.lineTo(plot.valToPos(time, "x", true), plot.valToPos(Math.min(0, power[k]), "y", true)));
  ctx.lineTo(plot.valToPos(t.at(-1), "x", true), zero);
  ctx.clip();
  ctx.beginPath();
  for (let x = bbox.left - bbox.height; x < bbox.left + bbox.width; x += 7) {
    ctx.moveTo(x, bbox.top + bbox.height);
    ctx.lineTo(x + bbox.height, bbox.top);
  }
  ctx.stroke();
  ctx.restore();
}

/** The samples that a torque limit is for: those of the motor, or those of the link. */
export const limitedTorque = ({ robot, answer }) => answer.trajectory[robot.limits.torque_side?.value === "link" ? "tau" : "tau_motor"];

function drawJoints() {
  if (!state.answer) return;
  const { answer, robot } = state;
  const { name, unit, limit } = QUANTITIES[quantity];
  const asShares = $("shares").checked;
  const rows = quantity === "tau" ? limitedTorque(state) : answer.trajectory[quantity];
  const { position_min: least, position_max: most } = answer.limits;
  const value = (x, j) => {
    if (!asShares) return x;
    if (quantity === "q") return (2 * x - least[j] - most[j]) / (most[j] - least[j]);
    return x / answer.limits[limit][j];
  };
  const columns = robot.joints.map((_, j) => rows.map((row) => value(row[j], j)));
  const extent = asShares ? 1 : Math.max(1e-6, ...columns.flat().map(Math.abs));
  const series = robot.joints.map((_, j) => ({ stroke: style(`--joint-${j + 1}`), width: 1.8, dash: DASHES[j], show: !hidden.has(j) }));
  draw("plot-joints", series, [answer.trajectory.t, ...columns], {
    scales: { y: { range: [-extent * 1.12, extent * 1.12] } },
    hooks: { draw: asShares ? [limitLines] : [] },
  });
  $("joint-title").textContent = `Joint ${name}`;
  $("joint-title").append(el("small", {}, asShares ? " share of the limit" : ` ${unit}`));
  legend(robot.joints);
}

function limitLines(plot) {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.strokeStyle = style("--bad");
  ctx.setLineDash([6, 4]);
  ctx.beginPath();
  for (const share of [-1, 1]) {
    const y = plot.valToPos(share, "y", true);
    ctx.moveTo(bbox.left, y);
    ctx.lineTo(bbox.left + bbox.width, y);
  }
  ctx.stroke();
  ctx.restore();
}

function legend(joints) {
  const box = $("plot-joints");
  box.querySelector(".joints")?.remove();
  const toggle = (j, button) => {
    hidden.has(j) ? hidden.delete(j) : hidden.add(j);
    button.setAttribute("aria-pressed", !hidden.has(j));
    plots["plot-joints"].setSeries(j + 1, { show: !hidden.has(j) });
  };
  box.append(el("div", { class: "joints" }, joints.map((name, j) => {
    const button = el("button", { type: "button", class: "joint", "aria-pressed": String(!hidden.has(j)), title: "Show or hide" }, name.replace(/_joint$/, "").replaceAll("_", " "));
    button.style.setProperty("--tint", `var(--joint-${j + 1})`);
    button.onclick = () => toggle(j, button);
    return button;
  })));
}
