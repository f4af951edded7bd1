// The way of a request to the service and back, with its progress.
import { batch } from "@preact/signals";
import { obstaclesOf } from "./chain";
import { brokenOff, patch, Problem, stream } from "./client";
import { cycleAnswered } from "./cycle";
import { askedFor } from "./persist";
import { robotOf } from "./service";
import { dressedLater } from "./tools";
import { deadlineOf, endpointOf } from "./request";
import {
  display,
  project,
  request,
  run,
  tab,
  toast,
  trouble,
  typed,
  type Answered,
  type Run,
} from "./state";
import type { ApiRequest, Cycle, Solution } from "./types";

const LONGEST_NAME = 200;
const PATIENCE = 3; // times that a busy service is asked again
let running: AbortController | null = null;

export const cancel = () => running?.abort();

/** Sends the request, shows its progress, then its answer. Throws Problem. */
export async function optimise(asked: ApiRequest = request.value): Promise<void> {
  const began = performance.now();
  const answer = await compute(endpointOf(asked), asked, deadlineOf(asked));
  if (!answer) return;
  await named((answer as Solution).id);
  await showAnswer(answer, asked, (performance.now() - began) / 1000);
  if (tab.value === "task") tab.value = "answer";
}

/**
 * Names a kept answer after the project, and keeps with it how its request was typed, unless this
 * browser has asked for it before.
 */
export async function named(id: string | null, what?: string): Promise<void> {
  if (id === null || (await askedFor(id))) return;
  const after = what ? `, ${what}` : "";
  const name = project.value.name.slice(0, LONGEST_NAME - after.length) + after;
  void patch(`answers/${id}`, { name, typed: typed.value }).catch(() => undefined);
}

/** Shows an answer of `POST /optimize` or `POST /cycle` with its request. Throws Problem. */
export async function showAnswer(
  answer: unknown,
  asked: ApiRequest | null,
  took: number | null = null,
): Promise<void> {
  display(await answeredBy(answer, asked, took));
}

/** An answer of `POST /optimize` or `POST /cycle` as something to show. Throws Problem. */
export function answeredBy(
  answer: unknown,
  asked: ApiRequest | null,
  took: number | null,
): Promise<Answered> {
  const given = answer as Solution | Cycle;
  return "legs" in given ? cycleAnswered(given, asked, took) : moveAnswered(given, asked, took);
}

/** Without its request, the cell is what the answer says of its arm. */
async function moveAnswered(
  solution: Solution,
  asked: ApiRequest | null,
  took: number | null,
): Promise<Answered> {
  const robot = await robotOf(solution.robot);
  const whole = await dressedLater({ ...solution.arm, ...asked, robot: solution.robot });
  const cell = { ...whole, scene: { obstacles: obstaclesOf(whole, robot) } };
  return { asked, cell, solution, robot, cycle: null, took };
}

/** The answer to a POST with progress; null if it was cancelled. Throws Problem. */
export async function compute(
  endpoint: string,
  body: unknown,
  deadline: number | null = null,
): Promise<unknown> {
  running?.abort();
  const own = (running = new AbortController());
  batch(() => {
    trouble.value = null;
    const began = performance.now();
    run.value = { endpoint, began, deadline, done: 0, total: 0, incumbents: [] };
  });
  try {
    return await patiently(() => streamed(endpoint, body, own.signal));
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") {
      if (running === own) toast.value = "Cancelled.";
      return null;
    }
    throw error;
  } finally {
    if (running === own) run.value = null;
  }
}

async function streamed(endpoint: string, body: unknown, signal: AbortSignal): Promise<unknown> {
  let answer: unknown = null;
  await stream(
    endpoint,
    body,
    (name, data) => {
      if (name === "answer") answer = data;
      else if (run.value) run.value = progressed(run.value, name, data as Record<string, number>);
    },
    signal,
  );
  if (answer) return answer;
  throw brokenOff();
}

function progressed(now: Run, name: string, data: Record<string, number>): Run {
  if (name === "candidates") return { ...now, total: data.total ?? 0 };
  if (name === "candidate") return { ...now, done: now.done + 1 };
  if (name !== "incumbent") return now;
  const found = { ...data, at: performance.now() } as unknown as Run["incumbents"][number];
  return { ...now, incumbents: [...now.incumbents, found] };
}

/** Asks a busy service again after the time that it names. */
async function patiently<T>(attempt: () => Promise<T>): Promise<T> {
  for (let left = PATIENCE; ; left--) {
    try {
      return await attempt();
    } catch (error) {
      const retry =
        error instanceof Problem && error.details.status === 503 ? error.details.retry : null;
      if (!left || !retry) throw error;
      toast.value = `The service is busy: trying again in ${retry} s.`;
      await new Promise((resolve) => setTimeout(resolve, 1000 * retry));
    }
  }
}
