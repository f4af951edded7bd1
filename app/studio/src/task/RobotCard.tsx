import { useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { Errors } from "../ui/Errors";
import { robotNow } from "../picture/pictured";
import { robotName } from "../store/request";
import { page, request } from "../store/state";
import { RobotPicker } from "./RobotPicker";

/** The arm of the cell, and whose figures it is computed with. */
export function RobotCard() {
  const [open, setOpen] = useState(false);
  const robot = robotNow.value;
  const name = robotName(request.value);
  const known = robot?.name === name ? robot : null;
  const rated = known?.limits.rated_payload?.value;
  const own = request.value.figures;
  return (
    <section class="section robot" aria-label="Robot">
      <div>
        <h2>{known?.title ?? name}</h2>
        <p class="hint">
          {known ? `${known.joints.length} joints` : "…"}
          {typeof rated === "number" && ` · ${rated} kg payload`}
        </p>
        <p class="hint">
          {own ? "Identified figures" : "Figures of the robot type"} ·{" "}
          <Button
            kind="link"
            onClick={() => (page.value = "logs")}
            title="Identify figures from logs of your own arm"
          >
            {own ? "see your logs" : "use yours"}
          </Button>
        </p>
      </div>
      <Button id="change-robot" onClick={() => setOpen(true)}>
        Change
      </Button>
      <Errors under="/robot" />
      <Errors under="/figures" />
      {open && <RobotPicker onClose={() => setOpen(false)} />}
    </section>
  );
}
