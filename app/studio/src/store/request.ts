// What a request asks for, read tolerantly: JSON may hold values of any type.
import { rotvecOf, turnOf } from "./chain";
import { at, join, type Pointer } from "./pointer";
import type { ApiRequest, Obstacle, Pose, Stop } from "./types";

export type Kind = "move" | "cycle" | "path";

export interface Row {
  pointer: Pointer;
  role: "start" | "goal" | "stop" | "via";
  name: string;
  /** The pointer holds a pose itself, not a target. */
  bare: boolean;
}

export type Target =
  | { kind: "joints"; q: number[] }
  | { kind: "pose"; pose: Pose }
  | { kind: "empty" }
  | { kind: "other"; text: string };

export const DEFAULT_ROBOT = "ur5e";
/** Margin of an obstacle without one in the request [m]: the default of the service. */
export const DEFAULT_MARGIN = 0.005;

export const isObject = (value: unknown): value is Record<string, unknown> =>
  typeof value === "object" && value !== null && !Array.isArray(value);

export const listOf = <T>(value: unknown): T[] => (Array.isArray(value) ? (value as T[]) : []);

const areNumbers = (value: unknown, count?: number): value is number[] =>
  Array.isArray(value) &&
  value.every((each) => typeof each === "number") &&
  (count === undefined || value.length === count);

export function kindOf(request: ApiRequest): Kind {
  if (request.stops !== undefined) return "cycle";
  return isObject(request.path) ? "path" : "move";
}

export const robotName = (request: ApiRequest) =>
  typeof request.robot === "string" ? request.robot : DEFAULT_ROBOT;

export const endpointOf = (request: ApiRequest): "cycle" | "optimize" =>
  kindOf(request) === "cycle" ? "cycle" : "optimize";

/** Deadlines of the API where a request has none [s]; a test holds them to its schema. */
const DEADLINES = { optimize: 10, cycle: 60, long: 120 };
const LONG = 100; // stops of a cycle, above which its deadline is the long one

/** How long the service computes at most [s]. */
export function deadlineOf(asked: ApiRequest): number {
  if (typeof asked.deadline === "number") return asked.deadline;
  return DEADLINES[listOf(asked.stops).length > LONG ? "long" : endpointOf(asked)];
}

export const stopName = (stop: unknown, index: number): string =>
  isObject(stop) && typeof stop.name === "string" ? stop.name : `${index + 1}`;

/** The targets of a request in their order. */
export function rowsOf(request: ApiRequest): Row[] {
  const start: Row = { pointer: "/start", role: "start", name: "Start", bare: false };
  if (kindOf(request) === "cycle") {
    const stops = listOf<Stop>(request.stops).map((stop, k): Row => ({
      pointer: join("stops", k, "target"),
      role: "stop",
      name: stopName(stop, k),
      bare: false,
    }));
    return [start, ...stops];
  }
  const via = listOf<unknown>(at(request, "/path/via")).map((_, k): Row => ({
    pointer: join("path", "via", k),
    role: "via",
    name: `Via ${k + 1}`,
    bare: true,
  }));
  return [start, ...via, { pointer: "/goal", role: "goal", name: "Goal", bare: false }];
}

const isPose = (value: unknown): value is Pose =>
  isObject(value) &&
  areNumbers(value.position, 3) &&
  ["rotvec", "rpy"].every((key) => value[key] === undefined || areNumbers(value[key], 3)) &&
  (value.quaternion === undefined || areNumbers(value.quaternion, 4)) &&
  !("cone" in value) &&
  !("half_angle" in value);

/** What stands at a row. */
export function targetAt(request: ApiRequest, row: Row): Target {
  const value = at(request, row.pointer);
  if (value === undefined || value === null) {
    const stop = row.role === "stop" ? at(request, row.pointer.replace(/\/target$/, "")) : null;
    if (isObject(stop) && stop.path) return { kind: "other", text: "follows a path" };
    return { kind: "empty" };
  }
  if (row.bare) return isPose(value) ? { kind: "pose", pose: value } : other(value);
  if (!isObject(value)) return other(value);
  if (areNumbers(value.q)) return { kind: "joints", q: value.q };
  if (isPose(value.pose)) return { kind: "pose", pose: value.pose };
  if (Array.isArray(value.any_of))
    return { kind: "other", text: `one of ${value.any_of.length} targets` };
  return isObject(value.pose)
    ? { kind: "other", text: "a pose with free orientation" }
    : other(value);
}

const other = (value: unknown): Target => ({
  kind: "other",
  text: JSON.stringify(value).slice(0, 60),
});

/** Pointer to the pose of a row. */
export const poseAt = (row: Row): Pointer => (row.bare ? row.pointer : `${row.pointer}/pose`);

/** X, Y, Z [m] and RX, RY, RZ [rad] of a pose. */
export function sixOf(pose: Pose): number[] {
  return [...pose.position, ...(pose.rotvec ?? rotvecOf(turnOf(pose)))];
}

/**
 * A pose with another one of its six numbers. Its orientation keeps its form until it is edited.
 */
export function withNumber(pose: Pose, index: number, value: number): Pose {
  const six = sixOf(pose).map((old, k) => (k === index ? value : old));
  if (index < 3) return { ...pose, position: six.slice(0, 3) };
  return poseOfSix(six, pose);
}

export function poseOfSix(six: number[], before?: Pose): Pose {
  const frame = before?.frame ? { frame: before.frame } : {};
  return { position: six.slice(0, 3), rotvec: six.slice(3, 6), ...frame };
}

export const targetOf = (row: Row, pose: Pose): unknown => (row.bare ? pose : { pose });

const LARGEST = 10; // of a fixture in metres; CAD writes STL in millimetres

/** The likely unit [m] of a mesh file, whose format does not tell it, by the sides of its box. */
export const likelyUnit = (extent: number[]): number => (Math.max(...extent) > LARGEST ? 1e-3 : 1);

/** A name that none of the others has: the name itself, or the same with the next number. */
export function freshName(name: string, others: unknown[]): string {
  if (!others.includes(name)) return name;
  const stem = name.replace(/ ?\d+$/, "") || name;
  let number = name === stem ? 2 : 1;
  while (others.includes(`${stem} ${number}`)) number += 1;
  return `${stem} ${number}`;
}

/** What the request lacks before it can be sent; null if nothing. */
export function lackOf(request: ApiRequest): { pointer: Pointer; text: string } | null {
  if (kindOf(request) === "cycle" && !listOf(request.stops).length)
    return { pointer: "/stops", text: "Add a stop: a cycle needs at least one." };
  for (const row of rowsOf(request))
    if (targetAt(request, row).kind === "empty")
      return { pointer: row.pointer, text: `${row.name} is empty: type, paste or take a pose.` };
  return null;
}

export const obstaclesListed = (request: ApiRequest): Obstacle[] =>
  listOf<Obstacle>(at(request, "/scene/obstacles")).map((each) =>
    isObject(each) ? (each as Obstacle) : { name: "?", shape: "?" },
  );
