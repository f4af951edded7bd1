// What the wait until the next move costs, and what the whole cycle could save: both computed, not
// estimated.
import { effect, signal, untracked } from "@preact/signals";
import { post } from "../store/client";
import { answered, economics, stale, type Answered } from "../store/state";
import type { Solution } from "../store/types";

const PAUSE = 400; // after the last change of the cycle time [ms]

export interface Wait {
  cycle: number;
  /** Energy of the wait after the motion [J]. */
  waiting: number;
  /**
   * Energy of the motion that is optimised over the whole cycle, its wait included [J]; null: not
   * found.
   */
  whole: number | null;
}

export const wait = signal<Wait | null>(null);
/** Whether the wait could not be computed. */
export const waitFailed = signal(false);

/** Whether the motion has an end after which it waits. */
const waits = (shown: Answered, cycle: number | null): cycle is number =>
  cycle !== null &&
  !shown.cycle &&
  Boolean(shown.asked) &&
  !shown.asked?.dwell &&
  cycle > shown.solution.duration;

/** Follows the answer and the cycle time, from now on. */
export function followWaits(): void {
  let last: [Answered | null, number | null] = [null, null];
  effect(() => {
    const shown = answered.value;
    const cycle = economics.value.cycle;
    if (shown !== last[0] || cycle !== last[1]) {
      wait.value = null;
      waitFailed.value = false;
    }
    last = [shown, cycle];
    if (!shown || stale.value || !waits(shown, cycle) || wait.peek()?.whole) return undefined;
    const own = new AbortController();
    const timer = setTimeout(
      () =>
        untracked(
          () =>
            void compute(shown, cycle, own.signal).catch(
              () => (waitFailed.value = !own.signal.aborted),
            ),
        ),
      PAUSE,
    );
    return () => {
      clearTimeout(timer);
      own.abort();
    };
  });
}

async function compute(shown: Answered, cycle: number, signal: AbortSignal): Promise<void> {
  const { branch, duration } = shown.solution;
  const ends = {
    start: { q: branch.start.q },
    goal: { q: branch.goal.q },
    branch: null,
    windings: false,
    candidates: "none",
  };
  const dwell = { time: cycle };
  const held = await post<Solution>(
    "optimize",
    { ...shown.asked, ...ends, duration, dwell },
    signal,
  );
  wait.value = { cycle, waiting: held.energy.electrical.dwell ?? 0, whole: null };
  const { duration: _, ...free } = shown.asked!;
  const whole = await post<Solution>("optimize", { ...free, dwell, candidates: "none" }, signal);
  wait.value = { ...wait.value, whole: whole.energy.electrical.total };
}
