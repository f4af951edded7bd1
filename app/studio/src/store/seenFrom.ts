// A task as it is seen from another place of the robot's base.
import {
  frameOf,
  inverse,
  multiply,
  ofPose,
  poseOfMatrix,
  quaternionOf,
  type Matrix,
} from "./chain";
import { isObject, listOf } from "./request";
import type { ApiRequest, Pose, Robot } from "./types";

type Fields = Record<string, unknown>;

const SAME = 1e-12; // sine of a turn, or change of gravity [m/s²], that is none
const TIDY = 1e12; // so that 50 mm stay 50 mm beside a rounding error

const tidy = (value: number) => Math.round(value * TIDY) / TIDY || 0;
const EARTH = [0, 0, -9.81];

/** Gravity in the frame of the base [m/s²]. */
export const gravityOf = (request: ApiRequest, robot: Robot): number[] =>
  listOf<number>(request.gravity ?? robot.kinematics.gravity?.value ?? EARTH);

/** A direction in the axes of a matrix, seen from the frame that the matrix leads to. */
export const turned = (T: Matrix, [x = 0, y = 0, z = 0]: number[]): number[] =>
  [0, 4, 8].map((row) => tidy(T[row]! * x + T[row + 1]! * y + T[row + 2]! * z));

/**
 * The request from a base that stands at `place`, a pose in the frame of the present base. Poses,
 * obstacles, directions and gravity are in the frame of the base there; joint positions stay.
 * Throws Error where a pose is in a form that it does not know.
 */
export function seenFrom(request: ApiRequest, place: Matrix, robot: Robot): ApiRequest {
  const back = inverse(place);
  const into = (frame: unknown) => multiply(back, frameOf(robot, frame));
  const next: ApiRequest = { ...request };
  for (const end of ["start", "goal"] as const)
    if (isObject(request[end])) next[end] = target(request[end], into);
  if (request.stops)
    next.stops = request.stops.map((stop) => ({
      ...stop,
      ...(isObject(stop.target) ? { target: target(stop.target, into) } : {}),
      ...(isObject(stop.path) ? { path: path(stop.path, into) } : {}),
      ...Object.fromEntries(
        ["approach", "retreat"]
          .filter((name) => isObject(stop[name]))
          .map((name) => {
            const line = stop[name] as Fields;
            return [name, (line.frame ?? "tcp") === "tcp" ? line : directed(line, into)];
          }),
      ),
    }));
  if (isObject(request.path)) next.path = path(request.path, into);
  if (request.scene?.obstacles) {
    const { frame, ...scene } = request.scene;
    const obstacles = request.scene.obstacles.map((each) => ({
      ...each,
      pose: posed({ ...each.pose }, into(frame)) as unknown as Pose,
    }));
    next.scene = { ...scene, obstacles };
  }
  if (isObject(request.tool_cone)) next.tool_cone = directed(request.tool_cone, into);
  const gravity = gravityOf(request, robot);
  const felt = turned(back, gravity);
  if (felt.some((part, axis) => Math.abs(part - gravity[axis]!) > SAME)) next.gravity = felt;
  return next;
}

type Into = (frame: unknown) => Matrix;

function target(given: Fields, into: Into): Fields {
  if (isObject(given.pose)) return { ...given, pose: inFrame(given.pose, into) };
  if (Array.isArray(given.any_of))
    return { ...given, any_of: given.any_of.map((each: Fields) => target(each, into)) };
  return given;
}

const path = (given: Fields, into: Into): Fields => ({
  ...given,
  ...Object.fromEntries(
    ["via", "points"]
      .filter((name) => Array.isArray(given[name]))
      .map((name) => [name, (given[name] as Fields[]).map((each) => inFrame(each, into))]),
  ),
});

function directed({ frame, ...given }: Fields, into: Into): Fields {
  const direction = turned(into(frame), listOf(given.direction));
  return { ...given, direction, ...(frame === "base" ? { frame } : {}) };
}

const inFrame = ({ frame, ...pose }: Fields, into: Into): Fields => posed(pose, into(frame));

/** A pose moved by a matrix. What is not turned keeps the form of its orientation. */
function posed(given: Fields, T: Matrix): Fields {
  const { position = [0, 0, 0], orientation, quaternion, rpy, rotvec, ...others } = given;
  if (!Array.isArray(position) || "pose" in given)
    throw new Error(
      "A pose has the form of ROS: give position and rotvec, so that the base can be moved.",
    );
  const own = { quaternion, rpy, rotvec } as Partial<Pose>;
  const { rotvec: turn, ...at } = poseOfMatrix(multiply(T, ofPose({ position, ...own })));
  const moved = { position: at.position.map(tidy), rotvec: turn!.map(tidy) };
  if (orientation !== undefined)
    return { ...others, position: moved.position, orientation: partlyFree(orientation, T) };
  const still = Math.hypot(...turnOf(T)) < SAME;
  return still ? { ...given, position: moved.position } : { ...others, ...moved };
}

/** The vector part of the quaternion of a turn. */
const turnOf = (T: Matrix) => quaternionOf(T).slice(0, 3);

function partlyFree(orientation: unknown, T: Matrix): unknown {
  if (!isObject(orientation)) return orientation;
  if (isObject(orientation.cone))
    return {
      cone: { ...orientation.cone, direction: turned(T, listOf(orientation.cone.direction)) },
    };
  const { quaternion, rpy, rotvec, ...free } = orientation;
  const given = ofPose({ quaternion, rpy, rotvec } as Partial<Pose>);
  return { ...free, rotvec: poseOfMatrix(multiply(T, given)).rotvec };
}
