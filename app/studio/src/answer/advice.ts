// What else the task could be, and what that would need: computed by the service, not estimated.
import { effect, signal, untracked } from "@preact/signals";
import { post } from "../store/client";
import { endpointOf } from "../store/request";
import { answered, economics, run, stale, type Answered } from "../store/state";
import type { ApiRequest } from "../store/types";
import { figure, percent } from "../store/units";

const PAUSE = 400; // after the last change of the cycle time [ms]
const MOST = 30; // time that a cycle may have taken for its changes to be computed unasked [s]

/** A changed task, as `POST /advice` answers. Energies in J. */
export interface Change {
  name: "whole_cycle" | "brakes" | "without_home" | "shorter_stops" | "lighter_tool";
  energy: number;
  instead_of: number;
  share: number;
  duration: number;
  request: ApiRequest | null;
}

export interface Advised {
  /** Energy of the task with its wait [J]. */
  energy: number;
  waiting: number;
  /** Energy of the moves from the start and back to it [J]; null for a move. */
  home: number | null;
  advice: Change[];
  /** Whether the changes have been computed, too. */
  whole: boolean;
}

export const advised = signal<Advised | null>(null);
/** Whether the wait could not be computed. */
export const adviceFailed = signal(false);

/** What a change is, and the button that makes it. */
export const CHANGES: Record<Change["name"], { text: string; button: string }> = {
  whole_cycle: { text: "Use the whole cycle time", button: "Use the cycle time" },
  brakes: { text: "Brakes after 0.5 s at rest", button: "Use brakes" },
  without_home: { text: "Omit the start position", button: "Omit" },
  shorter_stops: { text: "Dwells 0.1 s shorter", button: "Shorten" },
  lighter_tool: { text: "Tool of half the mass", button: "" },
};

/** A change with its joules. */
export const wordsOf = ({ name, energy, share, duration }: Change) =>
  `${CHANGES[name].text}: ${figure(energy)} J${name === "without_home" ? ` in ${figure(duration)} s` : ""}, ${percent(share)} less.`;

/** Whether the motion ends before the next one begins, so that it waits. */
export const waits = (
  { asked, solution }: Answered,
  cycleTime: number | null,
): cycleTime is number =>
  cycleTime !== null && cycleTime > solution.duration && (asked?.dwell ?? null) === null;

/** Follows the answer and the cycle time, from now on. */
export function followAdvice(): void {
  let last: [Answered | null, number | null] = [null, null];
  effect(() => {
    const shown = answered.value;
    const cycleTime = economics.value.cycleTime;
    if (shown !== last[0] || cycleTime !== last[1]) {
      advised.value = null;
      adviceFailed.value = false;
    }
    last = [shown, cycleTime];
    // what the person asks for goes first
    if (!shown?.asked || !shown.solution.id || stale.value || run.value) return undefined;
    if (advised.peek()?.whole) return undefined;
    const own = new AbortController();
    const begin = () =>
      compute(shown, cycleTime, own.signal).catch(() => (adviceFailed.value = !own.signal.aborted));
    const timer = setTimeout(() => untracked(() => void begin()), PAUSE);
    return () => {
      clearTimeout(timer);
      own.abort();
    };
  });
}

async function compute(
  shown: Answered,
  cycleTime: number | null,
  signal: AbortSignal,
): Promise<void> {
  const asked = shown.asked!;
  const body = {
    [endpointOf(asked)]: asked,
    answer: shown.solution.id,
    period: waits(shown, cycleTime) ? cycleTime : null,
  };
  const ask = (more: object) => post<Advised>("advice", { ...body, ...more }, signal);
  advised.value = { ...(await ask({ changes: [] })), whole: false };
  const long = shown.cycle !== null && (shown.took === null || shown.took > MOST);
  if (!long) advised.value = { ...(await ask({})), whole: true };
}
