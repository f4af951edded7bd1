// The first eight postures that reach the goal, each with the energy of its own motion, computed
// unasked.
import { effect, signal, untracked } from "@preact/signals";
import { post } from "../store/client";
import { named } from "../store/run";
import { ikBody } from "../store/reach";
import { rowsOf, targetAt } from "../store/request";
import { answered, stale, type Answered } from "../store/state";
import type { IkSolution, Solution } from "../store/types";

const MOST = 8;
const LETTERS = "ABCDEFGH";
const PATIENCE = 4; // deadline of one motion [s]
const MOST_TURNS = 64; // of a posture, that are compared

export interface Posture {
  letter: string;
  label: string;
  q: number[];
  /** The same posture with joints full turns further. */
  turns: number[][];
  state: "computing" | "shown" | "collides" | "failed";
  energy: number | null;
  duration: number | null;
  why: string;
  solution: Solution | null;
}

export const postures = signal<Posture[] | null>(null);

const apart = (a: number[], b: number[]) =>
  a.some((x, j) => Math.abs(Math.sin((x - b[j]!) / 2)) > 1e-4);

/** Follows the answer, from now on. */
export function followPostures(): void {
  let last: Answered | null = null;
  effect(() => {
    const shown = answered.value;
    const own = new AbortController();
    if (shown !== last) postures.value = null;
    last = shown;
    const known = postures.peek()?.every(({ state }) => state !== "computing");
    if (shown?.asked && !shown.cycle && !stale.value && !known && shown.asked.path == null)
      untracked(() => void compute(shown, own.signal).catch(() => undefined));
    return () => own.abort();
  });
}

async function compute(shown: Answered, signal: AbortSignal): Promise<void> {
  const asked = shown.asked!;
  const row = rowsOf(asked).at(-1)!;
  const target = targetAt(asked, row);
  if (target.kind !== "pose") return;
  const { solutions } = await post<{ solutions: IkSolution[] }>(
    "ik",
    ikBody(asked, target.pose, true),
    signal,
  );
  const { start, goal } = shown.solution.branch;
  let all = distinct(solutions, start.q, goal.q).map(
    ([{ label, q, collides, nearest }, own], k): Posture => ({
      turns: solutions
        .filter((each) => !apart(each.q, q))
        .map((each) => each.q)
        .slice(0, MOST_TURNS),
      letter: LETTERS[k]!,
      label: own ? goal.label : label,
      q: own ? goal.q : q,
      state: own ? "shown" : collides ? "collides" : "computing",
      energy: own ? shown.solution.energy.electrical.total : null,
      duration: own ? shown.solution.duration : null,
      why: collides ? `${nearest?.pair.join(" and ") ?? "two bodies"} collide` : "",
      solution: own ? shown.solution : null,
    }),
  );
  postures.value = all;
  for (const posture of all.filter(({ state }) => state === "computing")) {
    const next = await motionTo(shown, posture, signal);
    if (signal.aborted) return;
    all = all.map((each) => (each.letter === posture.letter ? next : each));
    postures.value = all;
  }
  postures.value = ordered(all);
}

/** That of the answer first, then by energy; those without a motion last. */
function ordered([own, ...others]: Posture[]): Posture[] {
  const rest = others.sort((a, b) => (a.energy ?? Infinity) - (b.energy ?? Infinity));
  return [own!, ...rest].map((each, k) => ({ ...each, letter: LETTERS[k]! }));
}

/**
 * One solution of each posture, the one nearest to the start; that of the answer first, those that
 * collide last.
 */
function distinct(
  solutions: IkSolution[],
  start: number[],
  goal: number[],
): [IkSolution, boolean][] {
  const far = ({ q }: IkSolution) => Math.hypot(...q.map((x, j) => x - start[j]!));
  const kept: IkSolution[] = [];
  for (const each of [...solutions].sort((a, b) => far(a) - far(b)))
    if (kept.every((other) => apart(other.q, each.q))) kept.push(each);
  const own = kept.filter(({ q }) => !apart(q, goal));
  const others = kept
    .filter(({ q }) => apart(q, goal))
    .sort((a, b) => Number(a.collides) - Number(b.collides));
  return [
    ...own.map((each): [IkSolution, boolean] => [each, true]),
    ...others.map((each): [IkSolution, boolean] => [each, false]),
  ].slice(0, MOST);
}

/** The best motion to one posture, from the start that suits it best. */
async function motionTo(shown: Answered, posture: Posture, signal: AbortSignal): Promise<Posture> {
  const goal = { any_of: posture.turns.map((q) => ({ q })) };
  const body = {
    ...shown.asked,
    goal,
    branch: null,
    windings: false,
    candidates: "none",
    deadline: PATIENCE,
  };
  try {
    const solution = await post<Solution>("optimize", body, signal);
    const { q } = solution.branch.goal;
    void named(solution.id, "posture");
    return {
      ...posture,
      q,
      state: "shown",
      energy: solution.energy.electrical.total,
      duration: solution.duration,
      solution,
    };
  } catch (error) {
    return { ...posture, state: "failed", why: (error as Error).message };
  }
}
