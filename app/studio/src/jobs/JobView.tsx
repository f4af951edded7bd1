import { useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { ReportMenu } from "../ui/ReportMenu";
import { openCell, openKept } from "../store/open";
import { baselineName } from "../store/facts";
import { post } from "../store/client";
import { costsFor, report, type ReportFormat } from "../store/report";
import { fileName, save } from "../store/share";
import { economics } from "../store/state";
import { trying } from "../store/trouble";
import { asShown, ends, figure, percent } from "../store/units";
import {
  csvOfJob,
  isOver,
  lacksDetails,
  loadDetails,
  loadJob,
  massOf,
  nameOf,
  type JobRow,
  type Opened,
} from "./model";

type Filter = "all" | JobRow["state"];

const MOST_ROWS = 500;

/** One job: how far it is, what it sums up to, and its table. */
export function JobView({ shown }: { shown: Opened }) {
  const [filter, setFilter] = useState<Filter>("all");
  const { job, rows, notes } = shown;
  const total = rows.length;
  const { counts } = job;
  const filters: [Filter, string, number][] = [
    ["all", "All", total],
    ["done", "Done", counts.done],
    ["failed", "Failed", counts.failed],
    ["waiting", "Waiting", counts.waiting],
  ];
  const listed = rows.filter(({ state }) => filter === "all" || state === filter);
  const act = (path: string) =>
    trying(async () => {
      await post(`jobs/${job.id}/${path}`, {});
      await loadJob(job.id);
    });
  return (
    <>
      <header class="page-head">
        <div>
          <h2>{job.name ?? job.id.slice(0, 8)}</h2>
          <p class="hint">
            {notes ? `${notes.source} · ` : ""}
            {job.state}
          </p>
        </div>
        <span class="space" />
        <Button
          icon="file"
          id="job-csv"
          onClick={trying(async () => {
            save(fileName(job.name ?? "", "job", "csv"), await csvOfJob(shown), "text/csv");
          })}
        >
          CSV
        </Button>
        {counts.done > 0 && <ReportMenu write={(format) => reportJob(shown, format)} />}
        {counts.failed > 0 && isOver(job) && (
          <Button icon="refresh" onClick={act("retry")}>
            Retry {counts.failed} failed
          </Button>
        )}
        {!isOver(job) && (
          <Button icon="close" onClick={act("cancel")}>
            Cancel
          </Button>
        )}
      </header>
      <div class="row">
        <b id="job-progress">
          {counts.done + counts.failed + counts.cancelled} of {total} moves
        </b>
        <span class="space" />
        {!isOver(job) && <b>{job.eta === null ? "" : `about ${figure(job.eta, 2)} s left`}</b>}
      </div>
      <progress max={1} value={job.progress} aria-label="Progress of the job" />
      {!isOver(job) && <p class="hint">You may close this page: the service continues.</p>}
      <Totals shown={shown} />
      <div class="row" role="group" aria-label="Rows shown">
        {filters.map(([value, text, count]) => (
          <button
            type="button"
            class="chip-button"
            key={value}
            aria-pressed={filter === value}
            onClick={() => setFilter(value)}
          >
            {text} {count}
          </button>
        ))}
        <span class="space" />
        {lacksDetails(shown) && (
          <Button small onClick={trying(() => loadDetails(job.id))}>
            Load intervals and savings
          </Button>
        )}
      </div>
      <div class="scroll" role="region" aria-label="Moves" tabIndex={0}>
        <table class="moves" id="moves">
          <thead>
            <tr>
              {["no.", "move", "kg", "s", "J", "interval", "best baseline", "saving"].map(
                (name, k) => (
                  <th scope="col" key={name} class={k > 1 ? "number" : undefined}>
                    {name}
                  </th>
                ),
              )}
            </tr>
          </thead>
          <tbody>
            {listed.slice(0, MOST_ROWS).map((row) => (
              <MoveRow key={row.index} row={row} shown={shown} />
            ))}
          </tbody>
        </table>
      </div>
      {listed.length > MOST_ROWS && (
        <p class="hint">
          {MOST_ROWS} of {listed.length} are listed; the CSV has all.
        </p>
      )}
    </>
  );
}

const reportJob = (shown: Opened, format: ReportFormat) =>
  report(
    {
      job: shown.job.id,
      costs: costsFor(economics.value, null),
    },
    shown.job.name ?? "Job",
    format,
  );

function Totals({ shown: { rows, details } }: { shown: Opened }) {
  const done = rows.filter(({ energy }) => energy !== null);
  const sum = (key: "energy" | "duration") => done.reduce((all, row) => all + (row[key] ?? 0), 0);
  const compared = [...(details?.values() ?? [])].filter(({ rivalEnergy }) => rivalEnergy !== null);
  const ours = done
    .filter((row) => details?.get(row.index)?.rivalEnergy != null)
    .reduce((all, row) => all + row.energy!, 0);
  const theirs = compared.reduce((all, each) => all + each.rivalEnergy!, 0);
  const joules = sum("energy");
  return (
    <dl class="facts wide" id="job-totals">
      <div>
        <dt>in {done.length} moves</dt>
        <dd class="good">
          {joules >= 1e4 ? `${figure(joules / 1000)} kJ` : `${figure(joules)} J`}
        </dd>
      </div>
      <div>
        <dt>of motion</dt>
        <dd>{figure(sum("duration"))} s</dd>
      </div>
      {compared.length > 0 && (
        <div>
          <dt>less than the best baselines, in {compared.length} moves</dt>
          <dd>{percent(1 - ours / theirs)}</dd>
        </div>
      )}
    </dl>
  );
}

function MoveRow({ row, shown }: { row: JobRow; shown: Opened }) {
  const name = nameOf(row);
  const mass = massOf(shown, row);
  const asked = shown.notes?.requests[row.index];
  const detail = shown.details?.get(row.index);
  const open = () =>
    row.answer
      ? openKept(row.answer)
      : asked
        ? openCell({ request: asked }, name)
        : Promise.resolve();
  const head = (
    <>
      <td>{row.index + 1}</td>
      <th scope="row">
        {row.answer || asked ? (
          <button type="button" class="plain" title="Open in the cell" onClick={trying(open)}>
            {name}
          </button>
        ) : (
          name
        )}
      </th>
      <td class="number">{mass ? figure(mass) : "–"}</td>
    </>
  );
  if (row.problem)
    return (
      <tr class="failed">
        {head}
        <td colSpan={5}>
          {asShown(row.problem.detail ?? row.problem.title ?? "")}{" "}
          {asked && (
            <Button kind="link" onClick={trying(open)}>
              Open in the cell
            </Button>
          )}
        </td>
      </tr>
    );
  return (
    <tr class={row.state}>
      {head}
      <td class="number">{row.energy === null ? row.state : figure(row.duration)}</td>
      <td class="number">
        <b>{row.energy === null ? "" : figure(row.energy)}</b>
      </td>
      <td class="number">{detail?.interval ? ends(detail.interval) : ""}</td>
      <td class="number" title={detail?.rival ? baselineName(detail.rival) : undefined}>
        {detail ? figure(detail.rivalEnergy) : ""}
      </td>
      <td class="number">
        {detail ? (detail.saving === null ? "–" : percent(detail.saving)) : ""}
      </td>
    </tr>
  );
}
