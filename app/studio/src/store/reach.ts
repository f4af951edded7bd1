// Whether the poses of the request are reached, and how: asked of `POST /ik` as they are typed.
import { effect, signal, untracked } from "@preact/signals";
import { Problem, post } from "./client";
import { at, type Pointer } from "./pointer";
import { robotName, rowsOf, targetAt, poseAt } from "./request";
import { request } from "./state";
import type { ApiRequest, IkSolution, Pose } from "./types";
import { asShown } from "./units";

export type Reach =
  | { state: "asking" }
  | { state: "reached"; solutions: IkSolution[] }
  | { state: "refused"; text: string };

const PAUSE = 300; // after the last edit [ms]
const AGAIN = 3000; // after the service was busy or away [ms]
const LATER = [undefined, 503, 504]; // statuses of answers that may come later
const MOST = 24; // rows that are asked about

export const reached = signal<Record<Pointer, Reach>>({});

const known = new Map<string, Reach>();
let waiting: ReturnType<typeof setTimeout> | undefined;
let turn = 0;

/** What `POST /ik` is asked about a pose of a request. */
export function ikBody(asked: ApiRequest, pose: Pose, windings: boolean): Record<string, unknown> {
  const { tcp, tool, payload, scene } = asked;
  const shape = payload?.shape
    ? {
        payload: {
          shape: payload.shape,
          ...(payload.touches === undefined ? {} : { touches: payload.touches }),
        },
      }
    : {};
  return JSON.parse(
    JSON.stringify({ robot: robotName(asked), tcp, tool, scene, pose, windings, ...shape }),
  ) as Record<string, unknown>;
}

/** All configurations that reach a pose. Throws Problem. */
export const solutionsOf = async (
  asked: ApiRequest,
  pose: Pose,
  windings = false,
  signal?: AbortSignal,
) =>
  (await post<{ solutions: IkSolution[] }>("ik", ikBody(asked, pose, windings), signal)).solutions;

/** Asks about every pose of the request, from now on. */
export function followReach(): void {
  effect(() => {
    const asked = request.value;
    untracked(() => {
      clearTimeout(waiting);
      waiting = setTimeout(() => void askAll(asked), PAUSE);
    });
  });
}

async function askAll(asked: ApiRequest): Promise<void> {
  const own = ++turn;
  const rows = rowsOf(asked)
    .filter((row) => targetAt(asked, row).kind === "pose")
    .slice(0, MOST);
  const bodies = rows.map((row) => ({
    pointer: row.pointer,
    pose: at(asked, poseAt(row)) as Pose,
  }));
  const keys = bodies.map(({ pose }) => JSON.stringify(ikBody(asked, pose, false)));
  const next: Record<Pointer, Reach> = {};
  bodies.forEach(({ pointer }, k) => (next[pointer] = known.get(keys[k]!) ?? { state: "asking" }));
  reached.value = next;
  for (const [k, { pointer, pose }] of bodies.entries()) {
    if (known.has(keys[k]!)) continue;
    const found = await ask(asked, pose);
    if (own !== turn) return;
    if (found && found.state !== "asking") known.set(keys[k]!, found);
    const { [pointer]: _, ...others } = reached.value;
    reached.value = found ? { ...others, [pointer]: found } : others;
  }
  if (Object.values(reached.value).some(({ state }) => state === "asking"))
    waiting = setTimeout(() => void askAll(asked), AGAIN);
}

/** What is known of a pose: still being asked while the service is busy; null for a request in which a field is wrong. */
async function ask(asked: ApiRequest, pose: Pose): Promise<Reach | null> {
  try {
    return { state: "reached", solutions: await solutionsOf(asked, pose) };
  } catch (error) {
    if (!(error instanceof Problem)) return null;
    const { status, errors } = error.details;
    if (LATER.includes(status)) return { state: "asking" };
    // fields that are wrong elsewhere are told when the request is sent
    return status === 422 && !errors
      ? {
          state: "refused",
          text: asShown(error.message).replace(/^The .*? pose is /, "The pose is "),
        }
      : null;
  }
}
