// What the service takes and answers, as far as the page reads it. Lengths in m, angles in rad,
// energies in J.

export interface Pose {
  position: number[];
  quaternion?: number[];
  rpy?: number[];
  rotvec?: number[];
  frame?: "base" | "base_link";
}

export interface Shape {
  shape: string;
  pose?: Pose;
  size?: number[] | number;
  radius?: number;
  length?: number;
  [field: string]: unknown;
}

export interface Obstacle extends Shape {
  name: string;
  margin?: number;
}

export interface Payload {
  mass: number;
  com?: number[] | null;
  inertia?: number[] | null;
  shape?: Shape | null;
  touches?: string[] | null;
}

export interface Tool {
  capsules?: { start: number[]; end: number[]; radius: number }[];
}

export interface Stop {
  name?: string | null;
  target?: unknown;
  path?: unknown;
  via?: boolean;
  dwell?: number;
  payload?: Payload | null;
  [field: string]: unknown;
}

/** The body of `POST /optimize` or `POST /cycle` as it is edited; JSON may hold anything. */
export interface ApiRequest {
  robot?: string;
  start?: unknown;
  goal?: unknown;
  stops?: Stop[];
  path?: Record<string, unknown> | null;
  tcp?: Pose;
  tool?: Tool | string;
  payload?: Payload | null;
  scene?: { obstacles?: Obstacle[]; frame?: string };
  figures?: string | null;
  [field: string]: unknown;
}

export interface Interval {
  p5: number;
  p95: number;
  sd: number;
}

export type Electrical = Record<string, number> & { total: number; interval?: Interval | null };

export interface Energy {
  electrical: Electrical;
  mechanical: { total: number };
  peak_power: number;
  mean_power: number;
  lower_bound: number;
}

export interface Trajectory {
  t: number[];
  q: number[][];
  v: number[][];
  a: number[][];
  tau: number[][];
  tau_motor: number[][];
  power: number[];
}

export interface Clearance {
  min_clearance: number;
  sampled: number;
  pair: string[];
  time: number;
  points: number[][] | null;
  leg?: number;
}

export interface Certificate {
  worst_ratio: Record<string, number | null>;
  goal_error: { position: number; rotation: number };
  clearance: Clearance | null;
}

export interface Baseline {
  name: string;
  duration: number;
  electrical: number;
  mechanical: number;
  within_limits: boolean;
  reason?: string | null;
  /** Of a cycle: its moves that break limits. */
  broken?: { start: string; goal: string; reason: string }[];
  saving: number | null;
  saving_interval: Interval | null;
}

export interface Candidate {
  start: string;
  goal: string;
  q_start: number[];
  q_goal: number[];
  status: string;
  reason: string;
  lower_bound: number | null;
  energy: number | null;
  duration: number | null;
  refined: boolean | null;
}

export interface Configuration {
  label: string;
  q: number[];
  stop?: string;
}

export interface LimitsInForce {
  position_min: number[];
  position_max: number[];
  velocity: number[];
  acceleration: number[];
  jerk: (number | null)[];
  torque: number[];
}

/** An answer of `POST /optimize`, or one of `POST /cycle` joined to a single motion. */
export interface Solution {
  id: string | null;
  answer: string | null;
  robot: string;
  arm: ApiRequest | null;
  objective: "electrical" | "mechanical";
  duration: number;
  status: string;
  branch: { start: Configuration; goal: Configuration };
  trajectory: Trajectory;
  energy: Energy;
  limits: LimitsInForce;
  baselines: Baseline[];
  candidates: Candidate[];
  candidate_counts: Record<string, number>;
  certificate: Certificate;
  warnings: string[];
}

export interface Leg {
  kind: "move" | "line" | "path" | "dwell" | "wait";
  start: Configuration;
  goal: Configuration;
  passes?: Configuration[];
  t0: number;
  duration: number;
  electrical: number;
  mechanical: number;
  lower_bound: number;
  payload_mass: number;
  answer: string | null;
}

export interface Cycle {
  id: string | null;
  answer: string | null;
  robot: string;
  objective: "electrical" | "mechanical";
  duration: number;
  status: string;
  energy: Energy;
  legs: Leg[];
  baselines: Baseline[];
  certificate: Certificate;
  warnings: string[];
  order: string[];
}

export interface Parameter {
  value: unknown;
  unit: string;
  source: string;
  trust: string;
  note: string;
}

export interface FormBody {
  kind: "tube" | "housing" | "cap" | "ring" | "foot";
  start: number[];
  end: number[];
  radius: number;
}

export interface Robot {
  name: string;
  title: string;
  joints: string[];
  energy_trust: string;
  trust: Record<string, string>;
  kinematics: Record<string, Parameter>;
  limits: Record<string, Parameter>;
  collision: Record<string, Parameter>;
  drives: Record<string, Parameter>;
  electronics: Record<string, Parameter>;
  friction: { laws: { coefficients: Record<string, Parameter> }[] };
  form: FormBody[][];
  example_move: { start: number[]; goal: number[] } | null;
  has_meshes: boolean;
  warnings: string[];
}

export interface IkSolution {
  label: string;
  q: number[];
  collides: boolean;
  nearest: { pair: string[]; distance: number } | null;
}

/** A problem document of the service (RFC 9457). */
export interface ProblemDetails {
  type?: string;
  title?: string;
  status?: number;
  detail?: string;
  /** The place at fault: `start`, `goal`, `path`, `stops/` and a name, or a field of the request. */
  target?: string;
  stop?: string;
  path?: string;
  /** Two bodies that are too near. */
  pair?: [string, string];
  retry?: number | null;
  errors?: { loc: (string | number)[]; msg: string }[];
}
