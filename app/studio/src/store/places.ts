// The map of a placement: its places, the best of those above one another, and their words.
import { Matrix4, Quaternion, Vector3 } from "three";
import { inverse, multiply, ofPose, positionOf, type Matrix } from "./chain";
import { gravityOf } from "./seenFrom";
import type { ApiRequest, Pose, Robot } from "./types";
import { figure, shown } from "./units";

export const MOUNTS = ["floor", "wall", "ceiling"] as const;
export type Mount = (typeof MOUNTS)[number];

/** Why a place has no energy, as the page says it. */
export const REASONS = {
  reach: "out of reach",
  collision: "in collision",
  torque: "insufficient torque",
  time: "takes too long",
  motion: "no motion found",
} as const;
export type Reason = keyof typeof REASONS;
export const LEFT_OUT = "not computed";

interface MapPoint {
  base: Pose;
  mount: Mount | null;
  energy: number | null;
  reason: Reason | null;
}

export interface PlacedCycle extends Pick<MapPoint, "base" | "mount"> {
  energy: number;
  duration: number;
  cycles: { answer: string; request: ApiRequest | null }[];
}

/** An answer of `POST /placement`, as far as the page reads it. */
export interface PlacementAnswer {
  id: string | null;
  status: "complete" | "cut_short";
  best: PlacedCycle;
  nominal: PlacedCycle | null;
  nominal_reason: Reason | null;
  saving: number | null;
  lower_bound: number | null;
  tolerance: { coordinate: "x" | "y" | "z" | "yaw"; lower: number; upper: number }[];
  map: MapPoint[];
  evaluated: number;
  left_out: number;
  warnings: string[];
}

/** A place of the base: x, y, z [m] and yaw [rad] in the world, in which it stands at 0 now. */
export interface Place {
  at: [number, number, number];
  yaw: number;
  mount: Mount | null;
  /** The same in the frame of the present base. */
  pose: Matrix;
  energy: number | null;
  reason: Reason | null;
}

/** The pose of the present base in the world: turned so that gravity points down. */
export function worldOf(request: ApiRequest, robot: Robot): Matrix {
  const gravity = new Vector3(...gravityOf(request, robot)).normalize();
  if (gravity.length() < 0.5) return ofPose(null);
  const turn = new Quaternion().setFromUnitVectors(gravity, new Vector3(0, 0, -1));
  return ofPose({ position: [0, 0, 0], quaternion: turn.toArray() });
}

const UPRIGHT = 1e-6;

/** The angle of a base about the vertical [rad]: of its x axis, on a wall of its z axis. */
export function yawOf(T: Matrix): number {
  const axis = Math.hypot(T[2]!, T[6]!) < UPRIGHT ? 0 : 2;
  return Math.atan2(T[4 + axis]!, T[axis]!);
}

const within = (angle: number) => angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));

/** x, y, z and yaw of a place, from its pose in the frame of the present base. */
export function coordinatesOf(pose: Matrix, world: Matrix): Pick<Place, "at" | "yaw"> {
  const T = multiply(world, pose);
  return { at: positionOf(T), yaw: within(yawOf(T) - yawOf(world)) };
}

/** A pose moved to other coordinates; it stays tilted as it is. */
export function movedTo(pose: Matrix, world: Matrix, to: Pick<Place, "at" | "yaw">): Matrix {
  const T = multiply(world, pose);
  const turn = new Matrix4().makeRotationZ(to.yaw - coordinatesOf(pose, world).yaw);
  const next = multiply(turn.transpose().toArray(), T);
  to.at.forEach((value, axis) => (next[4 * axis + 3] = value));
  return multiply(inverse(world), next);
}

export const placesOf = (answer: PlacementAnswer, world: Matrix): Place[] =>
  answer.map.map(({ base, mount, energy, reason }) => {
    const pose = multiply(inverse(world), ofPose(base));
    return { ...coordinatesOf(pose, world), pose, mount, energy, reason };
  });

/** What is seen of a map: a height [m] and a mount, or the best of all (null). */
export interface Layer {
  height: number | null;
  mount: Mount | null;
}

const key = (value: number) => value.toFixed(6);

/** The different values of a coordinate, ascending. */
export const valuesOf = (places: Place[], axis: 0 | 1 | 2): number[] =>
  [...new Set(places.map(({ at }) => key(at[axis])))].map(Number).sort((a, b) => a - b);

/** Of the places above one another, the best; without an energy one that was left out. */
export function columnsOf(places: Place[], { height, mount }: Layer): Place[] {
  const best = new Map<string, Place>();
  const rank = ({ energy, reason }: Place) => energy ?? (reason ? Infinity : 1e300);
  for (const place of places) {
    if (height !== null && key(place.at[2]) !== key(height)) continue;
    if (mount !== null && place.mount !== mount) continue;
    const column = `${key(place.at[0])} ${key(place.at[1])}`;
    const known = best.get(column);
    if (!known || rank(place) < rank(known)) best.set(column, place);
  }
  return [...best.values()];
}

/** The distance between the columns along x and y [m]. */
export function pitchOf(columns: Place[]): [number, number] {
  const steps = ([0, 1] as const).map((axis) => {
    const values = valuesOf(columns, axis);
    return Math.min(...values.slice(1).map((value, k) => value - values[k]!));
  });
  const known = steps.filter(Number.isFinite);
  const usual = known.length ? Math.min(...known) : 0.1;
  return steps.map((step) => (Number.isFinite(step) ? step : usual)) as [number, number];
}

/** The least and the greatest energy of places [J]; null without any. */
export function energiesOf(places: Place[]): [number, number] | null {
  const known = places.flatMap(({ energy }) => (energy === null ? [] : [energy]));
  return known.length ? [Math.min(...known), Math.max(...known)] : null;
}

/** A place in words. */
export function placeName({ at: [x, y], energy, reason }: Place): string {
  const said = energy === null ? (reason ? REASONS[reason] : LEFT_OUT) : `${figure(energy)} J`;
  return `x ${shown(x, "mm")}, y ${shown(y, "mm")} mm: ${said}`;
}
