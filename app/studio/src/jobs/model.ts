// Jobs of the service, and what the page adds to them: masses, intervals and savings.
import { signal } from "@preact/signals";
import { get, listed, send } from "../store/client";
import { jobNotes, type JobNotes } from "../store/persist";
import { said } from "../store/trouble";
import type { Interval, ProblemDetails, Solution } from "../store/types";

export interface Job {
  id: string;
  name: string | null;
  state: "waiting" | "running" | "done" | "cancelling" | "cancelled";
  created: string;
  counts: Record<"waiting" | "running" | "done" | "failed" | "cancelled", number>;
  progress: number;
  eta: number | null;
}

export interface JobRow {
  index: number;
  name: string | null;
  kind: string;
  state: keyof Job["counts"];
  energy: number | null;
  duration: number | null;
  answer: string | null;
  problem: ProblemDetails | null;
}

/** What a whole answer says beyond its row. */
export interface Detail {
  mass: number | null;
  interval: Interval | null;
  rival: string | null;
  rivalEnergy: number | null;
  saving: number | null;
}

export interface Opened {
  job: Job;
  rows: JobRow[];
  notes: JobNotes | null;
  details: Map<number, Detail> | null;
}

const PAGE = 1000;

/** Why a table was refused, by its rows. */
export const refusal = (error: unknown): string =>
  said(error).replace(/requests\.(\d+)\.optimize\./g, (_, k) => `Row ${Number(k) + 1}, `);

export const jobs = signal<Job[] | null>(null);
export const opened = signal<Opened | null>(null);

/** Text that the names of the listed jobs have. */
export const jobSearch = signal("");

/** Lists the jobs; identifications are with the logs. Throws Problem. */
export const loadJobs = async () => {
  const search = jobSearch.peek();
  const query = { limit: "200", identifications: "false", search };
  const found = await listed<{ jobs: Job[] }>("jobs", query);
  if (search === jobSearch.peek()) jobs.value = found.jobs;
};

export const isOver = ({ state }: Job) => state === "done" || state === "cancelled";

/** A job with all of its rows. Throws Problem. */
export async function loadJob(id: string): Promise<void> {
  const rows: JobRow[] = [];
  let job: (Job & { requests: JobRow[]; next: number | null }) | null = null;
  let after = -1;
  do {
    job = await get<Job & { requests: JobRow[]; next: number | null }>(
      `jobs/${id}?limit=${PAGE}&after=${after}`,
    );
    rows.push(...job.requests);
    after = job.next ?? -1;
  } while (after >= 0);
  const before = opened.value?.job.id === id ? opened.value : null;
  opened.value = {
    job,
    rows,
    notes: before?.notes ?? (await jobNotes(id)) ?? null,
    details: before?.details ?? null,
  };
}

/**
 * Reads the whole answers of a job, one after the other, for intervals and savings. Throws Problem.
 */
export async function loadDetails(id: string): Promise<Map<number, Detail>> {
  const response = await send(`jobs/${id}/results`, {});
  const reader = response.body!.pipeThrough(new TextDecoderStream()).getReader();
  const details = new Map<number, Detail>();
  let text = "";
  for (let part = await reader.read(); !part.done; part = await reader.read()) {
    text += part.value;
    const lines = text.split("\n");
    text = lines.pop() ?? "";
    for (const line of lines)
      if (line)
        keep(details, JSON.parse(line) as { index: number; result: Partial<Solution> | null });
  }
  if (text.trim())
    keep(details, JSON.parse(text) as { index: number; result: Partial<Solution> | null });
  if (opened.value?.job.id === id) opened.value = { ...opened.value, details };
  return details;
}

/** Whether moves are done whose whole answers have not been read. */
export const lacksDetails = ({ rows, details }: Opened) =>
  rows.some(({ index, energy }) => energy !== null && !details?.has(index));

const AS_FAST = 1.05; // ratio of a baseline's duration to the answer's up to which it is as fast

function keep(
  details: Map<number, Detail>,
  { index, result }: { index: number; result: Partial<Solution> | null },
): void {
  if (!result) return;
  const electrical = result.energy?.electrical;
  const kept = (result.baselines ?? []).filter(
    (each) => each.within_limits && each.saving !== null,
  );
  // the best of the baselines within all limits, as in the report
  const fast = kept.filter(({ duration }) => duration <= AS_FAST * result.duration!);
  const [rival] = (fast.length ? fast : kept).sort((a, b) => a.saving! - b.saving!);
  details.set(index, {
    mass: result.arm?.payload?.mass ?? null,
    interval: electrical?.interval ?? null,
    rival: rival?.name ?? null,
    // in the same time: the shorter of both waits
    rivalEnergy: rival && electrical ? electrical.total / (1 - rival.saving!) : null,
    saving: rival?.saving ?? null,
  });
}

export const nameOf = ({ name, index }: JobRow) => name ?? `move ${index + 1}`;

/** What a move carries [kg]; null: nothing, or not known. */
export const massOf = ({ notes, details }: Opened, { index }: JobRow) =>
  notes?.masses[index] ?? details?.get(index)?.mass ?? null;

/** The table of a job as CSV, with the intervals and savings of all its moves. Throws Problem. */
export async function csvOfJob(shown: Opened): Promise<string> {
  const details = lacksDetails(shown) ? await loadDetails(shown.job.id) : shown.details;
  const whole = { ...shown, details };
  const quoted = (value: unknown) => {
    const text = value === null || value === undefined ? "" : String(value);
    return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  };
  const head = [
    "no",
    "move",
    "kg",
    "state",
    "duration_s",
    "energy_J",
    "p5_J",
    "p95_J",
    "rival",
    "rival_J",
    "saving",
    "problem",
    "answer",
  ];
  const lines = shown.rows.map((row) => {
    const detail = details?.get(row.index);
    return [
      row.index + 1,
      nameOf(row),
      massOf(whole, row),
      row.state,
      row.duration,
      row.energy,
      detail?.interval?.p5,
      detail?.interval?.p95,
      detail?.rival,
      detail?.rivalEnergy,
      detail?.saving,
      row.problem?.detail,
      row.answer,
    ]
      .map(quoted)
      .join(",");
  });
  return [head.join(","), ...lines, ""].join("\n");
}
