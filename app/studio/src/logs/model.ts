// Logs of arms, and what is found from them.
import { signal } from "@preact/signals";
import { follow, get, listed, patch, post, send, Problem } from "../store/client";
import type { Interval, Parameter, ProblemDetails } from "../store/types";
import { figure } from "../store/units";

export interface LogSummary {
  id: string;
  name: string | null;
  robot: string;
  created: string;
  rows: number;
  duration: number;
}

export interface LogDetail extends LogSummary {
  rate: number;
  payload: number;
  channels: { name: string; column: string | null; unit: string; min: number; max: number }[];
  effort: { meaning: string; confidence: number } | null;
  moves: { start: number; end: number; at_rest: boolean }[];
  warnings: string[];
}

export interface Evaluated {
  start: number;
  end: number;
  energy: {
    electrical: { total: number; idle: number; copper: number; interval: Interval | null };
    mechanical: { total: number };
  };
  measured: { electrical: number | null; by_efforts: number | null } | null;
  /** Measured / predicted - 1. */
  difference: number | null;
}

export interface Evaluation {
  robot: string;
  total: Evaluated;
  segments: Evaluated[];
  cycles: Evaluated[];
  warnings: string[];
}

export interface IdentificationSummary {
  id: string;
  name: string | null;
  robot: string | null;
  state: string;
  created: string;
}

export interface FigureFound {
  figure: string;
  joint: number | null;
  value: number;
  sd: number;
  previous: number;
  identified: boolean;
  why: string | null;
}

interface TorqueErrors {
  relative: number[];
  shaft_energy: number;
  copper_energy: number;
}

type PowerErrors = Record<"rmse" | "energy_mean" | "energy_p90" | "energy_max", number>;

export interface Validation {
  moves: number;
  fitted: { torque: TorqueErrors | null; power: PowerErrors | null };
  own: { torque: TorqueErrors; power: PowerErrors };
  constant: PowerErrors;
  coverage: number | null;
  half_width: number;
}

type Figures = Record<string, Parameter>;

export interface Found {
  robot: string;
  parameters: FigureFound[];
  validation: Validation | null;
  residuals: { white: boolean };
  physical: { consistent: boolean } | null;
  measure: { share: number; figure: string; joint: number | null; do: string }[];
  payload: { mass: number; mass_sd: number; why: string | null } | null;
  document: { drives?: Figures; electronics?: Figures; friction_laws?: { identified?: Figures } };
}

export interface Identification {
  id: string;
  name: string | null;
  state: string;
  created: string;
  figures: string | null;
  problem: ProblemDetails | null;
  result: Found | null;
}

interface Curve {
  measured: (number | null)[][];
  modelled: (number | null)[][];
}

export interface MoveCurves {
  log: string;
  t: number[];
  held_out: boolean;
  torque: Curve | null;
  power: { measured: (number | null)[]; modelled: (number | null)[] } | null;
}

/** An identification that runs: what is said of it, and the share of its fits that are done. */
interface Busy {
  text: string;
  share: number | null;
}

const LONGEST_NAME = 200;

export const logs = signal<LogSummary[] | null>(null);
export const identifications = signal<IdentificationSummary[]>([]);
/** Ids of the logs that an identification is to use. */
export const chosen = signal<string[]>([]);
export const openedLog = signal<LogDetail | null>(null);
export const openedIdentification = signal<{ found: Identification; moves: MoveCurves[] } | null>(
  null,
);
export const busy = signal<Busy | null>(null);
/** Text that the listed logs and identifications have in their name or robot. */
export const logSearch = signal("");

/** Throws Problem. */
export async function loadLogs(): Promise<void> {
  const query = { limit: "200", search: logSearch.peek() };
  const [own, found] = await Promise.all([
    listed<{ logs: LogSummary[] }>("logs", query),
    listed<{ identifications: IdentificationSummary[] }>("identifications", query),
  ]);
  if (query.search !== logSearch.peek()) return;
  logs.value = own.logs;
  identifications.value = found.identifications;
}

/** Sends a file; the settings say how it is read. Throws Problem. */
export async function addLog(file: File, settings: Record<string, string>): Promise<LogDetail> {
  const query = new URLSearchParams(settings);
  const response = await send(`logs?${query}`, {
    method: "POST",
    body: file,
    headers: { "Content-Type": "text/csv" },
  });
  const detail = (await response.json()) as LogDetail;
  await loadLogs();
  return detail;
}

export const openLog = async (id: string) => {
  openedIdentification.value = null;
  openedLog.value = await get<LogDetail>(`logs/${id}`);
};

/** Measured and predicted joules of each move of a log. Throws Problem. */
export const evaluated = (log: string, figures: string | null) =>
  post<Evaluation>("evaluate", { log, figures });

/** Starts an identification named after its logs, waits for its end and opens it. Throws Problem. */
export async function identify(ids: string[]): Promise<void> {
  const { id } = await post<Identification>("identifications", { logs: ids });
  const names = (logs.value ?? []).filter((log) => ids.includes(log.id)).map(({ name }) => name);
  const name = names.filter(Boolean).join(", ").slice(0, LONGEST_NAME) || null;
  await patch(`identifications/${id}`, { name });
  await openIdentification(id);
}

/** Opens an identification by its id, after its end. Throws Problem. */
export async function openIdentification(id: string): Promise<void> {
  const path = `identifications/${encodeURIComponent(id)}`;
  try {
    let found = await get<Identification>(path);
    if (["queued", "running"].includes(found.state)) {
      busy.value = { text: `Identification: ${found.state} …`, share: null };
      await loadLogs();
      await follow(id, (event, data) => {
        busy.value = busyAfter(busy.value, event, data as JobProgress);
      });
      found = await get<Identification>(path);
    }
    if (found.problem) throw new Problem(found.problem);
    if (!found.result)
      throw new Problem({
        title: "No result",
        detail: `The identification is ${found.state}.`,
      });
    const { moves } = await get<{ moves: MoveCurves[] | null }>(`${path}/residuals`);
    openedIdentification.value = { found, moves: moves ?? [] };
  } finally {
    busy.value = null;
    await loadLogs().catch(() => undefined);
  }
}

interface JobProgress {
  state?: string;
  eta?: number | null;
  requests?: { share: number | null }[];
}

/** What is said of an identification after an event of its job. */
export function busyAfter(now: Busy | null, event: string, data: JobProgress): Busy | null {
  if (event === "state" && now?.share == null)
    return { text: `Identification: ${data.state} …`, share: null };
  const share = event === "progress" ? (data.requests?.[0]?.share ?? null) : null;
  if (share === null) return now;
  const left = data.eta == null ? "" : `, about ${figure(data.eta, 2)} s left`;
  return { text: `Identification: ${Math.round(100 * share)} % of the fits${left}`, share };
}
