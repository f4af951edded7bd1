// What is pasted into the targets, and the question where it can be meant in two ways.
import { signal } from "@preact/signals";
import { robotNow } from "../picture/pictured";
import { untyped } from "../picture/drag";
import { withStop, withTarget } from "../store/edits";
import { parseAlike, targetOf, type Choice, type Reading } from "../store/parsePose";
import { parseTable, type TableRow } from "../store/tables";
import { rowsOf, targetAt, type Row } from "../store/request";
import { edit, request, selected, toast } from "../store/state";
import type { ApiRequest } from "../store/types";

export interface Question {
  row: Row | null;
  choices: Choice[];
  /** Null for a single target. */
  table: TableRow[] | null;
}

export const question = signal<Question | null>(null);
export const pasteWrong = signal("");

const joints = () => robotNow.value?.joints.length ?? 6;

const choicesOf = (text: string, prefer?: Reading["kind"]) => parseAlike([text], joints(), prefer);

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
  const table = parseTable(text, joints());
  const target = row && targetAt(request.value, row);
  const prefer = target?.kind === "pose" || target?.kind === "joints" ? target.kind : undefined;
  const parsed = table ?? choicesOf(text, prefer);
  if ("why" in parsed) {
    pasteWrong.value = parsed.why;
    return false;
  }
  const asked: Question = {
    row,
    choices: parsed.choices,
    table: table && !("why" in table) ? table.rows : null,
  };
  if (parsed.choices.length > 1) question.value = asked;
  else answer(asked, parsed.choices[0]!);
  return true;
}

/** Writes what was pasted as it is meant. */
export function answer({ row, table }: Question, { echo, rows }: Choice): void {
  question.value = null;
  const targets = rows.map(targetOf);
  if (table) {
    edit(withRows(request.value, table, targets));
    toast.value = `${table.length} stops from the table, read as ${echo}.`;
    return;
  }
  const [target] = targets;
  edit(
    row ? withTarget(request.value, row, target!) : withStop(request.value, target),
    untyped(row?.pointer ?? "/none"),
  );
  toast.value = `Read as ${echo}.`;
}

/** The request with a stop for each row of a table. */
function withRows(asked: ApiRequest, table: TableRow[], targets: unknown[]): ApiRequest {
  const next = table.reduce(
    (before, { name }, k) => withStop(before, targets[k], name ?? "stop 1"),
    asked,
  );
  // stops that were empty before have no place in the table
  return { ...next, stops: next.stops?.filter(({ target, path }) => target || path) };
}
