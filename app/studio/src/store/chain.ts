// Where the links of an arm are. Matrices are 4 x 4, row by row, in arrays of 16; lengths in m,
// angles in rad.
import { Euler, Matrix4, Quaternion, Vector3 } from "three";
import type { ApiRequest, Obstacle, Pose, Robot } from "./types";

export type Matrix = number[];
type Six = [number, number, number, number, number, number];

export const IDENTITY: Matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/** A three.js matrix, row by row. */
const rows = (matrix: Matrix4): Matrix => matrix.transpose().toArray();

const ofRows = (T: Matrix) => new Matrix4().fromArray(T).transpose();

/** The matrix of x, y, z, roll, pitch, yaw about fixed axes. */
export function ofOrigin(origin: number[]): Matrix {
  const [x, y, z, roll, pitch, yaw] = origin as Six;
  const turn = new Matrix4().makeRotationFromEuler(new Euler(roll, pitch, yaw, "ZYX"));
  return rows(turn.setPosition(x, y, z));
}

/** The turn of a pose: its quaternion, roll-pitch-yaw or rotation vector. */
export function turnOf(pose: Partial<Pose> | null | undefined): Quaternion {
  const { quaternion = [0, 0, 0, 1], rpy, rotvec } = pose ?? {};
  if (rpy) return new Quaternion().setFromEuler(new Euler(rpy[0], rpy[1], rpy[2], "ZYX"));
  if (rotvec) {
    const axis = new Vector3().fromArray(rotvec);
    return new Quaternion().setFromAxisAngle(axis.clone().normalize(), axis.length());
  }
  return new Quaternion().fromArray(quaternion).normalize();
}

/** The matrix of a pose. */
export function ofPose(pose: Partial<Pose> | null | undefined): Matrix {
  const position = new Vector3().fromArray(pose?.position ?? [0, 0, 0]);
  return rows(new Matrix4().compose(position, turnOf(pose), new Vector3(1, 1, 1)));
}

/** The unit quaternion [x, y, z, w] of a matrix's rotation. */
export const quaternionOf = (T: Matrix): number[] =>
  new Quaternion().setFromRotationMatrix(ofRows(T)).toArray();

export const positionOf = (T: Matrix): [number, number, number] => [T[3]!, T[7]!, T[11]!];

/** The rotation vector of a turn, at most half a turn long. */
export function rotvecOf(turn: Quaternion): number[] {
  const { x, y, z, w } = turn.w < 0 ? turn.clone().set(-turn.x, -turn.y, -turn.z, -turn.w) : turn;
  const sine = Math.hypot(x, y, z);
  if (sine < 1e-12) return [0, 0, 0];
  const angle = 2 * Math.atan2(sine, w);
  return [x, y, z].map((part) => (part * angle) / sine);
}

export const multiply = (A: Matrix, B: Matrix): Matrix => rows(ofRows(A).multiply(ofRows(B)));

export const inverse = (T: Matrix): Matrix => rows(ofRows(T).invert());

/** The pose of a matrix, with a rotation vector as on the pendant. */
export const poseOfMatrix = (T: Matrix): Pose => ({
  position: positionOf(T),
  rotvec: rotvecOf(new Quaternion().setFromRotationMatrix(ofRows(T))),
});

/** The frame of ROS's `base_link`, or of the base, in the base frame. */
export function frameOf(robot: Robot, frame: unknown): Matrix {
  const origin = robot.kinematics.base_link_origin?.value as number[] | undefined;
  return frame === "base_link" && origin ? ofOrigin(origin) : IDENTITY;
}

/** The obstacles of a request, in the base frame. Throws where the request is of wrong types. */
export function obstaclesOf(request: ApiRequest, robot: Robot): Obstacle[] {
  const T = frameOf(robot, request.scene?.frame);
  return (request.scene?.obstacles ?? []).map((obstacle) => {
    if (request.scene?.frame !== "base_link") return obstacle;
    const pose = multiply(T, ofPose(obstacle.pose));
    return { ...obstacle, pose: { position: positionOf(pose), quaternion: quaternionOf(pose) } };
  });
}

/** The chain of a robot, from `GET /robots/{name}`. Joints turn about z. */
export class Chain {
  private readonly placements: Matrix[];
  private readonly flange: Matrix;
  /** For every joint that turns: place of the joint that it follows, multiplier, offset. */
  private readonly coupling: [number, number, number][] | undefined;

  constructor(robot: Robot) {
    this.coupling = robot.kinematics.coupling?.value as [number, number, number][] | undefined;
    this.placements = (robot.kinematics.joint_origin!.value as number[][]).map(ofOrigin);
    this.flange = ofOrigin(robot.kinematics.flange_origin!.value as number[]);
  }

  /**
   * Matrices from the base to every link at joint positions q: base, one for each joint, flange.
   */
  frames(q: number[]): Matrix[] {
    const frames = [IDENTITY];
    const angles = this.angles(q);
    this.placements.forEach((placement, joint) => {
      const turn = rows(new Matrix4().makeRotationZ(angles[joint] ?? 0));
      frames.push(multiply(multiply(frames[joint]!, placement), turn));
    });
    frames.push(multiply(frames.at(-1)!, this.flange));
    return frames;
  }

  /** Angles of all joints that turn: of those with positions q, and of those that follow them. */
  private angles(q: number[]): number[] {
    const { coupling } = this;
    if (!coupling) return q;
    let count = 0;
    const number = coupling.map(([leader], place) => (leader === place ? count++ : -1));
    return coupling.map(([leader, factor, offset]) => factor * (q[number[leader]!] ?? 0) + offset);
  }

  /** The pose of the TCP at q; `tcp` is its pose at the flange. */
  tcp(q: number[], tcp: Partial<Pose> | undefined): Matrix {
    return multiply(this.frames(q).at(-1)!, ofPose(tcp));
  }
}

/**
 * A row of samples at time t, linear between two of them; the first before the begin, the last
 * after the end.
 */
export function sampleAt(times: number[], samples: number[][], t: number): number[] {
  const after = times.findIndex((time) => time > t);
  const high = after < 0 ? times.length - 1 : Math.max(1, after);
  const [from, to] = [times[high - 1]!, times[high]!];
  const share = Math.max(0, Math.min(1, (t - from) / (to - from || 1)));
  const next = samples[high]!;
  return samples[high - 1]!.map((value, joint) => value + share * (next[joint]! - value));
}
