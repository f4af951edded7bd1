// Logs of arms, and what is found from them.
import { signal } from "@preact/signals";
import { get, post, send, Problem } from "../store/client";
import type { Interval, Parameter, ProblemDetails } from "../store/types";

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
}

export interface Evaluation {
  robot: string;
  total: Evaluated;
  segments: Evaluated[];
  warnings: string[];
}

export interface IdentificationSummary {
  id: string;
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
  validation: Validation;
  residuals: { white: boolean };
  physical: { consistent: boolean } | null;
  advice: { share: number; figure: string; do: string } | null;
  payload: { mass: number; mass_sd: number; why: string | null } | null;
  document: { drives?: Figures; electronics?: Figures; friction_laws?: { identified?: Figures } };
}

export interface Identification {
  id: string;
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

const PAUSE = 500; // between two looks at work that runs [ms]

export const logs = signal<LogSummary[] | null>(null);
export const identifications = signal<IdentificationSummary[]>([]);
/** Ids of the logs that an identification is to use. */
export const chosen = signal<string[]>([]);
export const openedLog = signal<LogDetail | null>(null);
export const openedIdentification = signal<{ found: Identification; moves: MoveCurves[] } | null>(
  null,
);
export const busy = signal("");

/** Throws Problem. */
export async function loadLogs(): Promise<void> {
  const [own, found] = await Promise.all([
    get<{ logs: LogSummary[] }>("logs?limit=200"),
    get<{ identifications: IdentificationSummary[] }>("identifications?limit=50"),
  ]);
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

/** Starts an identification, waits for its end and opens it. Throws Problem. */
export async function identify(body: Record<string, unknown>): Promise<void> {
  const { id } = await post<Identification>("identifications", body);
  await openIdentification(id);
}

/** Opens an identification by its id, after its end. Throws Problem. */
export async function openIdentification(id: string): Promise<void> {
  const path = `identifications/${encodeURIComponent(id)}`;
  const began = performance.now();
  try {
    let found = await get<Identification>(path);
    while (["queued", "running"].includes(found.state)) {
      const passed = Math.round((performance.now() - began) / 1000);
      busy.value = `Identification: ${found.state} for ${passed} s …`;
      await new Promise((resolve) => setTimeout(resolve, PAUSE));
      found = await get<Identification>(path);
    }
    if (found.problem) throw new Problem(found.problem);
    if (!found.result)
      throw new Problem({
        title: "Nothing was found",
        detail: `The identification is ${found.state}.`,
      });
    const { moves } = await get<{ moves: MoveCurves[] | null }>(`${path}/residuals`);
    openedIdentification.value = { found, moves: moves ?? [] };
  } finally {
    busy.value = "";
    await loadLogs().catch(() => undefined);
  }
}
