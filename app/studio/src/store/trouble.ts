// Errors, as sentences at the fields that caused them.
import { Problem } from "./client";
import { unitAt } from "./diff";
import { located, type Pointer } from "./pointer";
import { kindOf, listOf, stopName } from "./request";
import { request, trouble } from "./state";
import type { ApiRequest, ProblemDetails } from "./types";
import { asShown, UNITS } from "./units";

// the field that a problem without one is about
const FIELDS: Record<string, Pointer> = {
  "start-in-collision": "/start",
  "goal-in-collision": "/goal",
  "unknown-robot": "/robot",
  "unknown-figures": "/figures",
  "unknown-tool": "/tool",
  "torque-infeasible": "/payload/mass",
  "payload-too-heavy": "/payload/mass",
  "duration-too-short": "/duration",
  "cycle-too-short": "/time",
};

const slugOf = (details: ProblemDetails) => details.type?.split("/").at(-1) ?? "";

/** The field that a problem is about; null if it names none. */
function pointerOf(details: ProblemDetails, asked: ApiRequest): Pointer | null {
  const { target } = details;
  if (target === "start" || target === "goal") return `/${target}`;
  const stop = target?.startsWith("stops/") ? target.slice(6) : null;
  if (stop) {
    const index = listOf(asked.stops).findIndex((each, k) => stopName(each, k) === stop);
    if (index >= 0) return `/stops/${index}/target`;
  }
  if (target?.startsWith("path")) return "/path";
  const pointer = FIELDS[slugOf(details)] ?? null;
  return pointer === "/duration" && kindOf(asked) === "round" ? "/time" : pointer;
}

/** Shows what went wrong with a request, at its fields where they are known. */
export function tell(error: unknown, asked: ApiRequest = request.value): void {
  if (error instanceof DOMException && error.name === "AbortError") return;
  if (!(error instanceof Problem)) console.error(error);
  const details = error instanceof Problem ? error.details : {};
  const fields = (details.errors ?? []).map(({ loc, msg }) => {
    const pointer = located(asked, loc);
    const { factor, sign } = UNITS[unitAt(pointer)];
    return { pointer, text: factor === 1 ? msg : `${msg} (in SI units, not ${sign})` };
  });
  const pointer = pointerOf(details, asked);
  const said = error instanceof Error ? error.message : String(error);
  const text = fields.length ? "Correct what is marked." : asShown(said);
  if (pointer !== null && !fields.length) fields.push({ pointer, text });
  trouble.value = {
    title: details.title ?? "Something went wrong",
    text,
    link: details.type?.includes("/problems/")
      ? details.type.slice(details.type.indexOf("problems/"))
      : null,
    pointer,
    fields,
  };
}

/** Does something that may fail, and says so if it does. */
export const trying = (act: () => Promise<unknown>) => () =>
  void act().catch((error) => tell(error));
