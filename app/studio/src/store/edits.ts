// Changes of a request that are more than one field: kinds, stops and their order, obstacles.
import { at, join, put, type Pointer } from "./pointer";
import { freshName, isObject, listOf, rowsOf, targetAt, targetOf } from "./request";
import type { Kind, Row } from "./request";
import type { ApiRequest, Obstacle, Pose, Robot, Stop } from "./types";

// fields of one kind of request that the other kind lacks; `windings` has another meaning in it
const OF_MOVES = ["goal", "path", "duration", "dwell", "bound", "windings"];
const OF_CYCLES = "stops order before together closed time hold wait windings".split(" ");

const without = (request: ApiRequest, fields: string[]): ApiRequest =>
  Object.fromEntries(Object.entries(request).filter(([name]) => !fields.includes(name)));

/** The same cell as a request of another kind: its first and last targets stay. */
export function asKind(request: ApiRequest, kind: Kind): ApiRequest {
  if (kind === "cycle") {
    if (request.stops) return request;
    // the branches of a move hold at both ends, those of a cycle at its start alone
    const branch = isObject(request.branch) ? { branch: request.branch } : {};
    const via = listOf<Pose>(at(request, "/path/via")).map((pose, k): Stop => ({
      name: `via ${k + 1}`,
      target: { pose },
      ...branch,
    }));
    const goal: Stop = { name: "goal", target: request.goal ?? null, ...branch };
    return { ...without(request, OF_MOVES), stops: [...via, goal] };
  }
  const last = listOf<Stop>(request.stops)
    .filter((stop) => isObject(stop) && stop.target)
    .at(-1)?.target;
  const goal = request.stops ? last : request.goal;
  const rest = without(request, request.stops ? OF_CYCLES : ["path"]);
  const move: ApiRequest = goal === undefined ? rest : { ...rest, goal };
  return kind === "path" ? { ...move, path: isObject(request.path) ? request.path : {} } : move;
}

/** The fields of a request that belong to its kind. */
export function ownFields(request: ApiRequest): ApiRequest {
  const fields = request.stops ? OF_CYCLES : OF_MOVES;
  return Object.fromEntries(Object.entries(request).filter(([name]) => fields.includes(name)));
}

/**
 * The same cell as a request of a kind that it had before: the fields of then come back, and the
 * last target is that of now.
 */
export function asKindAgain(request: ApiRequest, kind: Kind, before: ApiRequest): ApiRequest {
  const made = asKind(request, kind);
  const { path } = before;
  if (kind !== "cycle")
    return { ...(request.stops ? before : {}), ...made, ...(path ? { path } : {}) };
  const stops = [...listOf<Stop>(before.stops)];
  const last = stops.findLastIndex((stop) => isObject(stop) && stop.target);
  if (last >= 0 && request.goal) stops[last] = { ...stops[last]!, target: request.goal };
  return { ...made, ...before, stops };
}

/**
 * The request for another robot, without the figures of one arm. Joint positions stay if they are
 * the user's own and within the limits; otherwise they become those of the robot's example move.
 */
export function withRobot(request: ApiRequest, robot: Robot, before: Robot | null): ApiRequest {
  const own = put(put(request, "/robot", robot.name), "/figures", undefined);
  return rowsOf(own).reduce((next, row) => {
    const target = targetAt(own, row);
    if (target.kind !== "joints") return next;
    if (isWithin(robot, target.q) && !isExample(before, target.q)) return next;
    const end = row.role === "goal" ? "goal" : "start";
    return put(next, row.pointer, { q: robot.example_move?.[end] ?? middleOf(robot) });
  }, own);
}

const isExample = (robot: Robot | null, q: number[]) =>
  Object.values(robot?.example_move ?? {}).some((end) => isEqual(end, q));

const isEqual = (one: number[], other: number[]) =>
  one.length === other.length && one.every((value, k) => value === other[k]);

const limitsOf = ({ joints, limits }: Robot): [number, number][] => {
  const of = (name: string, joint: number) => (limits[name]?.value as number[])[joint] ?? 0;
  return joints.map((_, joint) => [of("position_min", joint), of("position_max", joint)]);
};

const isWithin = (robot: Robot, q: number[]) =>
  q.length === robot.joints.length &&
  limitsOf(robot).every(([low, high], k) => low <= q[k]! && q[k]! <= high);

const middleOf = (robot: Robot) => limitsOf(robot).map(([low, high]) => (low + high) / 2);

/**
 * The request with a largest speed of the TCP along its path [m/s]; a held one is the least speed,
 * too, and keeps its ramps.
 */
export function withSpeed(request: ApiRequest, most: number | undefined, held: boolean) {
  const given = at(request, "/path/speed");
  const speed = held ? { ...(isObject(given) ? given : {}), min: most, max: most } : most;
  return put(request, "/path/speed", speed);
}

const namesOf = (stops: Stop[]) => stops.map((stop, k) => stop?.name ?? `${k + 1}`);

/**
 * The request with one more stop at its end; a move becomes a cycle, a path has one more pose on
 * its way.
 */
export function withStop(request: ApiRequest, target: unknown = null, name = "stop 1"): ApiRequest {
  const cycle = asKind(request, "cycle");
  const stops = listOf<Stop>(cycle.stops);
  return { ...cycle, stops: [...stops, { name: freshName(name, namesOf(stops)), target }] };
}

export function withVia(request: ApiRequest, pose: Pose): ApiRequest {
  return put(request, "/path/via", [...listOf(at(request, "/path/via")), pose]);
}

/** Pointer and index of the list entry that a row is. */
export function entryOf(row: Row): { list: Pointer; index: number } | null {
  const found = /^(\/stops|\/path\/via)\/(\d+)/.exec(row.pointer);
  return found ? { list: found[1]!, index: Number(found[2]) } : null;
}

function relisted(
  request: ApiRequest,
  row: Row,
  change: (items: unknown[], index: number) => unknown[],
): ApiRequest {
  const entry = entryOf(row);
  if (!entry) return request;
  return put(
    request,
    entry.list,
    change([...listOf<unknown>(at(request, entry.list))], entry.index),
  );
}

export const withoutRow = (request: ApiRequest, row: Row) =>
  relisted(request, row, (items, index) => items.filter((_, k) => k !== index));

/** The row once more behind itself, under a name of its own. */
export const duplicated = (request: ApiRequest, row: Row) =>
  relisted(request, row, (items, index) => {
    const copy = structuredClone(items[index]);
    if (isObject(copy) && row.role === "stop")
      copy.name = freshName(row.name, namesOf(items as Stop[]));
    return [...items.slice(0, index + 1), copy, ...items.slice(index + 1)];
  });

/** The row `steps` places further; unchanged where there is no such place. */
export const moved = (request: ApiRequest, row: Row, steps: number) =>
  relisted(request, row, (items, index) => {
    const to = index + steps;
    if (to < 0 || to >= items.length) return items;
    const [item] = items.splice(index, 1);
    items.splice(to, 0, item);
    return items;
  });

export const withTarget = (
  request: ApiRequest,
  row: Row,
  target: { pose: Pose } | { q: number[] },
) => put(request, row.pointer, "pose" in target ? targetOf(row, target.pose) : target);

export const OBSTACLES = {
  box: { shape: "box", size: [0.2, 0.2, 0.2] },
  cylinder: { shape: "cylinder", radius: 0.05, length: 0.3 },
  sphere: { shape: "sphere", radius: 0.1 },
  half_space: { shape: "half_space" },
} as const;

/** The request with one more obstacle. */
export function withObstacle(
  request: ApiRequest,
  shape: Omit<Obstacle, "name">,
  name: string,
): ApiRequest {
  const others = listOf<Obstacle>(at(request, "/scene/obstacles"));
  const own: Obstacle = {
    ...shape,
    name: freshName(
      name,
      others.map((each) => each?.name),
    ),
  } as Obstacle;
  return put(request, "/scene", { ...request.scene, obstacles: [...others, own] });
}

export function withoutObstacle(request: ApiRequest, index: number): ApiRequest {
  return put(request, join("scene", "obstacles", index), undefined);
}
