// Another kind of task. Fields that one kind has and another one has not, such as the stops of a
// cycle, are kept until that kind is chosen again.
import { asKind, asKindAgain, ownFields } from "./edits";
import { kindOf, robotName, type Kind } from "./request";
import { edit, project, request } from "./state";
import type { ApiRequest } from "./types";

// of one cell and one robot: postures of another arm would not fit
let kept: { of: string; fields: Partial<Record<Kind, ApiRequest>> } = { of: "", fields: {} };

/** Makes the request one of another kind. */
export function chooseKind(kind: Kind): void {
  const now = request.value;
  if (kindOf(now) === kind) return;
  const of = JSON.stringify([project.value.id, robotName(now)]);
  const before = kept.of === of ? kept.fields : {};
  kept = { of, fields: { ...before, [kindOf(now)]: ownFields(now) } };
  const fields = before[kind];
  edit(fields ? asKindAgain(now, kind, fields) : asKind(now, kind));
}
