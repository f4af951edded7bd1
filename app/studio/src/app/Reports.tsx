import { useEffect, useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { plain } from "../store/facts";
import { fileOf, reports, type Report } from "../store/report";

const TICK = 1000; // [ms]

/** What became of the reports that were asked for; each stays until it is dismissed. */
export function Reports() {
  const [, again] = useState(0);
  const writing = reports.value.some(({ state }) => state === "writing");
  useEffect(() => {
    if (!writing) return undefined;
    const timer = setInterval(() => again((count) => count + 1), TICK);
    return () => clearInterval(timer);
  }, [writing]);
  return (
    <section class="reports" aria-label="Reports" hidden={!reports.value.length}>
      {reports.value.map((each) => (
        <Card key={each.began} report={each} />
      ))}
    </section>
  );
}

function Card({ report }: { report: Report }) {
  const { title, format, state, address, why, again, dismiss } = report;
  const passed = Math.round((performance.now() - report.began) / 1000);
  const name = fileOf(report);
  return (
    <article class="report-card" data-state={state}>
      <p role={state === "failed" ? "alert" : "status"}>
        {state === "writing" && `The report on ${title} is being written.`}
        {state === "saved" && `${name} is saved, with the request and the answer attached.`}
        {state === "failed" && `The report on ${title} was not written: ${plain(why)}`}
      </p>
      {state === "writing" && (
        <p class="row hint">
          <progress aria-label={`Report on ${title}`} /> {passed} s
        </p>
      )}
      <div class="row">
        {/* the policy of this page would hold for a page opened from it, and take its styles */}
        {state === "saved" && format === "pdf" && (
          <a class="button small" href={address} target="_blank">
            Open
          </a>
        )}
        {state === "saved" && (
          <a class="button small" href={address} download={name}>
            Save again
          </a>
        )}
        {state === "failed" && (
          <Button small onClick={again}>
            Try again
          </Button>
        )}
        <Button small kind="quiet" onClick={dismiss}>
          {state === "writing" ? "Cancel" : "Dismiss"}
        </Button>
      </div>
    </article>
  );
}
