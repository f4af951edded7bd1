// What is inside of a page that stands alone.
import type { Answered } from "./state";

export const EMBEDDED = "embedded";

export interface Embedded {
  answered: Answered;
  /** The robot's meshes (glTF, base64); null: drawn from its figures. */
  meshes: string | null;
}

/** The answer inside of this page; null in the page of a service. */
export function embedded(): Embedded | null {
  const data = document.getElementById(EMBEDDED);
  return data && (JSON.parse(data.textContent ?? "null") as Embedded | null);
}

/** Whether this page stands alone, without a service. */
export const alone = typeof document !== "undefined" && document.getElementById(EMBEDDED) !== null;
