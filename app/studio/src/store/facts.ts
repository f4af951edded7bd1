// Figures of the answer, in words.
import { at } from "./pointer";
import type { Answered } from "./state";
import { figure, words } from "./units";

export const BASELINES: Record<string, string> = {
  trapezoid: "Trapezoidal speed",
  quintic: "Quintic polynomial",
  ruckig: "Time-optimal motion",
  ruckig_slowed: "Time-optimal, slowed",
  straight: "Straight in joint space",
  controller_default: "Controller default",
  waypoints: "Via points with stops",
  blended: "Rounded via points",
  even_speed: "Constant speed on path",
  stopping: "Rest at every stop",
  move_by_move: "Each move chosen alone",
  same_factor: "All moves scaled equally",
  fastest_then_wait: "Fastest cycle, then a wait",
  given_order: "Stops in the given order",
  without_storage: "Without energy storage",
};

/** The name of a baseline; along a path, the quintic is one of the path. */
export const baselineName = (name: string, along = false) =>
  along && name === "quintic"
    ? "Quintic along the path"
    : (BASELINES[name] ?? capital(words(name)));

export const capital = (text: string) => text.charAt(0).toUpperCase() + text.slice(1);

export const nounOf = (shown: Answered) => (shown.cycle ? "cycle" : "move");

/**
 * Time from the start of a motion to the start of the next [s]: `cycleTime`, if one comes every so many
 * seconds. A request with a wait has its own.
 */
export function periodOf({ asked, solution }: Answered, cycleTime: number | null): number {
  const own = at(asked, "/dwell/time");
  return Math.max(typeof own === "number" ? own : (cycleTime ?? 0), solution.duration);
}

/** Energy of the objective that was minimised [J]. */
export const energyOf = ({ solution }: Answered) => solution.energy[solution.objective].total;

/** By how much the energy is at most above the least possible; null without a bound. */
export function gapOf(shown: Answered): number | null {
  const bound = shown.solution.energy.lower_bound;
  return bound > 0 ? energyOf(shown) / bound - 1 : null;
}

const FULL = 1.0005; // share of a limit that counts as kept, in the certificate's own tolerance

/** The limit that the certificate finds broken; null if none is. */
export function brokenLimit({ solution }: Answered): string | null {
  const { worst_ratio: ratios, clearance } = solution.certificate;
  const over = Object.entries(ratios).find(([, share]) => (share ?? 0) > FULL);
  if (over) return `${words(over[0])} at ${figure((over[1] ?? 0) * 100)} % of its limit`;
  if (clearance && clearance.min_clearance < -1e-4)
    return `${clearance.pair.join(" and ")} come too close`;
  return null;
}

/** `left/up/no_flip` in words. */
export const postureWords = (label: string) =>
  label
    .split("/")
    .map((part) => words(part))
    .join(", ");

// fields that the service names in a sentence, in the words of the panel
const NAMED: Record<string, string> = {
  "`controller_default`": "“Controller default”",
  "`payload.shape`": "“Shape” of the payload",
  "`tool.capsules`": "the capsules of the tool",
};

/** A sentence of the service without its marks of code. */
export const plain = (text: string) =>
  text.replace(/`[a-z._]+`/g, (field) => NAMED[field] ?? field).replaceAll("`", "");
