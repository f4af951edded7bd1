import { Button } from "../ui/Button";
import { Errors } from "../ui/Errors";
import { Section } from "../ui/Section";
import { tool } from "../picture/drag";
import { robotNow } from "../picture/pictured";
import { withStop, withVia } from "../store/edits";
import { put } from "../store/pointer";
import { rowsOf } from "../store/request";
import { edit, kind, request, selected, typed } from "../store/state";
import { PasteBox } from "./PasteBox";
import { PoseRow } from "./PoseRow";
import { presentTarget, takePose } from "./take";

const unitsNote = () =>
  robotNow.value?.title.startsWith("Universal Robots")
    ? "mm and rad, as on the pendant"
    : "mm; RX RY RZ: rotation vector in rad";

/** Where the arm begins, passes, stops and ends. */
export function TargetTable() {
  const rows = rowsOf(request.value);
  const isCycle = kind.value === "cycle";
  const path = kind.value === "path";
  const add = () => {
    const present = presentTarget("pose");
    if (path && present && "pose" in present) edit(withVia(request.value, present.pose));
    else edit(withStop(request.value), typed.value);
  };
  return (
    <Section
      title={isCycle ? "Stops" : "Targets"}
      note={isCycle ? `${rows.length - 1}` : unitsNote()}
      id="targets"
    >
      {isCycle && <Order />}
      {rows.map((row, k) => (
        <PoseRow key={row.pointer} row={row} index={k} />
      ))}
      <PasteBox />
      <div class="row">
        <Button kind="link" icon="plus" onClick={add}>
          {path ? "Add a via pose" : "Add a stop"}
        </Button>
        <Button
          kind="link"
          icon="target"
          onClick={takePose}
          title="Use the current pose of the arm in the picture"
        >
          Take from the picture
        </Button>
        <Button
          kind="link"
          icon="move"
          disabled={!selected.value}
          title="Choose a target first"
          onClick={() => (tool.value = "move")}
        >
          Drag
        </Button>
      </div>
      {kind.value === "move" && <p class="hint">A stop turns the move into a cycle.</p>}
      <Errors under="/stops" except={rows.map(({ pointer }) => pointer.replace(/\/target$/, ""))} />
    </Section>
  );
}

/** In which order the stops are visited, and whether the arm comes back. */
function Order() {
  const { order, closed } = request.value;
  return (
    <div class="row">
      <label>
        order{" "}
        <select
          aria-label="Order of the stops"
          value={order === "free" ? "free" : "given"}
          onChange={(event) => edit(put(request.value, "/order", event.currentTarget.value))}
        >
          <option value="given">as listed</option>
          <option value="free">the best</option>
        </select>
      </label>
      <label>
        <input
          type="checkbox"
          checked={closed !== false}
          onChange={(event) =>
            edit(put(request.value, "/closed", event.currentTarget.checked ? undefined : false))
          }
        />{" "}
        back to the start
      </label>
    </div>
  );
}
