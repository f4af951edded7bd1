// The report of the answer: one page for those who decide.
import { send } from "../store/client";
import { costsOf } from "../store/economics";
import { endpointOf } from "../store/request";
import { save } from "../store/share";
import { answered, economics, project, toast } from "../store/state";

/** A report of the answer that is shown, as a file. Throws Problem. */
export async function report(format: "html" | "pdf"): Promise<void> {
  const shown = answered.value;
  if (!shown?.asked) return;
  const given = economics.value;
  const yours = (value: number) => ({ value, source: "yours" });
  const costs = {
    cycles_per_shift: yours(costsOf([], shown.solution.duration, given).cyclesPerShift),
    shifts_per_year: yours(given.shiftsPerYear),
    price: given.price,
    carbon: given.carbon,
    ...(given.box ? { control_box: given.box } : {}),
  };
  const body = {
    [endpointOf(shown.asked)]: shown.asked,
    answer: shown.solution.id,
    title: project.value.name.slice(0, 120),
    costs,
    format,
  };
  toast.value = "The report is being written …";
  const response = await send("report", {
    method: "POST",
    body: JSON.stringify(body),
    headers: { "Content-Type": "application/json" },
  });
  save(
    `${project.value.name.replace(/[^\w-]+/g, "-").toLowerCase() || "report"}.${format}`,
    await response.blob(),
  );
  toast.value = "The report is saved; request and answer are attached to it.";
}
