// Charts by uPlot, in the colours of the page.
import uPlot from "uplot";
import { style } from "../ui/style";

/** Paths of values that hold until the next one. */
export const steps = uPlot.paths.stepped!({ align: 1 });

/** Each joint has a dash beside its colour. */
export const DASHES = [[], [7, 3], [2, 3], [10, 3, 2, 3], [4, 2], [12, 4], [1, 2]];

const rem = (size: number) =>
  size * parseFloat(getComputedStyle(document.documentElement).fontSize);

export interface PlotOptions {
  x: uPlot.Range.MinMax | uPlot.Range.Function;
  y: [number, number];
  unit?: string;
  cursor?: uPlot.Cursor;
  height?: number;
}

/** Draws a chart into an element: `series` and columns of `data` as uPlot takes them. */
export function plot(
  box: HTMLElement,
  series: uPlot.Series[],
  data: uPlot.AlignedData,
  { x, y, unit = "s", cursor = {}, height = 8.6 }: PlotOptions,
): uPlot {
  const grid = { stroke: style("--line"), width: 1 };
  const axis = (extra: uPlot.Axis): uPlot.Axis => ({
    stroke: style("--ink-2"),
    grid,
    ticks: { ...grid, size: 4 },
    font: `${rem(0.69)}px Inter, system-ui, sans-serif`,
    ...extra,
  });
  return new uPlot(
    {
      width: Math.max(120, box.clientWidth),
      height: rem(height),
      padding: [8, 10, 0, 0],
      scales: { x: { time: false, range: x as uPlot.Range.MinMax }, y: { range: y } },
      axes: [
        axis({
          size: rem(1.5),
          values: (_, values) => values.map((value) => `${+value.toFixed(3)} ${unit}`),
        }),
        axis({ size: rem(2.9) }),
      ],
      legend: { show: false },
      cursor: { drag: { x: false, y: false }, points: { size: 6 }, ...cursor },
      series: [{}, ...series],
    },
    data,
    box,
  );
}

/** A fill of slanted lines. */
export function hatching(): CanvasPattern {
  const tile = Object.assign(document.createElement("canvas"), { width: 8, height: 8 });
  const pen = tile.getContext("2d")!;
  pen.strokeStyle = style("--ink-2");
  for (const shift of [-8, 0, 8]) {
    pen.moveTo(shift, 8);
    pen.lineTo(shift + 8, 0);
  }
  pen.stroke();
  return pen.createPattern(tile, "repeat")!;
}
