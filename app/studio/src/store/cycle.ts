// Whole cycles: their legs, played as one motion.
import { obstaclesOf } from "./chain";
import { keptAnswer, robotOf } from "./service";
import type { Answered, CycleShown } from "./state";
import { dressedLater } from "./tools";
import type { ApiRequest, Configuration, Cycle, Leg, Solution, Trajectory } from "./types";

const REST = 0.1; // time between the samples of a rest [s]
const SAMPLED = ["q", "v", "a", "tau", "tau_motor", "power"] as const;

/** An answer of POST /cycle as something to show: its moves, which are kept answers, and its rests become one motion.
 * Throws Problem. */
export async function cycleAnswered(
  cycle: Cycle,
  asked: ApiRequest | null,
  took: number | null,
): Promise<Answered> {
  const robot = await robotOf(cycle.robot);
  const moves = await Promise.all(
    cycle.legs.map(({ answer }) => (answer ? keptAnswer<Solution>(answer) : null)),
  );
  const first = moves.find((move) => move !== null);
  if (!first) throw new Error("This cycle contains no move to show.");
  const worst = cycle.certificate.clearance;
  const clearance = worst && { ...worst, time: worst.time + (cycle.legs[worst.leg ?? 0]?.t0 ?? 0) };
  const solution: Solution = {
    ...first,
    ...cycle,
    arm: null,
    trajectory: joined(cycle.legs, moves),
    candidates: [],
    candidate_counts: {},
    certificate: { ...first.certificate, ...cycle.certificate, clearance },
    branch: { start: cycle.legs[0]!.start, goal: cycle.legs.at(-1)!.goal },
  };
  const whole = await dressedLater({ ...first.arm, ...asked, robot: cycle.robot });
  const shown: CycleShown = { ...cycle, loads: loadsOf(cycle.legs, moves, whole) };
  const cell = { ...whole, scene: { obstacles: obstaclesOf(whole, robot) } };
  return { asked, cell, solution, robot, cycle: shown, took };
}

/** The samples of all legs in a row. A rest holds its configuration, and draws its mean power. */
function joined(legs: Leg[], moves: (Solution | null)[]): Trajectory {
  const whole: Trajectory = { t: [], q: [], v: [], a: [], tau: [], tau_motor: [], power: [] };
  legs.forEach((leg, k) => {
    const move = moves[k]?.trajectory ?? resting(leg);
    move.t.forEach((time, sample) => {
      whole.t.push(leg.t0 + time);
      for (const name of SAMPLED) (whole[name] as unknown[]).push(move[name][sample]);
    });
  });
  return whole;
}

function resting({ duration, start, electrical }: Leg): Trajectory {
  const count = Math.max(2, Math.ceil(duration / REST));
  const t = Array.from({ length: count }, (_, k) => (duration * k) / (count - 1));
  const still = start.q.map(() => 0);
  const of = <T>(value: T) => t.map(() => value);
  const rest = of(still);
  return {
    t,
    q: of(start.q),
    v: rest,
    a: rest,
    tau: rest,
    tau_motor: rest,
    power: of(electrical / (duration || 1)),
  };
}

/**
 * What the arm carries from each leg on, and the obstacles that do not count then: as the moves'
 * answers say.
 */
function loadsOf(
  legs: Leg[],
  moves: (Solution | null)[],
  { payload = null, scene }: ApiRequest,
): CycleShown["loads"] {
  const all = (scene?.obstacles ?? []).map(({ name }) => name);
  return legs.map(({ t0 }, k) => {
    // at a stop the arm carries what it carries on its next move
    const next = [...moves.slice(k), ...moves.slice(0, k).reverse()].find((move) => move !== null);
    const arm = next?.arm ?? { payload };
    const counted = new Set((arm.scene?.obstacles ?? []).map(({ name }) => name));
    return {
      t0,
      payload: arm.payload ?? null,
      ignored: arm.scene ? all.filter((name) => !counted.has(name)) : [],
    };
  });
}

/** Number of the leg at a time of the cycle. */
export function legAt(legs: { t0: number }[], time: number): number {
  return Math.max(
    0,
    legs.findLastIndex(({ t0 }) => t0 <= time + 1e-9),
  );
}

export function legName({ kind, start, passes, goal }: Leg): string {
  const names = [start, ...(passes ?? []), goal].map(({ stop }) => stop ?? "?");
  return kind === "move" ? names.join(" → ") : `${kind} at ${goal.stop ?? "?"}`;
}

/** Where the arm stands at a stop of a cycle that is shown. */
export const stopsOf = (cycle: Cycle): Configuration[] =>
  cycle.legs.flatMap(({ passes, goal }) => [...(passes ?? []), goal]);
