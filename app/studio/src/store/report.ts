// Reports: pages for those who decide.
import { send } from "./client";
import { costsOf, DEFAULT_ECONOMICS, type Economics } from "./economics";
import { periodOf } from "./facts";
import { mapShown } from "./placement";
import { endpointOf } from "./request";
import { save } from "./share";
import { answered, economics, project, toast } from "./state";

export type ReportFormat = "html" | "pdf";

/** The numbers for costs as `POST /report` takes them. */
export function costsFor(given: Economics, cyclesPerShift: number | null) {
  const yours = (value: number) => ({ value, source: "yours" });
  const { cycle, shift, shiftsPerYear } = given;
  const asked = cyclesPerShift !== null && (cycle !== null || shift !== DEFAULT_ECONOMICS.shift);
  return {
    ...(asked ? { cycles_per_shift: yours(cyclesPerShift) } : {}),
    shifts_per_year:
      shiftsPerYear === DEFAULT_ECONOMICS.shiftsPerYear
        ? { value: shiftsPerYear, source: "assumed: two on 230 days", letter: "E" }
        : yours(shiftsPerYear),
    price: given.price,
    carbon: given.carbon,
    ...(given.box ? { control_box: given.box } : {}),
  };
}

/** A report of the answer that is shown, as a file. Throws Problem. */
export async function reportAnswer(format: ReportFormat): Promise<void> {
  const shown = answered.value;
  if (!shown?.asked) return;
  const given = economics.value;
  const { name } = project.value;
  const body = {
    [endpointOf(shown.asked)]: shown.asked,
    answer: shown.solution.id,
    period: given.cycle,
    costs: costsFor(given, costsOf([], periodOf(shown, given.cycle), given).cyclesPerShift),
  };
  await report(body, name, format);
}

/** A report of the map that is shown, as a file. Throws Problem. */
export async function reportPlaces(format: ReportFormat): Promise<void> {
  const map = mapShown.value;
  if (!map) return;
  const costs = costsFor(economics.value, null);
  const { body, answer } = map;
  await report({ placement: body, answer: answer.id, costs }, project.value.name, format);
}

/** A report as a file. Throws Problem. */
export async function report(
  body: Record<string, unknown>,
  title: string,
  format: ReportFormat,
): Promise<void> {
  toast.value = "The report is being written …";
  const response = await send("report", {
    method: "POST",
    body: JSON.stringify({ ...body, title: title.slice(0, 120), format }),
    headers: { "Content-Type": "application/json" },
  });
  const file = title.replace(/[^\w-]+/g, "-").toLowerCase() || "report";
  save(`${file}.${format}`, await response.blob());
  toast.value = "The report is saved; request and answer are attached to it.";
}
