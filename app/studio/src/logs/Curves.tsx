import { useMemo, useState } from "preact/hooks";
import type uPlot from "uplot";
import { Chart } from "../charts/Chart";
import { dark } from "../ui/dark";
import { style } from "../ui/style";
import type { Robot } from "../store/types";
import { figure, jointName } from "../store/units";
import type { MoveCurves } from "./model";

const APART = 1e-6; // after a move, where its curve ends [s]
const KEYS: [string, string][] = [
  ["measured", "--ink-2"],
  ["modelled", "--good"],
  ["residual", "--bad"],
  ["held out: predicted by a fit without this move", "--held"],
];

type Samples = (number | null)[];
type Pair = { measured: Samples; modelled: Samples };

interface Props {
  moves: MoveCurves[];
  logs: { id: string; name: string | null }[];
  robot: Robot;
}

/** Charts of all joints and of the power, of the moves that a list chooses. */
export function Curves({ moves, logs, robot }: Props) {
  const [index, setIndex] = useState(0);
  const ids = [...new Set(moves.map(({ log }) => log))];
  const options = ids.flatMap((id): [string, MoveCurves[]][] => {
    const own = moves.filter(({ log }) => log === id).sort((a, b) => a.t[0]! - b.t[0]!);
    const name = logs.find((log) => log.id === id)?.name ?? `log ${id.slice(0, 8)}`;
    return [
      [`${name}: all moves`, own],
      ...own.map((move, k): [string, MoveCurves[]] => [
        `${name}: move ${k + 1}${move.held_out ? ", held out" : ""}`,
        [move],
      ]),
    ];
  });
  const chosen = options[index]?.[1] ?? [];
  if (!moves.length)
    return (
      <article class="wide">
        <h3>Residuals</h3>
        <p class="hint">No residuals are stored.</p>
      </article>
    );
  return (
    <article class="wide">
      <h3>
        Measured and modelled <small>drag to zoom, double-click to reset</small>{" "}
        <select
          aria-label="Moves shown"
          value={index}
          onChange={(event) => setIndex(Number(event.currentTarget.value))}
        >
          {options.map(([text], k) => (
            <option key={k} value={k}>
              {text}
            </option>
          ))}
        </select>
      </h3>
      <p>
        {KEYS.map(([text, colour]) => (
          <span class="key" key={text}>
            <i style={{ background: `var(${colour})` }} /> {text}
          </span>
        ))}
      </p>
      <div class="columns">
        {robot.joints.map((name, j) => (
          <Curve
            key={name}
            name={jointName(name)}
            unit="N·m"
            moves={chosen}
            of={({ torque }) =>
              torque && { measured: torque.measured[j]!, modelled: torque.modelled[j]! }
            }
          />
        ))}
        <Curve name="power" unit="W" moves={chosen} of={({ power }) => power} />
      </div>
    </article>
  );
}

function Curve({
  name,
  unit,
  moves,
  of,
}: {
  name: string;
  unit: string;
  moves: MoveCurves[];
  of: (move: MoveCurves) => Pair | null;
}) {
  const scheme = dark.value;
  const drawn = useMemo(() => {
    const known = moves
      .map((move) => ({ move, pair: of(move) }))
      .filter(({ pair }) => pair !== null);
    if (!known.length) return null;
    const rows = known.flatMap(({ move, pair }) => {
      const { measured, modelled } = pair!;
      const samples = move.t.map((t, k): Samples => {
        const [a, b] = [measured[k]!, modelled[k] ?? null];
        return [t, a, b, b === null || a === null ? null : a - b, move.held_out ? 1 : null];
      });
      return [...samples, [move.t.at(-1)! + APART, null, null, null, null] as Samples];
    });
    const column = (k: number) => rows.map((row) => row[k] ?? null);
    const all = [1, 2, 3].flatMap(column).filter((value) => value !== null);
    const [low, high] = [Math.min(0, ...all) * 1.08, Math.max(0, ...all) * 1.08];
    const residual = column(3);
    const left = residual.filter((value) => value !== null);
    const rms = Math.sqrt(left.reduce((sum, value) => sum + value * value, 0) / left.length);
    const data = [
      column(0),
      column(4).map((held) => held && high),
      column(1),
      column(2),
      residual,
    ] as uPlot.AlignedData;
    return { data, low, high, rms };
  }, [moves]);
  const series = useMemo(() => {
    const line = (colour: string, width: number) => ({
      stroke: style(colour),
      width,
      points: { show: false },
    });
    const band = {
      fill: style("--held"),
      fillTo: drawn?.low ?? 0,
      width: 0,
      points: { show: false },
    };
    return [band, line("--ink-2", 1), line("--good", 2), line("--bad", 1)];
  }, [drawn, scheme]);
  if (!drawn) return null;
  const rms = `residual ${figure(drawn.rms)} ${unit} rms`;
  return (
    <div class="residual">
      <h4>
        {name}{" "}
        <small>
          {unit}; {rms}
        </small>
      </h4>
      <Chart
        id={`residual-${name.replaceAll(" ", "-")}`}
        label={`${name}, measured and modelled: ${rms}`}
        series={series}
        data={drawn.data}
        options={{
          x: (_, from, to) => [from, to],
          y: [drawn.low, drawn.high],
          cursor: { drag: { x: true, y: false }, sync: { key: "residuals" } },
        }}
      />
    </div>
  );
}
