// What is pasted into the targets, and the question where it can be meant in two ways.
import { signal } from "@preact/signals";
import { robotNow } from "../picture/pictured";
import { untyped } from "../picture/drag";
import { withStop, withTarget } from "../store/edits";
import { parsePose, parseTable, type Reading, type TableRow } from "../store/parsePose";
import { kindOf, poseOfSix, rowsOf, targetAt, type Row } from "../store/request";
import { edit, request, selected, toast } from "../store/state";
import type { ApiRequest, Pose } from "../store/types";

export interface Question {
  text: string;
  row: Row | null;
  readings: Reading[];
  table: TableRow[] | null;
}

export const question = signal<Question | null>(null);
export const pasteWrong = signal("");

const joints = () => robotNow.value?.joints.length ?? 6;

const targetOfReading = ({ kind, values }: Reading): { q: number[] } | { pose: Pose } =>
  kind === "joints" ? { q: values } : { pose: poseOfSix(values) };

/** Takes a text that holds a whole target; false where it is a single number. */
export function pasteInto(row: Row, text: string): boolean {
  const numbers = text.match(/\d+(?:[.,]\d+)?/g) ?? [];
  if (numbers.length < 2) return false;
  read(text, row);
  return true;
}

/** The row that a paste goes to: the chosen one, else the first empty one, else the last. */
export function rowOfPaste(): Row | null {
  const rows = rowsOf(request.value);
  const chosen = rows.find(({ pointer }) => pointer === selected.value);
  return chosen ?? rows.find((row) => targetAt(request.value, row).kind === "empty") ?? null;
}

/** Understands a text, or asks how it is meant; false where it is neither. */
export function read(text: string, row: Row | null): boolean {
  pasteWrong.value = "";
  question.value = null;
  const table = parseTable(text);
  const target = row && targetAt(request.value, row);
  const prefer = target?.kind === "pose" || target?.kind === "joints" ? target.kind : undefined;
  const parsed = parsePose(table ? table[0]!.text : text, joints(), prefer);
  if ("why" in parsed) {
    pasteWrong.value = parsed.why;
    return false;
  }
  const asked: Question = { text, row, readings: parsed.readings, table };
  if (parsed.readings.length > 1) question.value = asked;
  else answer(asked, parsed.readings[0]!);
  return true;
}

/** Writes what was pasted as it is meant. */
export function answer({ row, table }: Question, reading: Reading): void {
  question.value = null;
  if (table) {
    const [next, count] = withRows(request.value, table, reading);
    edit(next);
    toast.value = `${count} stops from the table, read as ${reading.echo}.`;
    return;
  }
  const target = targetOfReading(reading);
  edit(
    row ? withTarget(request.value, row, target) : withStop(request.value, target),
    untyped(row?.pointer ?? "/none"),
  );
  toast.value = `Read as ${reading.echo}.`;
}

/** The request with a stop for each row of a table that can be read in the same way. */
function withRows(asked: ApiRequest, table: TableRow[], reading: Reading): [ApiRequest, number] {
  let next = asked;
  let count = 0;
  for (const { name, text } of table) {
    const parsed = parsePose(text, joints(), reading.kind);
    const own =
      "readings" in parsed
        ? (parsed.readings.find(({ echo }) => echo === reading.echo) ?? parsed.readings[0])
        : null;
    if (!own) continue;
    next = withStop(next, targetOfReading(own), name ?? "stop 1");
    count += 1;
  }
  // stops that were empty before have no place in the table
  const stops =
    kindOf(next) === "round" ? next.stops?.filter(({ target, path }) => target || path) : undefined;
  return [stops ? { ...next, stops } : next, count];
}
