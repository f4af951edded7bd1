import { useEffect, useState } from "preact/hooks";
import { toolOfAnswer } from "../store/load";
import type { Answered } from "../store/state";
import type { ToolDetail } from "../store/tools";
import { tell } from "../store/trouble";
import { fixed, figure } from "../store/units";

/** What to do before the file runs on a robot. */
export function Steps({
  shown,
  speed,
  format,
}: {
  shown: Answered;
  speed: number;
  format: string;
}) {
  const program = ["urscript", "movej", "krl", "rapid"].includes(format);
  const masses = shown.cycle
    ? shown.cycle.loads.map(({ payload }) => payload?.mass ?? 0)
    : [shown.cell.payload?.mass ?? 0];
  const [tool, setTool] = useState<ToolDetail | null>(null);
  useEffect(() => void toolOfAnswer(shown).then(setTool, (error) => tell(error)), [shown]);
  const start = shown.solution.trajectory.q[0]!.map((value) =>
    fixed((value * 180) / Math.PI, 1),
  ).join(", ");
  const checks = format === "urscript" ? " The program stops if the payload is not taken." : "";
  return (
    <>
      <h3>Before it runs on your robot</h3>
      <ol class="steps">
        <li>
          Set payload {figure(Math.max(...masses) + ((tool?.mass.value as number) ?? 0))} kg
          {tool && " (gripper and part)"}, its centre and your safety limits on the controller.
          {checks}
        </li>
        <li>Jog to the start joints and compare the pose: {start}°.</li>
        <li>
          {program ? "Run it in the maker’s simulator" : "Run it in simulation"}, then at{" "}
          {Math.round(speed * 100)} % with a hand at the stop button.
        </li>
      </ol>
    </>
  );
}
