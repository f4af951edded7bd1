import { useEffect, useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { plain } from "../store/facts";
import { get } from "../store/client";
import { robotNow } from "../picture/pictured";
import { withRobot } from "../store/edits";
import { robotName } from "../store/request";
import { robotOf } from "../store/service";
import { edit, page, request, toast } from "../store/state";
import type { Robot } from "../store/types";
import { figure, jointName, percent, words } from "../store/units";
import { Curves } from "./Curves";
import { ErrorTable, FigureTable } from "./FigureTables";
import { openedIdentification, type Found, type LogDetail } from "./model";

/**
 * An identification: measured and modelled, errors on moves that no fit has seen, figures with
 * their letters.
 */
export function Identification() {
  const { found, moves } = openedIdentification.value!;
  const result = found.result!;
  const [robot, setRobot] = useState<Robot | null>(null);
  const [logs, setLogs] = useState<Pick<LogDetail, "id" | "name" | "warnings">[]>([]);
  useEffect(() => {
    void robotOf(result.robot).then(setRobot);
    const ids = [...new Set(moves.map(({ log }) => log))];
    const asked = ids.map((id) =>
      get<LogDetail>(`logs/${id}`).catch(() => ({
        id,
        name: null,
        warnings: ["This log was deleted."],
      })),
    );
    void Promise.all(asked).then(setLogs);
  }, [found.id]);
  if (!robot) return <p class="hint">…</p>;
  const told = result.parameters.filter(({ identified }) => identified).length;
  const use = () => {
    const same = robotName(request.value) === robot.name;
    const cell = same ? request.value : withRobot(request.value, robot, robotNow.value);
    edit({ ...cell, figures: found.figures });
    page.value = "cell";
    toast.value = `The cell now has ${same ? "" : `a ${robot.title} with `}these figures: optimise again to use them.`;
  };
  return (
    <div id="identification">
      <header class="page-head">
        <div>
          <h2>{found.name ?? `Identification of ${robot.name}`}</h2>
          <p class="hint">
            {found.name && `Identification of ${robot.name}, `}
            {new Date(found.created).toLocaleString()}, {told} of {result.parameters.length} figures
            identified
          </p>
        </div>
        <span class="space" />
        <Button kind="primary" disabled={!found.figures} onClick={use}>
          Use these figures
        </Button>
        <Button onClick={() => (openedIdentification.value = null)}>Back to the logs</Button>
      </header>
      <div class="columns">
        <Curves moves={moves} logs={logs} robot={robot} />
        {result.validation && <ErrorTable validation={result.validation} robot={robot} />}
        <Advice result={result} robot={robot} logs={logs} figures={found.figures} />
        <FigureTable result={result} robot={robot} />
      </div>
    </div>
  );
}

/** Warnings on the logs and the identified figures, and advice on what would help most. */
function Advice({
  result,
  robot,
  logs,
  figures,
}: {
  result: Found;
  robot: Robot;
  logs: Pick<LogDetail, "id" | "name" | "warnings">[];
  figures: string | null;
}) {
  const { residuals, physical, measure, payload } = result;
  const all = [
    !figures && "The figures are not stored: there was no space, or they were deleted.",
    payload &&
      (payload.why ??
        `The payload of the last log is ${figure(payload.mass)} ± ${figure(payload.mass_sd, 2)} kg.`),
    physical && !physical.consistent && "Not all identified links are physically consistent.",
    !residuals.white &&
      "Neighbouring residuals are correlated: the model lacks an effect. The standard deviations are computed over whole motions, and remain valid.",
    ...logs.flatMap(({ id, name, warnings }) =>
      warnings.map((text) => `${name ?? id.slice(0, 8)}: ${text}`),
    ),
    ...measure.map(({ share, figure: name, joint, do: text }) => {
      const place = joint === null ? "" : `, ${jointName(robot.joints[joint]!)}`;
      return `${percent(share)} of the energy's uncertainty is due to ${words(name)}${place}. ${text}`;
    }),
  ].filter((text) => typeof text === "string");
  return (
    <article>
      <h3>Warnings and advice</h3>
      {all.length ? (
        <ul>
          {all.map((text) => (
            <li key={text}>{plain(text)}</li>
          ))}
        </ul>
      ) : (
        <p class="hint">None.</p>
      )}
    </article>
  );
}
