// Charts by uPlot, in the colours of the page.
import uPlot from "uplot";
import { style } from "./dom.js";

/** Paths of values that hold until the next one. */
export const steps = uPlot.paths.stepped({ align: 1 });

// each joint has a dash beside its colour
export const DASHES = [[], [7, 3], [2, 3], [10, 3, 2, 3], [4, 2], [12, 4], [1, 2]];
const charts = new Map(); // by the element that shows it

const rem = (size) => size * parseFloat(getComputedStyle(document.documentElement).fontSize);
const sizeOf = (box) => ({ width: Math.max(200, box.clientWidth), height: rem(9.4) });
const widths = new ResizeObserver((all) => requestAnimationFrame(() => all.forEach(({ target }) => charts.get(target)?.setSize(sizeOf(target)))));

/** Draws a chart into an element, instead of the one before: `series` and columns of `data` as uPlot takes them, over the
 * ranges `x` and `y`, with `unit` behind the values of x. */
export function chart(box, series, data, { x, y, unit = "s", cursor = {}, padding = [8, 10, 0, 0] }) {
  charts.get(box)?.destroy();
  const grid = { stroke: style("--line"), width: 1 };
  const axis = (extra) => ({ stroke: style("--ink-2"), grid, ticks: { ...grid, size: 4 }, font: `${rem(0.69)}px system-ui, sans-serif`, ...extra });
  const options = {
    ...sizeOf(box),
    padding,
    scales: { x: { time: false, range: x }, y: { range: y } },
    axes: [axis({ size: rem(1.5), values: (_, values) => values.map((value) => `${+value.toFixed(3)} ${unit}`) }), axis({ size: rem(2.9) })],
    legend: { show: false },
    cursor: { drag: { x: false, y: false }, points: { size: 6 }, ...cursor },
    series: [{}, ...series],
  };
  const drawn = new uPlot(options, data, box);
  charts.set(box, drawn);
  widths.observe(box);
  return drawn;
}

/** A fill of slanted lines. */
export function hatching() {
  const tile = Object.assign(document.createElement("canvas"), { width: 8, height: 8 });
  const pen = tile.getContext("2d");
  pen.strokeStyle = style("--ink-2");
  for (const shift of [-8, 0, 8]) pen.moveTo(shift, 8), pen.lineTo(shift + 8, 0);
  pen.stroke();
  return pen.createPattern(tile, "repeat");
}
