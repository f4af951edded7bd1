// Errors, as sentences at the fields that caused them.
import { Problem } from "./client";
import { unitAt } from "./diff";
import { join, located, type Pointer } from "./pointer";
import { kindOf, listOf, obstaclesListed, stopName } from "./request";
import { request, trouble } from "./state";
import type { ApiRequest, Obstacle, ProblemDetails } from "./types";
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

export const slugOf = (details: ProblemDetails) => details.type?.split("/").at(-1) ?? "";

/** The page that explains a problem; null if it has none. */
export const linkOf = ({ type }: ProblemDetails): string | null =>
  type?.includes("/problems/") ? type.slice(type.indexOf("problems/")) : null;

/** The fields that a problem is about: the target or setting, and the obstacle that is hit. */
function pointersOf(details: ProblemDetails, asked: ApiRequest): Pointer[] {
  const isNear = ({ name }: Obstacle) => details.pair?.includes(name);
  const obstacle = obstaclesListed(asked).findIndex(isNear);
  const own = pointerOf(details, asked);
  return [
    ...(own === null ? [] : [own]),
    ...(obstacle < 0 ? [] : [join("scene", "obstacles", obstacle)]),
  ];
}

/** The target or setting that a problem is about; null if it names none. */
function pointerOf(details: ProblemDetails, asked: ApiRequest): Pointer | null {
  const place = details.target ?? details.stop ?? details.path;
  if (place && !place.startsWith("stops/")) return `/${place.replaceAll(".", "/")}`;
  // also a line of a stop, or the begin of its path
  const isOf = (stop: unknown, k: number) => `${place}/`.startsWith(`stops/${stopName(stop, k)}/`);
  const stop = listOf(asked.stops).findIndex(isOf);
  if (stop >= 0) return `/stops/${stop}/target`;
  const pointer = FIELDS[slugOf(details)];
  return pointer === "/duration" && kindOf(asked) === "cycle" ? "/time" : (pointer ?? null);
}

/** Shows what went wrong with a request, at its fields where they are known. */
export function tell(error: unknown, asked: ApiRequest = request.value): void {
  if (error instanceof DOMException && error.name === "AbortError") return;
  if (!(error instanceof Problem)) console.error(error);
  const details = error instanceof Problem ? error.details : {};
  const fields = (details.errors ?? []).map(({ loc, msg }) => {
    const pointer = located(asked, loc);
    const { factor, sign } = UNITS[unitAt(pointer)];
    return {
      pointer,
      text: factor === 1 || !/\d/.test(msg) ? msg : `${msg} (in SI units, not ${sign})`,
    };
  });
  const said = error instanceof Error ? error.message : String(error);
  const text = fields.length ? "Correct the marked fields." : asShown(said);
  if (!fields.length)
    fields.push(...pointersOf(details, asked).map((pointer) => ({ pointer, text })));
  trouble.value = {
    title: details.title ?? "Something went wrong",
    text,
    link: linkOf(details),
    fields,
  };
}

/** What went wrong, in words, with the fields that the service names. */
export function said(error: unknown): string {
  const fields = error instanceof Problem ? (error.details.errors ?? []) : [];
  const text = error instanceof Error ? error.message : String(error);
  return fields.length
    ? fields.map(({ loc, msg }) => `${loc.slice(1).join(".")}: ${msg}.`).join(" ")
    : asShown(text);
}

/** Does something that may fail, and says so if it does. */
export const trying = (act: () => Promise<unknown>) => () =>
  void act().catch((error) => tell(error));
