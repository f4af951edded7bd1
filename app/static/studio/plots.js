// Plots over time, tied to the clock: the power, and one quantity of the joints, in SI units or as shares of the limits.
import { chart, DASHES, hatching } from "./chart.js";
import { $, el, figure, style, tabs } from "./dom.js";
import { goTo } from "./player.js";
import { follow, state } from "./store.js";

const QUANTITIES = {
  v: { name: "speed", unit: "rad/s", limit: "velocity" },
  q: { name: "position", unit: "rad" },
  a: { name: "acceleration", unit: "rad/s²", limit: "acceleration" },
  tau: { name: "torque", unit: "N·m", limit: "torque" },
};

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
}

function drawAll() {
  if (!state.answer) return;
  drawPower();
  drawJoints();
}

/** A chart over the time of the motion, with the clock as a line. */
function draw(id, series, data, y) {
  const plot = chart($(id), series, data, { x: [0, Math.max(state.duration, 1e-3)], y });
  plot.line = el("div", { class: "now" });
  plot.over.append(plot.line);
  plot.over.onpointerdown = (event) => {
    plot.over.setPointerCapture(event.pointerId);
    seek(plot, event);
  };
  plot.over.onpointermove = (event) => {
    if (event.buttons) seek(plot, event);
  };
  plot.hooks.setSize = [moveCursor];
  plots[id] = plot;
  moveCursor(plot);
  return plot;
}

const seek = (plot, event) => goTo(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x"));

const moveCursor = (plot) => { plot.line.style.transform = `translateX(${plot.valToPos(state.time, "x")}px)`; };

/** The power, the zero line, and hatching over what flows back to the supply. */
function drawPower() {
  const { t, power } = state.answer.trajectory;
  const green = style("--good");
  const series = [
    { stroke: green, width: 2, fill: `${green}2e`, fillTo: 0 },
    { fill: hatching(), fillTo: 0, width: 0, points: { show: false } },
    { stroke: style("--ink-2"), width: 1, points: { show: false } },
  ];
  const data = [t, power, power.map((watts) => Math.min(0, watts)), t.map(() => 0)];
  const plot = draw("plot-power", series, data, [Math.min(0, ...power) * 1.08, Math.max(1, ...power) * 1.08]);
  plot.root.setAttribute("role", "img");
  plot.root.setAttribute("aria-label", `Power from ${figure(Math.min(...power))} to ${figure(Math.max(...power))} W`);
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
  const extent = 1.12 * (asShares ? 1 : Math.max(1e-6, ...columns.flat().map(Math.abs)));
  const series = robot.joints.map((_, j) => ({ stroke: style(`--joint-${j + 1}`), width: 1.8, dash: DASHES[j], show: !hidden.has(j) }));
  const limits = asShares ? [-1, 1] : [];
  const red = { stroke: style("--bad"), width: 1, dash: [6, 4], points: { show: false } };
  draw("plot-joints", [...series, ...limits.map(() => red)], [answer.trajectory.t, ...columns, ...limits.map((share) => rows.map(() => share))], [-extent, extent]);
  $("joint-title").textContent = `Joint ${name}`;
  $("joint-title").append(el("small", {}, asShares ? " share of the limit" : ` ${unit}`));
  legend(robot.joints);
}

/** The name of a joint, in short. */
export const jointName = (name) => name.replace(/_joint$/, "").replaceAll("_", " ");

function legend(joints) {
  const box = $("plot-joints");
  box.querySelector(".joints")?.remove();
  const toggle = (j, button) => {
    hidden.has(j) ? hidden.delete(j) : hidden.add(j);
    button.setAttribute("aria-pressed", !hidden.has(j));
    plots["plot-joints"].setSeries(j + 1, { show: !hidden.has(j) });
  };
  box.append(el("div", { class: "joints" }, joints.map((name, j) => {
    const button = el("button", { type: "button", class: "joint", "aria-pressed": String(!hidden.has(j)), title: "Show or hide" }, jointName(name));
    button.style.setProperty("--tint", `var(--joint-${j + 1})`);
    button.onclick = () => toggle(j, button);
    return button;
  })));
}
