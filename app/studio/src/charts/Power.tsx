import { useMemo } from "preact/hooks";
import { dark } from "../ui/dark";
import { style } from "../ui/style";
import { answered, duration } from "../store/state";
import { figure } from "../store/units";
import { Chart } from "./Chart";
import { hatching } from "./plot";

/** The power from the supply, the zero line, and hatching over what flows back. */
export function Power() {
  const { t, power } = answered.value!.solution.trajectory;
  const scheme = dark.value;
  const data = useMemo(
    () =>
      [t, power, power.map((watts) => Math.min(0, watts)), t.map(() => 0)] as [
        number[],
        ...number[][],
      ],
    [t],
  );
  const series = useMemo(() => {
    const green = style("--good");
    return [
      { stroke: green, width: 2, fill: `${green}2e`, fillTo: 0, points: { show: false } },
      { fill: hatching(), fillTo: 0, width: 0, points: { show: false } },
      { stroke: style("--ink-2"), width: 1, points: { show: false } },
    ];
  }, [t, scheme]);
  const [least, most] = [Math.min(...power), Math.max(...power)];
  return (
    <Chart
      id="plot-power"
      label={`Power from ${figure(least)} to ${figure(most)} W`}
      series={series}
      data={data}
      options={{
        x: [0, Math.max(duration.value, 1e-3)],
        y: [Math.min(0, least) * 1.08, Math.max(1, most) * 1.08],
      }}
      clocked
    />
  );
}
