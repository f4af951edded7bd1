import { signal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { put } from "../store/pointer";
import { edit, request } from "../store/state";
import { toolList, toolName, toolNow, toolWhy, type ToolSummary } from "../store/tools";
import { tell } from "../store/trouble";
import type { Parameter } from "../store/types";
import { figure } from "../store/units";

const tools = signal<ToolSummary[] | null>(null);

/**
 * Common grippers by name; each brings its shape, TCP and mass, with the letters of its figures.
 */
export function ToolPicker() {
  useEffect(() => {
    if (!tools.value)
      toolList().then(
        (found) => (tools.value = found),
        (error) => tell(error),
      );
  }, []);
  const name = toolName(request.value);
  const choose = (next: string) => {
    const bare = put(put(request.value, "/tool", undefined), "/tcp", undefined);
    edit(next ? { ...bare, tool: next } : bare);
  };
  return (
    <>
      <label class="field">
        <span>Gripper</span>
        <select
          id="tool"
          value={name ?? ""}
          onChange={(event) => choose(event.currentTarget.value)}
        >
          <option value="">other: own TCP and shape</option>
          {tools.value?.map((each) => (
            <option key={each.name} value={each.name}>
              {each.title}
            </option>
          ))}
          {name !== null && !tools.value?.some((each) => each.name === name) && (
            <option value={name}>{name}</option>
          )}
        </select>
      </label>
      {toolWhy.value && (
        <p class="error" role="alert">
          {toolWhy.value}
        </p>
      )}
      {toolNow.value && <Figures />}
    </>
  );
}

function Figures() {
  const { mass, tcp, capsules, trust } = toolNow.value!;
  const letter = (figure_: Parameter) => (
    <abbr title={`${trust[figure_.trust] ?? ""}: ${figure_.source}. ${figure_.note}`}>
      {figure_.trust}
    </abbr>
  );
  return (
    <p class="hint" id="tool-figures">
      {figure(mass.value as number)} kg {letter(mass)}, TCP {letter(tcp)}, shape of{" "}
      {(capsules.value as unknown[]).length} capsules {letter(capsules)}. The payload does not
      include the gripper.
    </p>
  );
}
