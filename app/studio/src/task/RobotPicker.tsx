import { useEffect, useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { Choices } from "../ui/Choices";
import { Dialog } from "../ui/Dialog";
import { robotNow } from "../picture/pictured";
import { withRobot } from "../store/edits";
import { robotName } from "../store/request";
import { robotList, robotOf, type RobotSummary } from "../store/service";
import { edit, request, typed } from "../store/state";
import { trying } from "../store/trouble";
import { OwnArm } from "./OwnArm";

/** All robots of the service, and the way to add one's own. */
export function RobotPicker({ onClose }: { onClose: () => void }) {
  const [robots, setRobots] = useState<RobotSummary[] | null>(null);
  const [adding, setAdding] = useState(false);
  const [why, setWhy] = useState("");
  const load = () => robotList().then(setRobots, (error: Error) => setWhy(error.message));
  useEffect(() => void load(), []);
  const now = robotName(request.value);
  const choose = (name: string) => {
    if (name !== now)
      trying(async () => {
        const robot = await robotOf(name);
        edit(withRobot(request.value, robot, robotNow.value), typed.value);
      })();
    onClose();
  };
  const choices = (robots ?? []).map(
    ({ name, title, joints, rated_payload: mass, added, energy_trust: trust }) => ({
      value: name,
      title,
      facts: `${name} · ${joints.length} joints · ${mass} kg payload${added ? " · yours" : ""}`,
      note: trust,
    }),
  );
  return (
    <Dialog
      title="Robot"
      onClose={onClose}
      wide
      footer={
        <Button onClick={() => setAdding(!adding)}>
          {adding ? "Back to the list" : "Add your own arm (URDF)"}
        </Button>
      }
    >
      {adding ? (
        <OwnArm onAdded={choose} />
      ) : (
        <>
          {why && (
            <p class="error" role="alert">
              {why}
            </p>
          )}
          {!robots && !why && <p class="hint">…</p>}
          {robots && (
            <Choices
              label="Search robots"
              name="Robots"
              choices={choices}
              current={now}
              onChoose={choose}
            />
          )}
        </>
      )}
    </Dialog>
  );
}
