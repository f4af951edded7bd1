import { useEffect, useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { remove } from "../store/client";
import { trouble } from "../store/state";
import { tell, trying } from "../store/trouble";
import { figure, when } from "../store/units";
import { JobView } from "./JobView";
import { isOver, jobs, loadJob, loadJobs, opened, type Job } from "./model";
import { NewJob } from "./NewJob";

const PAUSE = 1000; // between two looks at what runs [ms]

/** Tables of moves that the service computes while nobody waits. */
export function JobsPage() {
  const [filter, setFilter] = useState("");
  const [making, setMaking] = useState(false);
  useEffect(() => {
    const look = async () => {
      await loadJobs();
      const now = opened.peek();
      if (now && !isOver(now.job)) await loadJob(now.job.id);
    };
    look().catch((error) => tell(error));
    const timer = setInterval(() => {
      const busy =
        jobs.peek()?.some((job) => !isOver(job)) || (opened.peek() && !isOver(opened.peek()!.job));
      if (busy) look().catch(() => undefined);
    }, PAUSE);
    return () => clearInterval(timer);
  }, []);
  const shown = (jobs.value ?? []).filter(({ name, id }) =>
    `${name ?? ""} ${id}`.toLowerCase().includes(filter.toLowerCase()),
  );
  const drop = async (job: Job) => {
    await remove(`jobs/${job.id}`);
    if (opened.value?.job.id === job.id) opened.value = null;
    await loadJobs();
  };
  return (
    <main class="page with-list" id="jobs">
      <aside class="side" aria-label="Jobs">
        <Button kind="primary" icon="plus" id="new-job" onClick={() => setMaking(true)}>
          New job
        </Button>
        <input
          type="search"
          class="search"
          aria-label="Search jobs"
          placeholder="Search jobs"
          value={filter}
          onInput={(event) => setFilter(event.currentTarget.value)}
        />
        {jobs.value && !shown.length && <p class="hint">No job yet: paste a table of moves.</p>}
        <ul class="kept">
          {shown.map((job) => (
            <li key={job.id}>
              <button
                type="button"
                class="choice"
                aria-current={opened.value?.job.id === job.id ? "true" : undefined}
                onClick={trying(() => loadJob(job.id))}
              >
                <b>{job.name ?? job.id.slice(0, 8)}</b>
                <small>{stateText(job)}</small>
                {!isOver(job) && (
                  <progress
                    max={1}
                    value={job.progress}
                    aria-label={`Progress of ${job.name ?? job.id}`}
                  />
                )}
              </button>
              {isOver(job) && (
                <Button
                  kind="quiet"
                  icon="trash"
                  label={`Delete ${job.name ?? job.id}`}
                  onClick={trying(() => drop(job))}
                />
              )}
            </li>
          ))}
        </ul>
      </aside>
      <section class="content" aria-label="Job">
        {trouble.value && (
          <p class="error" role="alert">
            {trouble.value.title}: {trouble.value.text}
          </p>
        )}
        {opened.value ? (
          <JobView shown={opened.value} />
        ) : (
          <p class="empty">
            Choose a job, or make a new one from a table of moves: it is computed in the cell as it
            is now.
          </p>
        )}
      </section>
      {making && <NewJob onClose={() => setMaking(false)} />}
    </main>
  );
}

function stateText(job: Job): string {
  const total = Object.values(job.counts).reduce((sum, count) => sum + count, 0);
  if (isOver(job)) return `${when(job.created)}, ${job.state}`;
  const left = job.eta === null ? "" : `, about ${figure(job.eta, 2)} s left`;
  return `${total - job.counts.waiting - job.counts.running} of ${total}${left}`;
}
