import { useEffect, useState } from "preact/hooks";
import { Button } from "../ui/Button";
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
  const [filter, setFilter] = useState("");
  const [adding, setAdding] = useState(false);
  const [why, setWhy] = useState("");
  const load = () => robotList().then(setRobots, (error: Error) => setWhy(error.message));
  useEffect(() => void load(), []);
  const choose = (name: string) => {
    if (name !== robotName(request.value))
      trying(async () => {
        const robot = await robotOf(name);
        edit(withRobot(request.value, robot, robotNow.value), typed.value);
      })();
    onClose();
  };
  const shown = (robots ?? []).filter(({ name, title }) =>
    `${name} ${title}`.toLowerCase().includes(filter.toLowerCase()),
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
          <input
            type="search"
            class="search"
            placeholder="Search robots"
            aria-label="Search robots"
            value={filter}
            onInput={(event) => setFilter(event.currentTarget.value)}
          />
          {why && (
            <p class="error" role="alert">
              {why}
            </p>
          )}
          {!robots && !why && <p class="hint">…</p>}
          <ul class="robots">
            {shown.map(
              ({ name, title, joints, rated_payload: mass, added, energy_trust: trust }) => (
                <li key={name}>
                  <button
                    type="button"
                    class="choice"
                    aria-pressed={name === robotName(request.value)}
                    onClick={() => choose(name)}
                  >
                    <b>{title}</b>
                    <small>
                      {name} · {joints.length} joints · {mass} kg payload{added ? " · yours" : ""}
                    </small>
                    <small>{trust}</small>
                  </button>
                </li>
              ),
            )}
          </ul>
        </>
      )}
    </Dialog>
  );
}
