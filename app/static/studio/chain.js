// Where the links of an arm are. Matrices are 4 x 4, row by row, in arrays of 16; lengths in m, angles in rad.

/** The matrix of x, y, z, roll, pitch, yaw about fixed axes. */
export function ofOrigin([x, y, z, roll, pitch, yaw]) {
  const [cr, sr, cp, sp, cy, sy] = [roll, pitch, yaw].flatMap((angle) => [Math.cos(angle), Math.sin(angle)]);
  return [
    cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, x,
    sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, y,
    -sp, cp * sr, cp * cr, z,
    0, 0, 0, 1,
  ];
}

/** The matrix of a pose: a position, and a quaternion, roll-pitch-yaw or rotation vector. */
export function ofPose(pose) {
  const { position = [0, 0, 0], quaternion, rpy, rotvec } = pose ?? {};
  if (rpy) return ofOrigin([...position, ...rpy]);
  let [x, y, z, w] = quaternion ?? [0, 0, 0, 1];
  if (rotvec) {
    const angle = Math.hypot(...rotvec);
    const share = angle > 1e-12 ? Math.sin(angle / 2) / angle : 0.5;
    [x, y, z, w] = [...rotvec.map((part) => part * share), Math.cos(angle / 2)];
  }
  const norm = Math.hypot(x, y, z, w) || 1;
  [x, y, z, w] = [x / norm, y / norm, z / norm, w / norm];
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), position[0],
    2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), position[1],
    2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), position[2],
    0, 0, 0, 1,
  ];
}

/** The unit quaternion [x, y, z, w] of a matrix's rotation. */
export function quaternionOf(T) {
  const [xx, xy, xz, , yx, yy, yz, , zx, zy, zz] = T;
  const w = Math.sqrt(Math.max(0, 1 + xx + yy + zz)) / 2;
  const x = Math.sign(zy - yz || 1) * Math.sqrt(Math.max(0, 1 + xx - yy - zz)) / 2;
  const y = Math.sign(xz - zx || 1) * Math.sqrt(Math.max(0, 1 - xx + yy - zz)) / 2;
  const z = Math.sign(yx - xy || 1) * Math.sqrt(Math.max(0, 1 - xx - yy + zz)) / 2;
  const norm = Math.hypot(x, y, z, w) || 1;
  return [x / norm, y / norm, z / norm, w / norm];
}

export function multiply(A, B) {
  const C = new Array(16);
  for (let i = 0; i < 4; i++)
    for (let j = 0; j < 4; j++)
      C[4 * i + j] = A[4 * i] * B[j] + A[4 * i + 1] * B[4 + j] + A[4 * i + 2] * B[8 + j] + A[4 * i + 3] * B[12 + j];
  return C;
}

/** A point [x, y, z] moved by a matrix. */
export const moved = (T, [x, y, z]) => [0, 4, 8].map((row) => T[row] * x + T[row + 1] * y + T[row + 2] * z + T[row + 3]);

/** A direction [x, y, z] turned by a matrix. */
export const turned = (T, [x, y, z]) => [0, 4, 8].map((row) => T[row] * x + T[row + 1] * y + T[row + 2] * z);

/** The inverse of a rigid motion. */
export function inverse(T) {
  const R = [T[0], T[4], T[8], 0, T[1], T[5], T[9], 0, T[2], T[6], T[10], 0, 0, 0, 0, 1];
  const [x, y, z] = turned(R, [T[3], T[7], T[11]]);
  [R[3], R[7], R[11]] = [-x, -y, -z];
  return R;
}

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
      const [c, s] = [Math.cos(q[joint]), Math.sin(q[joint])];
      const turn = [c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
      frames.push(multiply(multiply(frames[joint], placement), turn));
    });
    frames.push(multiply(frames.at(-1), this.flange));
    return frames;
  }

  /** The pose of the TCP at q; `tcp` is its pose at the flange. */
  tcp(q, tcp) {
    return multiply(this.frames(q).at(-1), ofPose(tcp));
  }
}

/** A row of samples at time t, linear between two of them; the last one after the end. */
export function sampleAt(times, rows, t) {
  if (t <= times[0]) return rows[0];
  let [low, high] = [0, times.length - 1];
  if (t >= times[high]) return rows[high];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle;
  }
  const share = (t - times[low]) / (times[high] - times[low]);
  const [a, b] = [rows[low], rows[high]];
  return Array.isArray(a) ? a.map((value, joint) => value + share * (b[joint] - value)) : a + share * (b - a);
}
