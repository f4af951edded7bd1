import { Button } from "../ui/Button";
import { Errors } from "../ui/Errors";
import { Segment } from "../ui/Segment";
import { chooseKind } from "../store/kinds";
import { asJson, kind } from "../store/state";
import { JsonEditor } from "./JsonEditor";
import { MoreFields } from "./MoreFields";
import { PathFields } from "./PathFields";
import { PlaceField } from "./PlaceField";
import { RobotCard } from "./RobotCard";
import { RunBar } from "./RunBar";
import { SceneList } from "./SceneList";
import { TargetTable } from "./TargetTable";
import { TimeField } from "./TimeField";
import { ToolPayload } from "./ToolPayload";

const KINDS = [
  { value: "move", text: "Move" },
  { value: "cycle", text: "Cycle" },
  { value: "path", text: "Path" },
] as const;

/** What is asked for, in the order in which a person thinks of it. */
export function TaskPanel() {
  return (
    <aside class="task" id="task" aria-label="Task">
      <div class="task-head">
        <Segment label="Kind of task" options={KINDS} value={kind.value} onChange={chooseKind} />
        <Button
          kind="quiet"
          small
          id="json-toggle"
          pressed={asJson.value}
          onClick={() => (asJson.value = !asJson.value)}
        >
          {"{ }"} JSON
        </Button>
      </div>
      <div class="task-body" hidden={!asJson.value}>
        <JsonEditor />
      </div>
      {!asJson.value && (
        <div class="task-body" id="form">
          <RobotCard />
          <ToolPayload />
          <TargetTable />
          {kind.value === "path" && <PathFields />}
          <SceneList />
          <TimeField />
          {kind.value !== "path" && <PlaceField />}
          <MoreFields />
          <Errors under="/logs" />
        </div>
      )}
      <RunBar />
    </aside>
  );
}
