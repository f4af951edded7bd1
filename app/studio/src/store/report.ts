// Reports: pages for those who decide.
import { signal } from "@preact/signals";
import { brokenOff, send } from "./client";
import { costsOf, DEFAULT_ECONOMICS, type Economics } from "./economics";
import { periodOf } from "./facts";
import { mapShown } from "./placement";
import { endpointOf } from "./request";
import { fileName, save } from "./share";
import { answered, economics, project } from "./state";
import { said } from "./trouble";

export type ReportFormat = "html" | "pdf";

/** The numbers for costs as `POST /report` takes them. */
export function costsFor(given: Economics, cyclesPerShift: number | null) {
  const yours = (value: number) => ({ value, source: "yours" });
  const { cycleTime, shift, shiftsPerYear } = given;
  const asked =
    cyclesPerShift !== null && (cycleTime !== null || shift !== DEFAULT_ECONOMICS.shift);
  return {
    ...(asked ? { cycles_per_shift: yours(cyclesPerShift) } : {}),
    shifts_per_year:
      shiftsPerYear === DEFAULT_ECONOMICS.shiftsPerYear
        ? { value: shiftsPerYear, source: "assumed: two shifts on 230 days", letter: "E" }
        : yours(shiftsPerYear),
    price: given.price,
    carbon: given.carbon,
    ...(given.box ? { control_box: given.box } : {}),
  };
}

/** A report of the answer that is shown, as a file. */
export async function reportAnswer(format: ReportFormat): Promise<void> {
  const shown = answered.value;
  if (!shown?.asked) return;
  const given = economics.value;
  const { name } = project.value;
  const body = {
    [endpointOf(shown.asked)]: shown.asked,
    answer: shown.solution.id,
    period: given.cycleTime,
    costs: costsFor(given, costsOf([], periodOf(shown, given.cycleTime), given).cyclesPerShift),
  };
  await report(body, name, format);
}

/** A report of the map that is shown, as a file. */
export async function reportPlaces(format: ReportFormat): Promise<void> {
  const map = mapShown.value;
  if (!map) return;
  const costs = costsFor(economics.value, null);
  const { body, answer } = map;
  await report({ placement: body, answer: answer.id, costs }, project.value.name, format);
}

/** Reports that are being written, and what became of them, until they are dismissed. */
export const reports = signal<Report[]>([]);

export interface Report {
  title: string;
  format: ReportFormat;
  began: number;
  state: "writing" | "saved" | "failed";
  /** Why it failed. */
  why: string;
  /** Address of the file in this browser, once it is written. */
  address: string;
  again: () => Promise<void>;
  /** Stops it, and takes it from the list. */
  dismiss: () => void;
}

export const fileOf = ({ title, format }: Report) => fileName(title, "report", format);

/** Writes a report, and saves it as a file; `reports` tells how far it is. */
export async function report(
  body: Record<string, unknown>,
  title: string,
  format: ReportFormat,
): Promise<void> {
  const own = new AbortController();
  let now: Report = {
    title,
    format,
    began: performance.now(),
    state: "writing",
    why: "",
    address: "",
    again: () => {
      now.dismiss();
      return report(body, title, format);
    },
    dismiss: () => {
      own.abort();
      URL.revokeObjectURL(now.address);
      reports.value = reports.value.filter((each) => each !== now);
    },
  };
  const next = (more: Partial<Report>) => {
    const before = now;
    now = { ...now, ...more };
    reports.value = reports.value.map((each) => (each === before ? now : each));
  };
  reports.value = [...reports.value, now];
  try {
    const response = await send("report", {
      method: "POST",
      body: JSON.stringify({ ...body, title: title.slice(0, 120), format }),
      headers: { "Content-Type": "application/json" },
      signal: own.signal,
    });
    const file = await response.blob().catch((error: unknown) => {
      throw brokenOff(error);
    });
    next({ state: "saved", address: URL.createObjectURL(file) });
    save(fileOf(now), file);
  } catch (error) {
    if (!own.signal.aborted) next({ state: "failed", why: said(error) });
  }
}
