// Where the links of an arm are. Matrices are 4 x 4, row by row, in arrays of 16; lengths in m, angles in rad.
import { Euler, Matrix4, Quaternion, Vector3 } from "three";

/** A three.js matrix, row by row. */
const rows = (matrix) => matrix.transpose().toArray();

/** The matrix of x, y, z, roll, pitch, yaw about fixed axes. */
export const ofOrigin = ([x, y, z, ...angles]) => rows(new Matrix4().makeRotationFromEuler(new Euler(...angles, "ZYX")).setPosition(x, y, z));

/** The matrix of a pose: a position, and a quaternion, roll-pitch-yaw or rotation vector. */
export function ofPose(pose) {
  const { position = [0, 0, 0], quaternion = [0, 0, 0, 1], rpy, rotvec } = pose ?? {};
  if (rpy) return ofOrigin([...position, ...rpy]);
  const turn = new Quaternion(...quaternion).normalize();
  if (rotvec) turn.setFromAxisAngle(new Vector3(...rotvec).normalize(), Math.hypot(...rotvec));
  return rows(new Matrix4().compose(new Vector3(...position), turn, new Vector3(1, 1, 1)));
}

/** The unit quaternion [x, y, z, w] of a matrix's rotation. */
export const quaternionOf = (T) => new Quaternion().setFromRotationMatrix(new Matrix4().set(...T)).toArray();

export const multiply = (A, B) => rows(new Matrix4().set(...A).multiply(new Matrix4().set(...B)));

/** What is drawn of a request: the same with all obstacles in the base frame. ROS's `base_link` may stand elsewhere. */
export function cellOf(request, robot) {
  const T = ofOrigin(robot.kinematics.base_link_origin?.value ?? [0, 0, 0, 0, 0, 0]);
  const obstacles = (request.scene?.obstacles ?? []).map((obstacle) => {
    if (request.scene.frame !== "base_link") return obstacle;
    const pose = multiply(T, ofPose(obstacle.pose));
    return { ...obstacle, pose: { position: [pose[3], pose[7], pose[11]], quaternion: quaternionOf(pose) } };
  });
  return { ...request, scene: { obstacles } };
}

export const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/** The chain of a robot, from `GET /robots/{name}`. Joints turn about z. */
export class Chain {
  constructor(robot) {
    const { joint_origin, flange_origin } = robot.kinematics;
    this.placements = joint_origin.value.map(ofOrigin);
    this.flange = ofOrigin(flange_origin.value);
  }

  /** Matrices from the base to every link at joint positions q: base, one for each joint, flange. */
  frames(q) {
    const frames = [IDENTITY];
    this.placements.forEach((placement, joint) => {
      frames.push(multiply(multiply(frames[joint], placement), rows(new Matrix4().makeRotationZ(q[joint]))));
    });
    frames.push(multiply(frames.at(-1), this.flange));
    return frames;
  }

  /** The pose of the TCP at q; `tcp` is its pose at the flange. */
  tcp(q, tcp) {
    return multiply(this.frames(q).at(-1), ofPose(tcp));
  }
}

/** A row of samples at time t, linear between two of them; the first before the begin, the last after the end. */
export function sampleAt(times, rows, t) {
  const after = times.findIndex((time) => time > t);
  const high = after < 0 ? times.length - 1 : Math.max(1, after);
  const share = Math.max(0, Math.min(1, (t - times[high - 1]) / (times[high] - times[high - 1] || 1)));
  return rows[high - 1].map((value, joint) => value + share * (rows[high][joint] - value));
}
