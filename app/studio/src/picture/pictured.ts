// What is drawn: the motion of the answer while it belongs to the request, else the cell at rest.
import { computed, effect, signal } from "@preact/signals";
import { IDENTITY, obstaclesOf, type Matrix } from "../store/chain";
import { reached } from "../store/reach";
import { robotName, rowsOf, targetAt, type Row } from "../store/request";
import { robotOf } from "../store/service";
import { answered, looked, racers, request, stale, type Answered } from "../store/state";
import { dressed, toolNow } from "../store/tools";
import type { ApiRequest, Robot, Solution } from "../store/types";

/** The robot of the request, when its figures have come. */
export const robotNow = signal<Robot | null>(null);

export interface Pictured {
  robot: Robot;
  /** Tool, payload, TCP and the obstacles in the base frame. */
  cell: ApiRequest;
  /** The motion with its cycle; null: the arm stands. */
  motion: Answered | null;
  arms: { name: string; solution: Solution; colour: number }[];
  /** Whether it is of a place of the base that is looked at. */
  elsewhere: boolean;
  /** Where the arm stands, and where it is to go. */
  start: number[];
  goal: number[] | null;
  /** The name of that place: a cycle being edited has stops. */
  goalName: string;
}

/**
 * The configuration that a target names, or the one that reaches it without a collision nearest to
 * `near`.
 */
export function configurationOf(row: Row | undefined, near: number[] | null): number[] | null {
  if (!row) return null;
  const target = targetAt(request.value, row);
  if (target.kind === "joints") return target.q;
  const reach = reached.value[row.pointer];
  if (reach?.state !== "reached") return null;
  const free = reach.solutions.filter(({ collides }) => !collides);
  const all = (free.length ? free : reach.solutions).map(({ q }) => q);
  if (!near) return all[0] ?? null;
  const far = (q: number[]) => Math.hypot(...q.map((x, j) => x - (near[j] ?? 0)));
  return [...all].sort((a, b) => far(a) - far(b))[0] ?? null;
}

/** Where the base of the arm stands in the picture. */
export const standing = computed<Matrix>(() => looked.value?.pose ?? IDENTITY);
// so that a base that is dragged moves what is drawn, and draws nothing anew
const isElsewhere = computed(() => looked.value !== null);
const motionThere = computed(() => looked.value?.motion ?? null);

export const pictured = computed<Pictured | null>(() => {
  const robot = robotNow.value;
  if (robot && isElsewhere.value) return elsewhere(still(robot), motionThere.value);
  const shown = stale.value ? null : answered.value;
  if (!shown) return robot && still(robot);
  const { solution, robot: own, cell } = shown;
  const arms = [{ name: "this motion", solution, colour: 0xffffff }, ...racers.value];
  const { q } = solution.trajectory;
  const goal = shown.cycle ? null : q.at(-1)!;
  const start = q[0]!;
  return { robot: own, cell, motion: shown, arms, elsewhere: false, start, goal, goalName: "Goal" };
});

/** The arm at a place that is looked at, with its motion there once it is known. */
function elsewhere(now: Pictured, motion: Answered | null): Pictured {
  if (!motion) return { ...now, elsewhere: true, goal: null };
  const { solution, cell } = motion;
  return {
    ...now,
    // what stands around the arm stays where it is
    cell: { ...cell, scene: now.cell.scene },
    motion,
    arms: [{ name: "this place", solution, colour: 0xffffff }],
    elsewhere: true,
    start: solution.trajectory.q[0]!,
    goal: null,
  };
}

/** The cell at rest. */
function still(robot: Robot): Pictured {
  const shown = answered.value;
  const rows = rowsOf(request.value);
  const fits = (q: number[] | null | undefined) => (q?.length === robot.joints.length ? q : null);
  const old = shown?.robot.name === robot.name ? shown.solution.branch : null;
  const start =
    fits(configurationOf(rows[0], old?.start.q ?? null)) ??
    fits(old?.start.q) ??
    robot.joints.map(() => 0);
  const goal = fits(configurationOf(rows.at(-1), old?.goal.q ?? start));
  return {
    robot,
    cell: stillCell(dressed(request.value, toolNow.value), robot),
    motion: null,
    arms: [],
    elsewhere: false,
    start,
    goal: rows.length > 1 ? goal : null,
    goalName: rows.at(-1)?.name ?? "Goal",
  };
}

/** The cell of a request that is being edited; what is wrong with it, the service says. */
function stillCell(asked: ApiRequest, robot: Robot): ApiRequest {
  try {
    return { ...asked, scene: { obstacles: obstaclesOf(asked, robot) } };
  } catch {
    return { tcp: asked.tcp, scene: { obstacles: [] } };
  }
}

/** Fetches the figures of the robot that is chosen, from now on. */
export function followRobot(): void {
  effect(() => {
    const name = robotName(request.value);
    if (robotNow.peek()?.name === name) return;
    robotOf(name)
      .then((robot) => {
        if (robotName(request.peek()) === name) robotNow.value = robot;
      })
      .catch(() => undefined); // the service says so when the request is sent
  });
}
