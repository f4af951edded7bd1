// Tables of moves, as they become a job: from where to where, with what.
import { gripped } from "./load";
import { parseAlike, targetOf, type Choice } from "./parsePose";
import { cellsOf, isNumber, unitsOf } from "./tables";
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

export type MovesRead = { moves: Move[]; choices: Choice[] } | { why: string };

const LONGEST_NAME = 200;

/** The name of a move in its job, without characters that do not show. */
export const moveName = ({ from, to }: Move): string =>
  `${from} to ${to}`.replace(/\p{C}/gu, "").slice(0, LONGEST_NAME);

/**
 * Reads a table with one move in a row: names, kg, six numbers of the start, six of the goal; or
 * one target in a row.
 */
export function parseMoves(text: string, joints: number): MovesRead {
  const lines = text
    .split(/\r?\n/)
    .map(cellsOf)
    .filter((cells) => cells.some(Boolean));
  const [first] = lines;
  if (!first) return { why: "Paste a table with one move per row." };
  const headed = first.filter(isNumber).length < joints;
  const head = headed ? first.map((cell) => cell.toLowerCase()) : null;
  const rows = (headed ? lines.slice(1) : lines).map((cells) => rowOf(cells, head));
  if (!rows.length)
    return { why: "No row of numbers was found below the first line: paste one move per row." };
  const odd = rows.findIndex(({ odd }) => odd !== null);
  if (odd >= 0)
    return {
      why: `Row ${odd + 1}: “${rows[odd]!.odd}” is not a mass in kg: correct or delete it.`,
    };
  const units = head ? unitsOf(head.join(" ")) : "";
  const count = rows[0]!.numbers.length;
  const wrong = rows.findIndex(({ numbers }) => numbers.length !== count);
  if (wrong >= 0)
    return {
      why: `Row ${wrong + 1} has ${rows[wrong]!.numbers.length} numbers, but row 1 has ${count}.`,
    };
  const moves = movesOf(rows, count, joints, units);
  if (!moves)
    return {
      why: `Each row has ${count} numbers: a move needs 12 (6 for the start, 6 for the goal), a target 6.`,
    };
  const parsed = parseAlike(
    moves.flatMap(({ start, goal }) => [start, goal]),
    joints,
  );
  return "why" in parsed
    ? { why: `${moveName(moves[Math.floor(parsed.row / 2)]!)}: ${parsed.why}` }
    : { moves, choices: parsed.choices };
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

/** The requests of a job: each move in the cell, read as chosen. */
export function requestsOf(moves: Move[], { rows }: Choice, cell: ApiRequest): ApiRequest[] {
  const shared = Object.fromEntries(Object.entries(cell).filter(([name]) => !OWN.includes(name)));
  return moves.map(({ mass }, k) => ({
    ...shared,
    start: targetOf(rows[2 * k]!),
    goal: targetOf(rows[2 * k + 1]!),
    ...(mass === null ? {} : { payload: loadOf(mass, cell) }),
  }));
}

const loadOf = (mass: number, cell: ApiRequest): Payload | null =>
  mass > 0 ? { ...(cell.payload ?? { com: gripped(cell) }), mass } : null;
