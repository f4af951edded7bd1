// What the arm carries: a part, and the tool that a request names.
import { listOf, isObject } from "./request";
import type { Answered } from "./state";
import { dressed, namedTool, toolNow, type ToolDetail } from "./tools";
import type { ApiRequest, Payload, Pose } from "./types";

/** The centre of a part that is gripped in its middle: the TCP, else 50 mm before the flange. */
export function gripped(asked: ApiRequest): number[] {
  const { tcp } = dressed(asked, toolNow.peek());
  const at = isObject(tcp) ? listOf<number>((tcp as Pose).position) : [];
  return at.some((each) => each !== 0) ? at : [0, 0, 0.05];
}

/**
 * Centre of mass of a part in the flange frame, its own or that of its shape; null for a shape whose
 * middle only the service computes.
 */
export function centreOf({ com, shape }: Payload): number[] | null {
  if (com || !shape) return com ?? [0, 0, 0];
  return shape.shape === "mesh" ? null : (shape.pose?.position ?? [0, 0, 0]);
}

/** Mass and centre of a part and the tool as one body; null if the centre is not known here. */
export function carried(
  part: Payload | null,
  tool: ToolDetail | null,
): { mass: number; com: number[] } | null {
  const bodies = [
    ...(part?.mass ? [{ mass: part.mass, com: centreOf(part) }] : []),
    ...(tool
      ? [{ mass: tool.mass.value as number, com: tool.center_of_mass.value as number[] }]
      : []),
  ];
  const mass = bodies.reduce((sum, each) => sum + each.mass, 0);
  const com = [0, 0, 0];
  for (const each of bodies) {
    if (!each.com) return null;
    each.com.forEach((value, k) => (com[k]! += (each.mass / mass) * value));
  }
  return { mass, com };
}

/** Figures of the tool that an answer was asked with by name. Throws Problem. */
export const toolOfAnswer = ({ asked, solution }: Answered): Promise<ToolDetail | null> =>
  namedTool(asked ?? solution.arm ?? {});
