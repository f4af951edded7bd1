import { useEffect, useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { KeptRow } from "../ui/KeptRow";
import { SearchField } from "../ui/SearchField";
import { patch, remove } from "../store/client";
import { trouble } from "../store/state";
import { tell } from "../store/trouble";
import { figure, when } from "../store/units";
import { JobView } from "./JobView";
import { isOver, jobs, jobSearch, loadJob, loadJobs, opened, type Job } from "./model";
import { NewJob } from "./NewJob";

const PAUSE = 1000; // between two looks at what runs [ms]

/** Tables of moves that the service computes while nobody waits. */
export function JobsPage() {
  const [making, setMaking] = useState(false);
  useEffect(() => {
    const look = async () => {
      await loadJobs();
      const now = opened.peek();
      if (now && !isOver(now.job)) await loadJob(now.job.id);
    };
    look().catch((error) => tell(error));
    const timer = setInterval(() => {
      const known = jobs.peek();
      const now = opened.peek();
      // a list that never came is asked for until the service answers
      if (!known)
        look().then(
          () => (trouble.value = null),
          () => undefined,
        );
      else if (known.some((job) => !isOver(job)) || (now && !isOver(now.job)))
        look().catch(() => undefined);
    }, PAUSE);
    return () => clearInterval(timer);
  }, []);
  const shown = jobs.value ?? [];
  const rename = async (job: Job, name: string | null) => {
    await patch(`jobs/${job.id}`, { name });
    await loadJobs();
    if (opened.value?.job.id === job.id) await loadJob(job.id);
  };
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
        <SearchField
          label="Search jobs"
          onSearch={(text) => {
            jobSearch.value = text;
            loadJobs().catch((error) => tell(error));
          }}
        />
        {jobs.value && !shown.length && (
          <p class="hint">
            {jobSearch.value ? "No job has this name." : "No job yet: paste a table of moves."}
          </p>
        )}
        <ul class="kept">
          {shown.map((job) => (
            <KeptRow
              key={job.id}
              name={job.name}
              unnamed={job.id.slice(0, 8)}
              facts={stateText(job)}
              current={opened.value?.job.id === job.id}
              onOpen={() => loadJob(job.id)}
              onRename={(name) => rename(job, name)}
              onDelete={isOver(job) ? () => drop(job) : undefined}
              progress={
                !isOver(job) && (
                  <progress
                    max={1}
                    value={job.progress}
                    aria-label={`Progress of ${job.name ?? job.id}`}
                  />
                )
              }
            />
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
            Choose a job, or create one from a table of moves, which are computed in the current
            cell.
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
