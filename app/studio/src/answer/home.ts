// What the way from the start and back to it takes of a round, and the round without it: both
// computed.
import { effect, signal, untracked } from "@preact/signals";
import { post } from "../store/client";
import { listOf } from "../store/request";
import { answered, stale, type Answered } from "../store/state";
import type { ApiRequest, Cycle, Stop } from "../store/types";

const LEAST = 0.05; // share of the round below which the way home is no matter
const MOST = 20; // time that the round may have taken for another one to be computed unasked [s]

export interface Home {
  /** Energy of the moves from the start and back to it [J]. */
  joules: number;
  /** The round that begins at its last stop. */
  request: ApiRequest;
  without: { joules: number; duration: number } | null;
}

export const home = signal<Home | null>(null);

/**
 * The round that begins and ends at its last stop; null where the arm would carry something else
 * there.
 */
export function withoutHome(asked: ApiRequest): ApiRequest | null {
  const stops = listOf<Stop>(asked.stops);
  const last = stops.at(-1);
  if (
    asked.closed === false ||
    asked.order === "free" ||
    stops.length < 2 ||
    !last?.target ||
    last.via
  )
    return null;
  const carried = stops.reduce<unknown>(
    (now, stop) => ("payload" in stop ? stop.payload : now),
    asked.payload ?? null,
  );
  if (JSON.stringify(carried ?? null) !== JSON.stringify(asked.payload ?? null)) return null;
  return JSON.stringify(asked.start) === JSON.stringify(last.target)
    ? null
    : { ...asked, start: last.target };
}

/** Follows the answer, from now on. */
export function followHome(): void {
  let last: Answered | null = null;
  effect(() => {
    const shown = answered.value;
    if (shown !== last) home.value = null;
    last = shown;
    const request = shown?.asked && shown.cycle ? withoutHome(shown.asked) : null;
    if (!shown || !request || stale.value || home.peek()?.without) return undefined;
    const own = new AbortController();
    untracked(() => void compute(shown, request, own.signal).catch(() => undefined));
    return () => own.abort();
  });
}

async function compute(shown: Answered, request: ApiRequest, signal: AbortSignal): Promise<void> {
  const ways = shown.cycle!.legs.filter(
    ({ kind, start, goal }) => kind === "move" && (start.stop === "start" || goal.stop === "start"),
  );
  const joules = ways.reduce((sum, { electrical }) => sum + electrical, 0);
  if (joules < LEAST * shown.solution.energy.electrical.total) return;
  home.value = { joules, request, without: null };
  if (shown.took === null || shown.took > MOST) return;
  const { energy, duration } = await post<Cycle>("cycle", request, signal);
  home.value = { joules, request, without: { joules: energy.electrical.total, duration } };
}
