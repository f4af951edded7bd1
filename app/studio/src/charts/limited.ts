// Use of the limits, from the samples of a motion.
import type { Answered } from "../store/state";

/** The samples that a torque limit is for: those of the motor, or those of the link. */
export const limitedTorque = ({ robot, solution }: Answered): number[][] =>
  solution.trajectory[robot.limits.torque_side?.value === "link" ? "tau" : "tau_motor"];

const shareOf = (rows: number[][], most: (number | null)[]) =>
  rows.map((row) => row.map((x, j) => (most[j] ? Math.abs(x) / most[j]! : 0)));

/** Time of the sample that uses most of a limit; null where the samples do not tell. */
export function worstTime(shown: Answered, name: string): number | null {
  const { trajectory, limits } = shown.solution;
  const { t, q, v, a } = trajectory;
  const shares: Record<string, () => number[][]> = {
    position: () =>
      q.map((row) =>
        row.map((x, j) => {
          const [least, most] = [limits.position_min[j]!, limits.position_max[j]!];
          return Math.abs(2 * x - least - most) / (most - least);
        }),
      ),
    velocity: () => shareOf(v, limits.velocity),
    acceleration: () => shareOf(a, limits.acceleration),
    jerk: () =>
      shareOf(
        a.slice(1).map((row, k) => row.map((x, j) => (x - a[k]![j]!) / (t[k + 1]! - t[k]! || 1))),
        limits.jerk,
      ),
    torque: () => shareOf(limitedTorque(shown), limits.torque),
  };
  const worst = shares[name]?.().map((row) => Math.max(...row));
  return worst ? t[worst.indexOf(Math.max(...worst))]! : null;
}
