// Reads what is pasted as poses or as joint positions. What can be meant in two ways is asked, never
// guessed.
import { Euler, Quaternion } from "three";
import { rotvecOf } from "./chain";
import { poseOfSix } from "./request";
import type { Pose } from "./types";

export interface Reading {
  kind: "pose" | "joints";
  /** X, Y, Z [m], RX, RY, RZ [rad]; or joint positions [rad]. */
  values: number[];
  /** How the text was understood, in words. */
  echo: string;
}

/** The target of a request that was read. */
export const targetOf = ({ kind, values }: Reading): { q: number[] } | { pose: Pose } =>
  kind === "joints" ? { q: values } : { pose: poseOfSix(values) };

export type Parsed = { readings: Reading[] } | { why: string };

/** One way to read all rows of a table. */
export interface Choice {
  echo: string;
  /** The readings of the rows, in order. */
  rows: Reading[];
}

export type ParsedRows = { choices: Choice[] } | { why: string; row: number };

const DEGREE = Math.PI / 180;
const TURN = 2 * Math.PI + 0.01;
/** Distance from the base within which a TCP may be [m]. */
const NEAREST = 0.02;
const FARTHEST = 4;
const NUMBER = /[+\-−]?(?:\d+(?:[.]\d*)?|[.]\d+)(?:e[+-]?\d+)?/gi;
const LABEL =
  /\b(?:r[xyz]|[xyz]|rpy|roll|pitch|yaw|[ajq]\d|joint ?\d|base|shoulder|elbow|wrist ?\d)\b\s*[:=]?/gi;

const LENGTHS = [
  { inMetre: 1000, name: "mm" },
  { inMetre: 1, name: "m" },
];

/**
 * Every way in which a text can be read for an arm of so many joints; `prefer` is the kind of the
 * row it goes to.
 */
export function parsePose(text: string, joints = 6, prefer?: Reading["kind"]): Parsed {
  const parsed = parseAlike([text], joints, prefer);
  return "why" in parsed
    ? { why: parsed.why }
    : { readings: parsed.choices.map(({ rows }) => rows[0]!) };
}

/**
 * Every way in which all of several texts can be read alike. A text with one reading, such as a line
 * of a program, is read so whatever the others are.
 */
export function parseAlike(texts: string[], joints = 6, prefer?: Reading["kind"]): ParsedRows {
  const all: Reading[][] = [];
  for (const [row, text] of texts.entries()) {
    const found = readingsOf(text, joints, prefer);
    if ("why" in found) return { ...found, row };
    all.push(found.readings);
  }
  const echoesOf = (readings: Reading[]) => readings.map(({ echo }) => echo);
  const clear = all.filter(({ length }) => length === 1).flatMap(echoesOf);
  const open = all.filter(({ length }) => length > 1);
  let shared = echoesOf(open[0] ?? all[0]!.slice(0, 1));
  for (const readings of open) {
    shared = shared.filter((echo) => echoesOf(readings).includes(echo));
    if (!shared.length)
      return {
        why: "Its format differs from that of the rows above: use one format.",
        row: all.indexOf(readings),
      };
  }
  const likely = shared.filter((echo) => clear.includes(echo));
  const echoes = likely.length ? likely : shared;
  const choices = echoes.map((echo) => ({
    echo,
    rows: all.map((readings) => readings.find((each) => each.echo === echo) ?? readings[0]!),
  }));
  return { choices: different(choices.filter(isLikely)) };
}

/** Choices with different values. */
const different = (choices: Choice[]) =>
  choices.filter(
    (one, k) =>
      !choices
        .slice(0, k)
        .some((two) =>
          one.rows.every(
            (row, n) => row.kind === two.rows[n]!.kind && same(row.values, two.rows[n]!.values),
          ),
        ),
  );

/** Angles that can all be radians are not taken for roll, pitch and yaw in degrees. */
const isLikely = ({ echo }: Choice, _: number, all: Choice[]) =>
  !echo.endsWith(RPY) || !all.some((other) => other.echo === echo.replace(RPY, RADIANS));

const RADIANS = "RX RY RZ in rad";
const RPY = "roll, pitch, yaw in degrees";
const ABC = "A, B, C in degrees";
// KUKA turns about z, y and x in this order; W, P, R of FANUC are roll, pitch and yaw
export const ABC_SAID = /\ba\b[^a-z]+\bb\b[^a-z]+\bc\b/i;
export const RPY_SAID = /\brpy\b|\broll\b|\bw\b.+\bp\b.+\br\b/i;

function readingsOf(text: string, joints: number, prefer?: Reading["kind"]): Parsed {
  const numbers = numbersOf(text);
  if (!numbers.length)
    return { why: "No number was found: paste p[…], six numbers or joint positions." };
  const asPose = /\bp\s*\[/i.test(text) || /\br[xyz]\b|\bx\b/i.test(text) || RPY_SAID.test(text);
  const asJoints = /\b(?:[ajq]|joint ?)1\b|\bbase\b|\bshoulder\b/i.test(text) || MOVE.test(text);
  const poses = asJoints || numbers.length !== 6 ? [] : posesOf(text, numbers);
  const angles = asPose || numbers.length !== joints ? [] : jointsOf(text, numbers, joints);
  const readings = choose(poses, angles, prefer);
  if (readings.length) return { readings };
  if (numbers.length !== 6 && numbers.length !== joints)
    return {
      why: `Numbers found: ${numbers.length}. A pose has 6, and this arm has ${joints} joints.`,
    };
  return { why: farAway(numbers) };
}

/** Joint positions as an argument of a program's command. */
const MOVE = /\b(?:move[jlp]|servoj)\s*\(\s*\[/i;

function choose(poses: Reading[], joints: Reading[], prefer?: Reading["kind"]): Reading[] {
  if (prefer === "pose" && poses.length) return poses;
  if (prefer === "joints" && joints.length) return joints;
  return [...poses, ...joints];
}

function farAway(numbers: number[]): string {
  const away = Math.hypot(...numbers.slice(0, 3)) / 1000;
  return `As a pose in mm, this is ${away.toFixed(1)} m from the base: check the units.`;
}

export function numbersOf(text: string): number[] {
  // in a program, names and speeds with digits stand around the brackets
  const lists = [...text.matchAll(/\[([^[\]]*)\]/g)].map(([, inside]) => inside!);
  const bracketed = lists.length === 1 && lists[0]!.split(",").length >= 6 ? lists[0]! : text;
  // the digits of labels are no values
  const plain = bracketed.replace(LABEL, " ");
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
      echo: `pose in ${length.name} and ${name}`,
    })),
  );
}

/** The ways to read three numbers as an orientation. */
function turnsOf(
  text: string,
  turn: number[],
  script: boolean,
): { rotvec: number[]; name: string }[] {
  const radians = { rotvec: turn, name: RADIANS };
  const vector = { rotvec: turn.map((value) => value * DEGREE), name: "RX RY RZ in degrees" };
  const rpy = { rotvec: ofRpy(turn), name: RPY };
  if (script) return [radians];
  if (ABC_SAID.test(text)) return [{ rotvec: ofRpy(turn.toReversed()), name: ABC }];
  const degrees = RPY_SAID.test(text) ? [rpy] : [vector, rpy];
  if (/°|\bdeg/.test(text)) return degrees;
  if (/\brad\b/.test(text)) return [radians];
  const small = turn.every((value) => Math.abs(value) <= TURN);
  return small ? [radians, vector, rpy] : degrees;
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
  if (/°|\bdeg|\ba1\b/i.test(text)) return [degrees];
  if (/\brad\b/.test(text) || MOVE.test(text)) return [radians];
  if (values.some((value) => Math.abs(value) > 400)) return [];
  if (values.some((value) => Math.abs(value) > TURN)) return [degrees];
  return [radians, degrees];
}
