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
  const [first = 0] = masses;
  const most = Math.max(...masses);
  const mass = (part: number) => figure(part + ((tool?.mass.value as number | undefined) ?? 0));
  const held = tool ? ` (${first ? "gripper and part" : "gripper"})` : "";
  return (
    <>
      <h3>Before you run the file on your robot</h3>
      <ol class="steps">
        <li>
          On the controller, set the payload at the start, {mass(first)} kg{held}, its centre of
          mass, and your safety limits.
          {masses.some((each) => each !== first) &&
            ` The payload reaches ${mass(most)} kg during the cycle: ${
              program ? "the program changes it at the stops" : "change it at the stops"
            }.`}
        </li>
        <li>Jog to the start configuration, {start}°, and compare the pose.</li>
        <li>
          Run the file {program ? "in the manufacturer’s simulator" : "in simulation"}, then at{" "}
          {Math.round(speed * 100)} % with a hand on the stop button.
        </li>
      </ol>
    </>
  );
}
