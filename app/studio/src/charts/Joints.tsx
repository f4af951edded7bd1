import { signal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { dark } from "../ui/dark";
import { style } from "../ui/style";
import { Tabs } from "../ui/Tabs";
import { answered, duration, type Answered } from "../store/state";
import { jointName } from "../store/units";
import { Chart } from "./Chart";
import { limitedTorque } from "./limited";
import { DASHES } from "./plot";

type Quantity = "v" | "q" | "a" | "tau";

const QUANTITIES: Record<
  Quantity,
  { name: string; unit: string; limit: "velocity" | "acceleration" | "torque" | null }
> = {
  v: { name: "Speed", unit: "rad/s", limit: "velocity" },
  q: { name: "Angle", unit: "rad", limit: null },
  a: { name: "Acceleration", unit: "rad/s²", limit: "acceleration" },
  tau: { name: "Torque", unit: "N·m", limit: "torque" },
};

const quantity = signal<Quantity>("v");
const shares = signal(true);
const hidden = signal<ReadonlySet<number>>(new Set());

function columnsOf(shown: Answered, of: Quantity, asShares: boolean): number[][] {
  const { trajectory, limits } = shown.solution;
  const rows = of === "tau" ? limitedTorque(shown) : trajectory[of];
  const limit = QUANTITIES[of].limit;
  const value = (x: number, j: number) => {
    if (!asShares) return x;
    if (limit) return x / limits[limit][j]!;
    const [least, most] = [limits.position_min[j]!, limits.position_max[j]!];
    return (2 * x - least - most) / (most - least);
  };
  return shown.robot.joints.map((_, j) => rows.map((row) => value(row[j]!, j)));
}

/** One quantity of all joints over time, as shares of the limits in force or in SI units. */
export function Joints() {
  const shown = answered.value!;
  const scheme = dark.value;
  const now = quantity.value;
  const asShares = shares.value;
  const { t } = shown.solution.trajectory;
  const columns = useMemo(() => columnsOf(shown, now, asShares), [shown, now, asShares]);
  const limits = asShares ? [-1, 1] : [];
  const data = useMemo(
    () =>
      [t, ...columns, ...limits.map((share) => t.map(() => share))] as [number[], ...number[][]],
    [columns],
  );
  const series = useMemo(() => {
    const lines = shown.robot.joints.map((_, j) => ({
      stroke: style(`--joint-${j + 1}`),
      width: 1.8,
      dash: DASHES[j],
      show: !hidden.value.has(j),
      points: { show: false },
    }));
    const red = { stroke: style("--bad"), width: 1, dash: [6, 4], points: { show: false } };
    return [...lines, ...limits.map(() => red)];
  }, [columns, scheme, hidden.value]);
  const extent = 1.12 * (asShares ? 1 : Math.max(1e-6, ...columns.flat().map(Math.abs)));
  const { name, unit } = QUANTITIES[now];
  const flip = (j: number) => {
    const next = new Set(hidden.value);
    if (!next.delete(j)) next.add(j);
    hidden.value = next;
  };
  return (
    <>
      <div class="chart-head">
        <Tabs
          label="Quantity"
          options={(Object.keys(QUANTITIES) as Quantity[]).map((value) => ({
            value,
            text: QUANTITIES[value].name,
          }))}
          value={now}
          onChange={(next) => (quantity.value = next)}
          controls="joint-chart"
        />
        <label class="share" id="joint-title">
          <input
            id="shares"
            type="checkbox"
            checked={asShares}
            onChange={(event) => (shares.value = event.currentTarget.checked)}
          />{" "}
          {asShares ? "share of the limit" : unit}
        </label>
      </div>
      <div id="joint-chart" role="tabpanel" aria-label={`Joint ${name.toLowerCase()}`}>
        <Chart
          id="plot-joints"
          label={`${name} of the joints`}
          series={series}
          data={data}
          options={{ x: [0, Math.max(duration.value, 1e-3)], y: [-extent, extent], height: 7.2 }}
          clocked
        />
      </div>
      <div class="joints">
        {shown.robot.joints.map((joint, j) => (
          <button
            type="button"
            class="joint"
            key={joint}
            aria-pressed={!hidden.value.has(j)}
            title="Show or hide"
            onClick={() => flip(j)}
          >
            <svg viewBox="0 0 22 4" aria-hidden="true">
              <line
                x1="0"
                x2="22"
                y1="2"
                y2="2"
                stroke={`var(--joint-${j + 1})`}
                stroke-width="2.4"
                stroke-dasharray={DASHES[j]!.join(" ")}
              />
            </svg>
            {jointName(joint)}
          </button>
        ))}
      </div>
    </>
  );
}
