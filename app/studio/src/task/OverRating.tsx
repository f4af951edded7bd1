import { robotNow } from "../picture/pictured";
import { toolNow } from "../store/tools";
import { figure } from "../store/units";

/** A sentence where a part, with the tool that the request names, is more than the arm may carry. */
export function OverRating({ mass }: { mass: unknown }) {
  const rated = robotNow.value?.limits.rated_payload?.value;
  const tool = (toolNow.value?.mass.value as number | undefined) ?? 0;
  if (typeof mass !== "number" || typeof rated !== "number" || mass + tool <= rated) return null;
  return (
    <p class="warning-text">
      {figure(mass + tool)} kg{tool > 0 && ", gripper included,"} exceeds the rated payload of the{" "}
      {robotNow.value?.title} ({rated} kg).
    </p>
  );
}
