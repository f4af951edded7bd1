// A plain program of `movej` to the found joints, for those who write their programs by hand.
import { carried } from "../store/load";
import type { Answered } from "../store/state";
import type { ToolDetail } from "../store/tools";
import type { Payload } from "../store/types";

const number = (value: number) => `${Number(value.toFixed(6))}`;
const joints = (q: number[]) => `[${q.map(number).join(", ")}]`;

function payload(part: Payload | null, tool: ToolDetail | null): string {
  const load = carried(part, tool);
  if (!load)
    throw new Error("Enter the centre of mass (com) of the payload: this program sets it.");
  return `  set_target_payload(${number(load.mass)}, [${load.com.map(number).join(", ")}])`;
}

interface Stop {
  name: string;
  q: number[];
  load: Payload | null;
  dwell: number;
}

/** Where the arm stands, in order, and what it carries from there on. */
function stopsOf({ solution, cycle, cell }: Answered): Stop[] {
  const { start, goal } = solution.branch;
  if (!cycle) {
    const load = cell.payload ?? null;
    return [
      { name: "start", q: start.q, load, dwell: 0 },
      { name: "goal", q: goal.q, load, dwell: 0 },
    ];
  }
  const stops: Stop[] = [
    { name: "start", q: start.q, load: cycle.loads[0]?.payload ?? null, dwell: 0 },
  ];
  cycle.legs.forEach(({ kind, goal: to, duration }, k) => {
    const load = (cycle.loads[k + 1] ?? cycle.loads[k])?.payload ?? null;
    if (kind === "dwell" || kind === "wait") stops.at(-1)!.dwell += duration;
    else stops.push({ name: to.stop ?? "?", q: to.q, load, dwell: 0 });
  });
  return stops;
}

/**
 * The text of a URScript program; `output`: a digital output that is on while the arm carries
 * something more; `tool`: the one that the request names, whose mass is in the payload. Throws Error.
 */
export function movejProgram(
  shown: Answered,
  speed: number,
  output: number | null,
  tool: ToolDetail | null,
): string {
  const stops = stopsOf(shown);
  const [a, v] = [number(1.4 * speed * speed), number(1.05 * speed)];
  const base = stops[0]!.load?.mass ?? 0;
  const lines = stops.flatMap(({ name, q, load, dwell }, k) => {
    const before = k ? (stops[k - 1]!.load?.mass ?? 0) : base;
    const mass = load?.mass ?? 0;
    const grip =
      output === null || mass === before
        ? []
        : [`  set_standard_digital_out(${output}, ${mass > base ? "True" : "False"})`];
    const loaded = mass === before && k ? [] : [payload(load, tool)];
    const move = [`  movej(${joints(q)}, a=${a}, v=${v})`];
    return [
      `  # ${name}`,
      ...(k ? move : [...loaded, ...move]),
      ...grip,
      ...(dwell ? [`  sleep(${number(dwell)})`] : []),
      ...(k ? loaded : []),
    ];
  });
  return [
    "# The configurations found; the controller chooses path and time between them.",
    "# Clearance and energy of these paths are not proven.",
    "def joulepath_movej():",
    ...lines,
    "end",
    "",
  ].join("\n");
}
