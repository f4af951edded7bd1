// Tables of moves, as they become a job: from where to where, with what.
import { gripped } from "./load";
import { parsePose, type Reading } from "./parsePose";
import { poseOfSix } from "./request";
import type { ApiRequest, Payload } from "./types";
import { parseNumber } from "./units";

export interface Move {
  from: string;
  to: string;
  /** Mass that is carried [kg]; null: that of the cell. */
  mass: number | null;
  start: string;
  goal: string;
}

export type MovesRead = { moves: Move[]; readings: Reading[] } | { why: string };

const LONGEST_NAME = 200;

/** The name of a move in its job, without characters that do not show. */
export const moveName = ({ from, to }: Move): string =>
  `${from} to ${to}`.replace(/\p{C}/gu, "").slice(0, LONGEST_NAME);

const SEPARATOR = /[;,\t]/;
const isNumber = (cell: string) => /^[+\-−]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(cell);

/**
 * Reads a table with one move in a row: names, kg, six numbers of the start, six of the goal; or
 * one target in a row.
 */
export function parseMoves(text: string, joints: number): MovesRead {
  const lines = text
    .split(/\r?\n/)
    .map((line) => line.split(SEPARATOR).map((cell) => cell.trim().replace(/^"|"$/g, "")))
    .filter((cells) => cells.some(Boolean));
  const [first] = lines;
  if (!first) return { why: "Paste a table: one move in a row." };
  const headed = first.filter(isNumber).length < joints;
  const head = headed ? first.map((cell) => cell.toLowerCase()) : null;
  const rows = (headed ? lines.slice(1) : lines).map((cells) => rowOf(cells, head));
  if (!rows.length)
    return { why: "No row of numbers was found below the first line: paste one move in a row." };
  const odd = rows.findIndex(({ odd }) => odd !== null);
  if (odd >= 0)
    return { why: `Row ${odd + 1}: “${rows[odd]!.odd}” is no mass in kg. Correct or delete it.` };
  const units = head ? unitsOf(head.join(" ")) : "";
  const count = rows[0]!.numbers.length;
  const wrong = rows.findIndex(({ numbers }) => numbers.length !== count);
  if (wrong >= 0)
    return {
      why: `Row ${wrong + 1} has ${rows[wrong]!.numbers.length} numbers, the first one ${count}.`,
    };
  const moves = movesOf(rows, count, joints, units);
  if (!moves)
    return {
      why: `${count} numbers are in a row: a move has 12 (6 of the start, 6 of the goal), a target 6.`,
    };
  const parsed = parsePose(moves[0]!.start, joints);
  return "why" in parsed ? parsed : { moves, readings: parsed.readings };
}

interface Row {
  names: string[];
  mass: number | null;
  numbers: number[];
  /** What stands where a mass should; null if nothing is wrong. */
  odd: string | null;
}

function rowOf(cells: string[], head: string[] | null): Row {
  const massAt = head?.findIndex((name) => /\b(kg|mass|payload)\b/.test(name)) ?? -1;
  const idAt = head?.findIndex((name) => /^(no\.?|nr\.?|id|#)$/.test(name)) ?? -1;
  const rest = cells.filter((_, k) => k !== massAt && k !== idAt);
  const names = rest.filter((cell) => cell && !isNumber(cell));
  const given = massAt >= 0 ? cells[massAt] || "0" : null;
  const mass = given === null ? null : parseNumber(given);
  // without a head, a third text stands where the mass would
  const odd = given !== null && !(mass !== null && mass >= 0) ? given : head ? null : names[2];
  return {
    names,
    mass,
    odd: odd ?? null,
    numbers: rest.filter(isNumber).map((cell) => Number(cell.replace("−", "-"))),
  };
}

/** Units that a head names, as words that the reader of poses understands. */
function unitsOf(head: string): string {
  const length = /\bmm\b|_mm/.test(head) ? " mm" : /[[(_ ]m[\])\s]/.test(head) ? " m" : "";
  const angle = /\bdeg|_deg|°/.test(head) ? " deg" : /\brad\b|_rad/.test(head) ? " rad" : "";
  const kind = /\bq_?1|\bj_?1|joint/.test(head) ? " q1" : /\brx\b|rx[_ [(]/.test(head) ? " rx" : "";
  return `${length}${angle}${kind}`;
}

const textOf = (numbers: number[], units: string) => `${numbers.join(" ; ")}${units}`;

function movesOf(rows: Row[], count: number, joints: number, units: string): Move[] | null {
  const six = [6, joints].find((size) => count === 2 * size || count === 2 * size + 1);
  if (six !== undefined)
    return rows.map(({ names, mass, numbers }, k): Move => {
      const given = count % 2 ? numbers.slice(1) : numbers;
      return {
        from: names[0] ?? `start ${k + 1}`,
        to: names[1] ?? `goal ${k + 1}`,
        mass: mass ?? (count % 2 ? numbers[0]! : null),
        start: textOf(given.slice(0, six), units),
        goal: textOf(given.slice(six), units),
      };
    });
  if (count !== 6 && count !== joints) return null;
  // one target in a row: from each to the next
  return rows.slice(1).map(({ names, mass, numbers }, k) => ({
    from: rows[k]!.names[0] ?? `${k + 1}`,
    to: names[0] ?? `${k + 2}`,
    mass,
    start: textOf(rows[k]!.numbers, units),
    goal: textOf(numbers, units),
  }));
}

// fields of a request that are not those of the single moves
const OWN = [
  "start",
  "goal",
  "stops",
  "path",
  "order",
  "before",
  "together",
  "closed",
  "time",
  "hold",
  "wait",
  "duration",
  "dwell",
];

/** The requests of a job: each move in the cell. Throws Error with the row that cannot be read. */
export function requestsOf(
  moves: Move[],
  reading: Reading,
  cell: ApiRequest,
  joints: number,
): ApiRequest[] {
  const shared = Object.fromEntries(Object.entries(cell).filter(([name]) => !OWN.includes(name)));
  const targetOf = (text: string, row: number) => {
    const parsed = parsePose(text, joints, reading.kind);
    const own =
      "readings" in parsed
        ? (parsed.readings.find(({ echo }) => echo === reading.echo) ?? parsed.readings[0])
        : null;
    if (!own || own.kind !== reading.kind)
      throw new Error(`Row ${row + 1} cannot be read as ${reading.echo}.`);
    return own.kind === "joints" ? { q: own.values } : { pose: poseOfSix(own.values) };
  };
  return moves.map(({ mass, start, goal }, k) => ({
    ...shared,
    start: targetOf(start, k),
    goal: targetOf(goal, k),
    ...(mass === null ? {} : { payload: loadOf(mass, cell) }),
  }));
}

const loadOf = (mass: number, cell: ApiRequest): Payload | null =>
  mass > 0 ? { ...(cell.payload ?? { com: gripped(cell) }), mass } : null;
