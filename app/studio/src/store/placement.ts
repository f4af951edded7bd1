// Where to put the robot: the region, the map of the service, and the place that is looked at.
import { batch, computed, signal } from "@preact/signals";
import { inverse, multiply, ofPose, poseOfMatrix, type Matrix } from "./chain";
import { diff } from "./diff";
import { asKind } from "./edits";
import { capital, energyOf } from "./facts";
import { placesOf, REASONS, worldOf, yawOf } from "./places";
import type { Layer, Mount, Place, PlacedCycle, PlacementAnswer } from "./places";
import { deadlineOf, endpointOf, isObject, robotName } from "./request";
import { answeredBy, compute, named } from "./run";
import { seenFrom } from "./seenFrom";
import { keptAnswer, robotOf } from "./service";
import {
  display,
  edit,
  looked,
  looking,
  placing,
  project,
  request,
  run,
  selected,
  toast,
  typed,
  type Looked,
} from "./state";
import type { ApiRequest, Cycle } from "./types";
import { said } from "./trouble";
import { typedValue, type UnitName } from "./units";

/** The base of the robot among what can be dragged. */
export const BASE = "/base";

/** The region as it is typed: from where to where the base may be moved. */
export interface RegionTyped {
  x: [string, string];
  y: [string, string];
  z: [string, string];
  yaw: [string, string];
  /** Which coordinates are free. */
  free: Record<Coordinate, boolean>;
  mounts: Mount[];
  /** Distance of the places of the map; empty: at most 100 places. */
  step: string;
  deadline: string;
}

export const COORDINATES = ["x", "y", "z", "yaw"] as const;
export type Coordinate = (typeof COORDINATES)[number];
export const UNIT: Record<Coordinate, UnitName> = { x: "mm", y: "mm", z: "mm", yaw: "deg" };

/** A map with the task that it belongs to. */
export interface Mapped {
  project: string;
  asked: ApiRequest;
  /** What was sent, with all poses in the world. */
  body: Record<string, unknown>;
  world: Matrix;
  answer: PlacementAnswer;
  places: Place[];
}

export const regionTyped = signal<RegionTyped>({
  x: ["-200", "200"],
  y: ["-200", "200"],
  z: ["-100", "200"],
  yaw: ["-90", "90"],
  free: { x: true, y: true, z: false, yaw: false },
  mounts: [],
  step: "",
  deadline: "60",
});
export const layer = signal<Layer>({ height: null, mount: null });
/** Why the last search has no answer. */
export const refused = signal("");

const last = signal<Mapped | null>(null);
/** The map of this cell, whether or not the task has been changed since. */
export const mapped = computed(() =>
  last.value?.project === project.value.id ? last.value : null,
);
export const mapChanges = computed(() =>
  mapped.value ? diff(mapped.value.asked, request.value) : [],
);
/** The map, as long as it belongs to the task; only with the panel open. */
export const mapShown = computed(() =>
  placing.value && !mapChanges.value.length ? mapped.value : null,
);

export interface Asked {
  region: Record<string, unknown>;
  resolution?: number;
  deadline: number;
}

/**
 * The region as `POST /placement` takes it, or what is wrong with it; `yaw`: of the present base
 * [rad].
 */
export function regionOf(given: RegionTyped, yaw: number): Asked | { why: string } {
  const region: Record<string, unknown> = {};
  for (const name of COORDINATES.filter((each) => given.free[each])) {
    const ends = given[name].map((text) => typedValue(text, UNIT[name]));
    if (ends.includes(null)) return { why: `Enter two numbers for ${name} of the region.` };
    const [low, high] = ends as [number, number];
    if (!(low <= 0 && 0 <= high && low < high))
      return { why: `The range of ${name} must contain 0, the current place of the robot.` };
    region[name] = name === "yaw" ? [yaw + low, yaw + high] : [low, high];
  }
  if (given.mounts.length > 1) region.mounts = given.mounts;
  if (!Object.keys(region).length) return { why: "Tick what may change: x, y, z, yaw or mounts." };
  const deadline = typedValue(given.deadline, "s");
  if (deadline === null || deadline <= 0) return { why: "Enter the search time in seconds." };
  if (!given.step.trim()) return { region, deadline };
  const resolution = typedValue(given.step, "mm");
  if (resolution === null || resolution <= 0) return { why: "Enter the spacing of places in mm." };
  return { region, resolution, deadline };
}

/** A move as a cycle of one stop, from which the arm does not return. */
export function cycleOf(asked: ApiRequest): ApiRequest {
  if (asked.stops !== undefined) return asked;
  const { duration, dwell } = asked;
  const cycle: ApiRequest = { ...asKind(asked, "cycle"), closed: false };
  if (isObject(dwell)) {
    const { time, ...hold } = dwell;
    return { ...cycle, time, wait: "goal", ...(Object.keys(hold).length ? { hold } : {}) };
  }
  return duration === undefined ? cycle : { ...cycle, time: duration };
}

/** Asks for the map of the region, and looks at its best place. */
export async function search(): Promise<void> {
  const asked = request.value;
  refused.value = "";
  try {
    const robot = await robotOf(robotName(asked));
    const world = worldOf(asked, robot);
    const given = regionOf(regionTyped.value, yawOf(world));
    if ("why" in given) throw new Error(given.why);
    const cycle = seenFrom(cycleOf(asked), inverse(world), robot);
    const body = { cycle, base: poseOfMatrix(world), ...given };
    const answer = (await compute("placement", body, given.deadline)) as PlacementAnswer | null;
    if (!answer) return;
    const places = placesOf(answer, world);
    batch(() => {
      layer.value = { height: null, mount: null };
      last.value = { project: project.value.id, asked, body, world, answer, places };
    });
    void named(answer.id, "places");
    if (request.value === asked) await look(bestPose(last.value!));
  } catch (error) {
    refused.value = said(error);
  }
}

const poseOf = ({ world }: Mapped, { base }: PlacedCycle) => multiply(inverse(world), ofPose(base));

export const bestPose = (map: Mapped) => poseOf(map, map.answer.best);

/** Moves the base in the picture, without computing. Throws Problem. */
export async function moveBase(pose: Matrix): Promise<Looked> {
  const asked = request.value;
  const robot = await robotOf(robotName(asked));
  const next: Looked = {
    asked,
    robot,
    pose,
    state: "moving",
    energy: null,
    why: "",
    motion: null,
  };
  return (looking.value = next);
}

export const stopLooking = () => (looking.value = null);

const SAME = 1e-9; // distance of two poses that are one
let computing = 0; // looks whose joules are awaited; a new one ends those before

/** Puts the base somewhere, and shows what the task needs there. */
export async function look(pose: Matrix): Promise<void> {
  const now = await moveBase(pose);
  const map = mapShown.value;
  const known = map?.places.find((each) => isAt(each.pose, pose));
  const next = (more: Partial<Looked>) => {
    if (looking.value?.pose === pose) looking.value = { ...looking.value, ...more };
  };
  if (known?.reason) return next({ state: "failed", why: `${capital(REASONS[known.reason])}.` });
  if (run.value && !computing)
    return next({ state: "failed", why: "Another computation is running: wait, or cancel it." });
  next({ state: "computing", energy: known?.energy ?? null });
  computing += 1;
  try {
    const found = await motionAt(now, map);
    next(
      found
        ? { state: "shown", energy: energyOf(found), motion: found }
        : { state: "failed", why: "Cancelled." },
    );
  } catch (error) {
    next({ state: "failed", energy: null, why: said(error) });
  } finally {
    computing -= 1;
  }
}

const isAt = (one: Matrix, other: Matrix) =>
  one.every((value, k) => Math.abs(value - other[k]!) < SAME);

/** What the task needs at a place: a kept answer of the map, or a new one. Throws Problem. */
async function motionAt({ asked, robot, pose }: Looked, map: Mapped | null) {
  const there = seenFrom(asked, pose, robot);
  const placed = [map?.answer.best, map?.answer.nominal];
  const kept = placed.find((each) => each && isAt(poseOf(map!, each), pose));
  if (kept) {
    const cycle = await keptAnswer<Cycle>(kept.cycles[0]!.answer);
    if (asked.stops !== undefined) return answeredBy(cycle, there, null);
    // a single move was placed as a cycle; with a wait, it is computed as the move that it is
    const [leg, ...rests] = cycle.legs;
    if (!rests.length) return answeredBy(await keptAnswer(leg!.answer!), there, null);
  }
  const answer = await compute(endpointOf(asked), there, deadlineOf(asked));
  if (!answer) return null;
  void named((answer as { id: string | null }).id, "another place");
  return answeredBy(answer, there, null);
}

/** Closes the panel; the base can no longer be dragged. */
export function close(): void {
  placing.value = false;
  looking.value = null;
  if (selected.value === BASE) selected.value = null;
}

/** Writes the place that is looked at into the task with its motion, as one step of undo. */
export function accept(): void {
  const motion = looked.value?.motion;
  if (!motion?.asked) return;
  const { asked } = motion;
  batch(() => {
    edit(asked, typed.value);
    display(motion);
    close();
    toast.value = "All poses now refer to the new place of the base.";
  });
}
