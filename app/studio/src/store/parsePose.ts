// Reads what is pasted as a pose or as joint positions. What can be meant in two ways is asked,
// never guessed.
import { Euler, Quaternion } from "three";
import { rotvecOf } from "./chain";

export interface Reading {
  kind: "pose" | "joints";
  /** X, Y, Z [m], RX, RY, RZ [rad]; or joint positions [rad]. */
  values: number[];
  /** How the text was understood, in words. */
  echo: string;
}

export type Parsed = { readings: Reading[] } | { why: string };

const DEGREE = Math.PI / 180;
const TURN = 2 * Math.PI + 0.01;
/** Distance from the base within which a TCP may be [m]. */
const NEAREST = 0.02;
const FARTHEST = 4;
const NUMBER = /[+\-−]?(?:\d+(?:[.]\d*)?|[.]\d+)(?:e[+-]?\d+)?/gi;
const LABEL =
  /\b(?:r[xyz]|[xyz]|rpy|roll|pitch|yaw|j\d|q\d|joint ?\d|base|shoulder|elbow|wrist ?\d)\b\s*[:=]?/gi;

const LENGTHS = [
  { inMetre: 1000, name: "mm" },
  { inMetre: 1, name: "m" },
];

/**
 * Every way in which a text can be read for an arm of so many joints; `prefer` is the kind of the
 * row it goes to.
 */
export function parsePose(text: string, joints = 6, prefer?: Reading["kind"]): Parsed {
  const numbers = numbersOf(text);
  if (!numbers.length)
    return { why: "No number was found: paste p[…], six numbers or joint positions." };
  const asPose = /\bp\s*\[/i.test(text) || /\br[xyz]\b|\bx\b|\brpy\b|\broll\b/i.test(text);
  const asJoints = /\b(?:j|q|joint ?)1\b|\bbase\b|\bshoulder\b|\bmovej\s*\(\s*\[/i.test(text);
  const poses = asJoints || numbers.length !== 6 ? [] : posesOf(text, numbers);
  const angles = asPose || numbers.length !== joints ? [] : jointsOf(text, numbers, joints);
  const readings = choose(poses, angles, prefer);
  if (readings.length) return { readings };
  if (numbers.length !== 6 && numbers.length !== joints)
    return {
      why: `Numbers found: ${numbers.length}. A pose has 6, this arm has ${joints} joints.`,
    };
  return { why: farAway(numbers) };
}

function choose(poses: Reading[], joints: Reading[], prefer?: Reading["kind"]): Reading[] {
  if (prefer === "pose" && poses.length) return poses;
  if (prefer === "joints" && joints.length) return joints;
  return [...poses, ...joints];
}

function farAway(numbers: number[]): string {
  const away = Math.hypot(...numbers.slice(0, 3)) / 1000;
  return `As a pose in mm this is ${away.toFixed(1)} m away from the base: check the units.`;
}

function numbersOf(text: string): number[] {
  // the digits of labels are no values
  const plain = text.replace(LABEL, " ");
  // where blanks or semicolons separate values, a comma between digits is a decimal sign
  const decimal = !plain.includes(".") && /\d,\d/.test(plain) && !/\d,\d+,/.test(plain);
  const read = decimal ? plain.replace(/(\d),(\d)/g, "$1.$2") : plain;
  return [...read.matchAll(NUMBER)]
    .map(([each]) => Number(each.replace("−", "-")))
    .filter(Number.isFinite);
}

function posesOf(text: string, numbers: number[]): Reading[] {
  const script = /\bp\s*\[/i.test(text);
  const given = LENGTHS.filter(({ name }) => new RegExp(`(?<![a-z])${name}(?![a-z])`).test(text));
  const away = Math.hypot(...numbers.slice(0, 3));
  const near = (given.length ? given : LENGTHS).filter(({ inMetre }) => {
    const distance = away / inMetre;
    return given.length === 1 || (distance >= NEAREST && distance <= FARTHEST);
  });
  return near.flatMap((length) =>
    turnsOf(text, numbers.slice(3), script).map(({ rotvec, name }): Reading => ({
      kind: "pose",
      values: [...numbers.slice(0, 3).map((value) => value / length.inMetre), ...rotvec],
      echo: `pose in ${length.name}${name ? ` and ${name}` : ""}`,
    })),
  );
}

/** The ways to read three numbers as an orientation. */
function turnsOf(
  text: string,
  turn: number[],
  script: boolean,
): { rotvec: number[]; name: string }[] {
  const radians = { rotvec: turn, name: "RX RY RZ in rad" };
  const vector = { rotvec: turn.map((value) => value * DEGREE), name: "RX RY RZ in degrees" };
  const rpy = { rotvec: ofRpy(turn), name: "roll, pitch, yaw in degrees" };
  if (turn.every((value) => value === 0)) return [{ ...radians, name: "" }];
  const small = turn.every((value) => Math.abs(value) <= TURN);
  if (script) return [radians];
  const degrees = /\brpy\b|\broll\b/i.test(text)
    ? [rpy]
    : same(rpy.rotvec, vector.rotvec)
      ? [vector]
      : [vector, rpy];
  if (/°|\bdeg/.test(text)) return degrees;
  if (/\brad\b/.test(text)) return [radians];
  return small ? [radians, vector] : degrees;
}

const ofRpy = (turn: number[]) => {
  const [roll = 0, pitch = 0, yaw = 0] = turn.map((value) => value * DEGREE);
  return rotvecOf(new Quaternion().setFromEuler(new Euler(roll, pitch, yaw, "ZYX")));
};

const same = (a: number[], b: number[]) => a.every((value, k) => Math.abs(value - b[k]!) < 1e-9);

function jointsOf(text: string, numbers: number[], joints: number): Reading[] {
  const values = numbers.slice(0, joints);
  const radians: Reading = { kind: "joints", values, echo: "joints in rad" };
  const degrees: Reading = {
    kind: "joints",
    values: values.map((value) => value * DEGREE),
    echo: "joints in degrees",
  };
  if (/°|\bdeg/.test(text)) return [degrees];
  if (/\brad\b/.test(text) || /\bmovej\s*\(/i.test(text)) return [radians];
  if (values.some((value) => Math.abs(value) > 400)) return [];
  if (values.some((value) => Math.abs(value) > TURN)) return [degrees];
  return [radians, degrees];
}

export interface TableRow {
  name: string | null;
  text: string;
}

/**
 * The rows of a pasted table (CSV, tab or semicolon separated) with at least two lines of six
 * numbers; null if it is none.
 */
export function parseTable(text: string): TableRow[] | null {
  const lines = text
    .split(/\r?\n/)
    .map((line) => line.trim())
    .filter(Boolean);
  const rows = lines.map(rowOf).filter((row) => row !== null);
  return rows.length >= 2 ? rows : null;
}

function rowOf(line: string): TableRow | null {
  const cells = line.split(/[;,\t]/).map((cell) => cell.trim());
  const isNumber = (cell: string) => /^[+\-−]?[\d.]+(e[+-]?\d+)?\s*(mm|m|°|rad|deg)?$/i.test(cell);
  const first = cells.findIndex(isNumber);
  const named = first > 0 ? cells.slice(0, first).join(" ").replace(/["']/g, "").trim() : null;
  const values = cells.slice(Math.max(0, first)).filter(isNumber);
  if (values.length < 6) return numbersOf(line).length >= 6 ? { name: null, text: line } : null;
  return { name: named || null, text: values.join(" ; ") };
}
