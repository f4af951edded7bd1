import { Button } from "../ui/Button";
import { untyped } from "../picture/drag";
import { robotNow } from "../picture/pictured";
import { reachedGhost } from "../picture/reachedGhost";
import { withTarget } from "../store/edits";
import { targetAt, type Row } from "../store/request";
import { edit, request } from "../store/state";
import { fixed, jointName } from "../store/units";
import { jointsOf, poseAtJoints } from "./take";

/** One slider for each joint: the target follows, as joints or as a pose. */
export function JointSliders({ row, onClose }: { row: Row; onClose: () => void }) {
  const robot = robotNow.value;
  const q = jointsOf(row);
  if (!robot || !q) return <p class="hint">No posture is known yet.</p>;
  const [least, most] = ["position_min", "position_max"].map(
    (name) => robot.limits[name]?.value as number[],
  );
  const slide = (joint: number, value: number) => {
    const next = q.map((old, k) => (k === joint ? value : old));
    const pose = targetAt(request.value, row).kind === "pose" ? poseAtJoints(next) : null;
    reachedGhost.value = next;
    edit(
      withTarget(request.value, row, pose ? { pose } : { q: next }),
      untyped(row.pointer),
      `${row.pointer} ${joint}`,
    );
  };
  return (
    <div class="sliders">
      {robot.joints.map((name, k) => (
        <label key={name}>
          <span>{jointName(name)}</span>
          <input
            type="range"
            min={least?.[k]}
            max={most?.[k]}
            step={0.001}
            value={q[k]}
            onInput={(event) => slide(k, Number(event.currentTarget.value))}
          />
          <output>{fixed(((q[k] ?? 0) * 180) / Math.PI, 1)}°</output>
        </label>
      ))}
      <Button
        small
        onClick={() => {
          reachedGhost.value = null;
          onClose();
        }}
      >
        Done
      </Button>
    </div>
  );
}
