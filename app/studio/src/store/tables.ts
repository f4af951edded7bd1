// Tables of numbers, as spreadsheets and programs hold them.
import { ABC_SAID, numbersOf, parseAlike, RPY_SAID, type Choice } from "./parsePose";

const NUMBER = /^[+\-−]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;

export const isNumber = (cell: string) => NUMBER.test(cell);

/**
 * The cells of a line. Between tabs or semicolons, a comma in a number is its decimal sign; in a
 * line without them, commas separate.
 */
export function cellsOf(line: string): string[] {
  const parted = /[;\t]/.test(line);
  const cells = line.split(parted ? /[;\t]|,\s/ : ",").map((cell) => cell.trim());
  return cells.map((cell) => {
    const plain = cell.replace(/^"(.*)"$/, "$1");
    const pointed = plain.replace(",", ".");
    return parted && isNumber(pointed) ? pointed : plain;
  });
}

/** Units and kind of the columns that a head names, as words that the reader of poses understands. */
export function unitsOf(head: string): string {
  const text = head.toLowerCase();
  const length = /\bmm\b|_mm/.test(text) ? " mm" : /[[(_ ]m[\])\s]/.test(text) ? " m" : "";
  const angle = /\bdeg|_deg|°/.test(text) ? " deg" : /\brad\b|_rad/.test(text) ? " rad" : "";
  const kind = /\bq_?1|\bj_?1|joint/.test(text) ? " q1" : /\brx\b|rx[_ [(]/.test(text) ? " rx" : "";
  const turn = ABC_SAID.test(text) ? " a b c" : RPY_SAID.test(text) ? " rpy" : "";
  return `${length}${angle}${kind}${turn}`;
}

export interface TableRow {
  name: string | null;
  text: string;
}

export interface Table {
  rows: TableRow[];
  /** Ways to read all rows. */
  choices: Choice[];
}

/**
 * Reads the rows of a table, or the lines of a program, with at least two targets; null if the text
 * is none. Lines without a target, such as a head or a command of a program, are left out; a row
 * of a table that lacks numbers is refused.
 */
export function parseTable(text: string, joints = 6): Table | { why: string } | null {
  const lines = text
    .split(/\r?\n/)
    .map((line) => line.trim())
    .filter(Boolean);
  const rows = lines.map(rowOf);
  const targets = rows.filter(({ count }) => count >= LEAST);
  if (targets.length < 2) return null;
  const refused = ({ name }: TableRow, k: number, why: string) => ({
    why: `Row ${k + 1}${name ? ` (${name})` : ""}: ${why}`,
  });
  const table = rows.filter(({ count }) => count > 0);
  const short = table.findIndex(({ count }) => count < LEAST);
  if (short >= 0)
    return refused(
      table[short]!,
      short,
      `Numbers found: ${table[short]!.count}. Correct or delete this row.`,
    );
  const [first] = rows;
  const units = first!.count === 0 ? unitsOf(lines[0]!) : "";
  const parsed = parseAlike(
    targets.map((row) => `${row.text}${units}`),
    joints,
  );
  return "why" in parsed
    ? refused(targets[parsed.row]!, parsed.row, parsed.why)
    : { rows: targets, choices: parsed.choices };
}

const LEAST = 6; // numbers of a target

/** A line with the count of its numbers: 0 for one that is no row. */
function rowOf(line: string): TableRow & { count: number } {
  const cells = cellsOf(line);
  const isValue = (cell: string) => isNumber(cell.replace(/\s*(mm|m|°|rad|deg)$/i, ""));
  const first = cells.findIndex(isValue);
  const values = first < 0 ? [] : cells.slice(first).filter(isValue);
  const name = first > 0 ? cells.slice(0, first).join(" ").replace(/["']/g, "").trim() : "";
  if (values.length >= LEAST)
    return { name: name || null, text: values.join(" ; "), count: values.length };
  const whole = numbersOf(line).length;
  if (whole >= LEAST) return { name: null, text: line, count: whole };
  // a command of a program is no row of a table
  return { name: name || null, text: line, count: line.includes("(") ? 0 : values.length };
}
