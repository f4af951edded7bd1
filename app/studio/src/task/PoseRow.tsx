import { useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { useDraft } from "../ui/draft";
import { Errors } from "../ui/Errors";
import { Menu } from "../ui/Menu";
import { NumberCell } from "../ui/NumberCell";
import { untyped } from "../picture/drag";
import { duplicated, entryOf, moved, withoutRow, withTarget } from "../store/edits";
import { at, put } from "../store/pointer";
import { reached } from "../store/reach";
import { poseAt, sixOf, targetAt, withNumber, type Row, type Target } from "../store/request";
import { changes, edit, request, selected, trouble, typed } from "../store/state";
import { JointSliders } from "./JointSliders";
import { pasteInto } from "./paste";
import { PoseCells } from "./PoseCells";
import { deedText, StopFields } from "./StopFields";
import { jointsOf, poseAtJoints, presentTarget } from "./take";

/** One target: its name, whether it is reached, and its numbers. */
export function PoseRow({ row, index }: { row: Row; index: number }) {
  const [sliders, setSliders] = useState(false);
  const target = targetAt(request.value, row);
  const chosen = selected.value === row.pointer;
  const stopAt = row.pointer.replace(/\/target$/, "");
  const changed = changes.value.some(({ pointer }) =>
    pointer.startsWith(row.role === "stop" ? `${stopAt}/` : row.pointer),
  );
  const choose = () => (selected.value = row.pointer);
  const onKeyDown = (event: KeyboardEvent) => {
    const act = rowKey(event, row);
    if (!act) return;
    event.preventDefault();
    act();
  };
  return (
    <div
      class={`target ${row.role}${chosen ? " chosen" : ""}`}
      data-row={row.pointer}
      onFocusCapture={choose}
      onClick={choose}
      onKeyDown={onKeyDown}
      role="group"
      aria-label={row.name}
    >
      <div class="target-head">
        <i class={`mark ${row.role}`} aria-hidden="true">
          {row.role === "stop" ? index : ""}
        </i>
        {row.role === "stop" ? <StopName row={row} /> : <b>{row.name}</b>}
        {row.role === "stop" && <small class="deed">{deedText(at(request.value, stopAt))}</small>}
        {changed && <small class="was">changed</small>}
        <span class="space" />
        <ReachText row={row} target={target} />
        <RowMenu row={row} target={target} onSliders={() => setSliders(!sliders)} />
      </div>
      <Numbers row={row} target={target} />
      {sliders && <JointSliders row={row} onClose={() => setSliders(false)} />}
      {row.role === "stop" && chosen && <StopFields pointer={stopAt} />}
      <Errors under={row.role === "stop" ? stopAt : row.pointer} />
    </div>
  );
}

function rowKey(event: KeyboardEvent, row: Row): (() => void) | null {
  if (!entryOf(row)) return null;
  const inside = (event.target as HTMLElement).matches("input, select, textarea");
  if (event.altKey && event.key === "ArrowUp") return () => edit(moved(request.value, row, -1));
  if (event.altKey && event.key === "ArrowDown") return () => edit(moved(request.value, row, 1));
  if ((event.ctrlKey || event.metaKey) && event.key === "d")
    return () => edit(duplicated(request.value, row));
  return event.key === "Delete" && !inside ? () => edit(withoutRow(request.value, row)) : null;
}

function StopName({ row }: { row: Row }) {
  const pointer = `${row.pointer.replace(/\/target$/, "")}/name`;
  const { field } = useDraft(row.name);
  return (
    <input
      type="text"
      class="name"
      aria-label={`Name of ${row.name}`}
      {...field}
      onChange={(event) => edit(put(request.value, pointer, event.currentTarget.value))}
    />
  );
}

function ReachText({ row, target }: { row: Row; target: Target }) {
  const reach = reached.value[row.pointer];
  if (target.kind !== "pose" || !reach) return null;
  if (reach.state === "asking") return <small class="hint">checking …</small>;
  if (reach.state === "refused") return null;
  const free = reach.solutions.filter(({ collides }) => !collides).length;
  if (free)
    return (
      <small class="hint" title="Postures that reach this pose without collision">
        {free} of {reach.solutions.length} {row.role === "stop" ? "" : "postures "}free
      </small>
    );
  return <small class="warning-text">every posture collides</small>;
}

function Numbers({ row, target }: { row: Row; target: Target }) {
  const paste = (text: string) => pasteInto(row, text);
  if (target.kind === "pose") {
    const reach = reached.value[row.pointer];
    const told = trouble.value?.fields.some(({ pointer }) => pointer.startsWith(row.pointer));
    const refused = reach?.state === "refused" && !told ? reach.text : null;
    return (
      <>
        <PoseCells
          name={row.name}
          pointer={poseAt(row)}
          six={sixOf(target.pose)}
          onPaste={paste}
          onNumber={(k, value, text, pointer) =>
            edit(put(request.value, poseAt(row), withNumber(target.pose, k, value)), {
              ...typed.value,
              [pointer]: text,
            })
          }
        />
        {refused && <p class="error">{refused}</p>}
      </>
    );
  }
  if (target.kind === "joints")
    return (
      <div class="six">
        {target.q.map((value, k) => (
          <label key={k} class="six-cell">
            <span aria-hidden="true">J{k + 1} °</span>
            <NumberCell
              label={`${row.name} joint ${k + 1}`}
              pointer={`${row.pointer}/q/${k}`}
              value={value}
              unit="deg"
              onPaste={paste}
            />
          </label>
        ))}
      </div>
    );
  if (target.kind === "other") return <p class="hint">{target.text}: see JSON</p>;
  const empty = (kind: "pose" | "joints") => {
    const present = presentTarget(kind);
    if (present) edit(withTarget(request.value, row, present), untyped(row.pointer));
  };
  return (
    <div class="row">
      <span class="hint">Empty: paste a target below, or</span>
      <Button small onClick={() => empty("pose")}>
        take it from the picture
      </Button>
    </div>
  );
}

function RowMenu({ row, target, onSliders }: { row: Row; target: Target; onSliders: () => void }) {
  const set = (next: ReturnType<typeof presentTarget>) =>
    next && edit(withTarget(request.value, row, next), untyped(row.pointer));
  const q = target.kind === "joints" ? target.q : jointsOf(row);
  const asPose = () => {
    const pose = q && poseAtJoints(q);
    if (pose) set({ pose });
  };
  const copy = () =>
    void navigator.clipboard?.writeText(
      target.kind === "joints"
        ? `[${target.q.join(", ")}]`
        : target.kind === "pose"
          ? `p[${sixOf(target.pose).join(", ")}]`
          : JSON.stringify(at(request.value, row.pointer)),
    );
  return (
    <Menu label="" name={`More for ${row.name}`} icon="more" quiet>
      <Button
        kind="quiet"
        onClick={() => set(presentTarget(target.kind === "joints" ? "joints" : "pose"))}
      >
        Take from the picture
      </Button>
      {!row.bare && target.kind === "pose" && q && (
        <Button kind="quiet" onClick={() => set({ q })}>
          As joint positions
        </Button>
      )}
      {target.kind === "joints" && (
        <Button kind="quiet" onClick={asPose}>
          As a pose
        </Button>
      )}
      {!row.bare && (
        <Button kind="quiet" onClick={onSliders}>
          Joint sliders
        </Button>
      )}
      <Button kind="quiet" onClick={copy}>
        Copy
      </Button>
      {entryOf(row) && (
        <>
          <Button kind="quiet" onClick={() => edit(duplicated(request.value, row))}>
            Duplicate
          </Button>
          <Button kind="quiet" onClick={() => edit(moved(request.value, row, -1))}>
            Move up
          </Button>
          <Button kind="quiet" onClick={() => edit(moved(request.value, row, 1))}>
            Move down
          </Button>
          <Button kind="quiet" icon="trash" onClick={() => edit(withoutRow(request.value, row))}>
            Delete
          </Button>
        </>
      )}
    </Menu>
  );
}
