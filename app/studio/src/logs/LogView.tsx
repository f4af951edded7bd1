import { useEffect, useState } from "preact/hooks";
import { Note } from "../ui/Note";
import { ReportMenu } from "../ui/ReportMenu";
import { Table } from "../ui/Table";
import { plain } from "../store/facts";
import { report } from "../store/report";
import { robotName } from "../store/request";
import { robotOf } from "../store/service";
import { request } from "../store/state";
import { tell } from "../store/trouble";
import { ends, figure } from "../store/units";
import { evaluated, type Evaluated, type Evaluation, type LogDetail } from "./model";

/** A log: what is odd in it, and the joules of each move, measured and predicted. */
export function LogView({ log }: { log: LogDetail }) {
  const own = request.value.figures ?? null;
  const usable = own !== null && robotName(request.value) === log.robot;
  const [withOwn, setWithOwn] = useState(false);
  const [found, setFound] = useState<Evaluation | null>(null);
  const [titles, setTitles] = useState([log.robot, robotName(request.value)]);
  useEffect(() => {
    const names = [log.robot, robotName(request.value)];
    const known = Promise.all(names.map(robotOf));
    known.then(
      (robots) => setTitles(robots.map(({ title }) => title)),
      () => setTitles(names),
    );
  }, [log.robot, robotName(request.value)]);
  useEffect(() => {
    setFound(null);
    evaluated(log.id, withOwn ? own : null).then(setFound, (error) => tell(error));
  }, [log.id, withOwn]);
  const moving = log.moves.filter(({ at_rest }) => !at_rest).length;
  return (
    <>
      <header class="page-head">
        <div>
          <h2>{log.name ?? log.id.slice(0, 8)}</h2>
          <p class="hint">
            {titles[0]} · {figure(log.duration)} s · {moving} moves · {figure(log.rate)} Hz ·
            payload {figure(log.payload)} kg
            {log.effort && ` · efforts: ${log.effort.meaning}`}
          </p>
        </div>
        <span class="space" />
        {found && (
          <ReportMenu
            write={(format) =>
              report(
                { evaluate: { log: log.id, figures: withOwn ? own : null } },
                log.name ?? "Log",
                format,
              )
            }
          />
        )}
      </header>
      {log.warnings.map((text) => (
        <Note kind="warning" key={text}>
          {plain(text)}
        </Note>
      ))}
      {robotName(request.value) !== log.robot && (
        <Note kind="warning">
          This log is from a {titles[0]}, but the cell has a {titles[1]}.
        </Note>
      )}
      <h3>Measured and predicted energy</h3>
      {usable && (
        <label>
          <input
            type="checkbox"
            checked={withOwn}
            onChange={(event) => setWithOwn(event.currentTarget.checked)}
          />{" "}
          with the cell’s own figures
        </label>
      )}
      {found ? <Measured found={found} /> : <p class="hint">Computing …</p>}
    </>
  );
}

const signed = (share: number) => `${share >= 0 ? "+" : "−"}${figure(Math.abs(100 * share), 2)} %`;

function Measured({ found: { segments, cycles, total } }: { found: Evaluation }) {
  const electrical = total.measured?.electrical != null;
  const efforts = total.measured?.by_efforts != null;
  const cells = (name: string, part: Evaluated) => {
    const predicted = part.energy.electrical.total;
    const { electrical: drawn, by_efforts: worked } = part.measured ?? {
      electrical: null,
      by_efforts: null,
    };
    const { interval } = part.energy.electrical;
    return [
      name,
      part.end - part.start,
      ...(electrical ? [drawn] : []),
      ...(efforts ? [worked] : []),
      predicted,
      interval ? ends(interval) : "",
      part.difference === null ? "–" : signed(part.difference),
    ];
  };
  const head = [
    "",
    "s",
    ...(electrical ? ["measured, J"] : []),
    ...(efforts ? ["from currents, J"] : []),
    "predicted, J",
    "90 % interval",
    "difference",
  ];
  const spanned = (name: string, part: Evaluated, key: string) => ({
    key,
    cells: cells(`${name}${figure(part.start)} to ${figure(part.end)} s`, part),
  });
  const rows = [
    ...cycles.map((part, k) => spanned(`cycle ${k + 1}, `, part, `cycle ${k}`)),
    ...segments.map((part, k) => spanned("", part, `move ${k}`)),
  ];
  return (
    <>
      {!electrical && !efforts && (
        <p class="hint">
          The log contains no power, currents or torques, so there is no measured energy.
        </p>
      )}
      <div id="measured">
        <Table
          label="Measured and predicted"
          head={head}
          rows={[{ key: "all", class: "total", cells: cells("whole log", total) }, ...rows]}
        />
      </div>
      <p class="hint">
        {electrical && "Measured: integral of the power at the arm’s bus. "}
        {efforts &&
          "From currents: shaft work, copper loss and idle power, with the robot’s figures. "}
        Difference: measured relative to predicted.
      </p>
    </>
  );
}
