// Opening cells: from an example, a project, a link or a kept answer.
import { batch } from "@preact/signals";
import { get } from "./client";
import { askedFor, newId, projects, type Saved } from "./persist";
import { optimise, showAnswer } from "./run";
import { keptAnswer, robotOf } from "./service";
import type { Cell } from "./share";
import { page, replaceCell, toast } from "./state";
import { tell } from "./trouble";
import type { ApiRequest, Cycle, Solution } from "./types";

/** A kept answer with its request; a part of another answer, such as a move of a cycle, has none. */
interface Kept {
  name: string | null;
  request: ApiRequest | null;
  typed: Cell["typed"] | null;
  answer: Solution & Partial<Cycle>;
}

const FIRST = "studio/first.json";

/** The example of the first visit, computed at once. */
export async function openFirst(): Promise<void> {
  await openCell({ request: await get<ApiRequest>(FIRST) }, "Bin to shelf");
}

/** A cell as a project of its own; it is computed at once. */
export async function openCell(cell: Cell, name: string, compute = true): Promise<void> {
  replaceCell({
    project: { id: newId(), name },
    request: cell.request,
    typed: cell.typed,
    economics: cell.economics,
  });
  page.value = "cell";
  if (compute) await optimise(cell.request).catch((error) => tell(error, cell.request));
}

/** A cell of a robot, with the start of its example move; or with the whole move, computed at once. */
export async function openRobot(name: string, whole: boolean): Promise<void> {
  const { title, example_move: move } = await robotOf(name);
  const asked = { robot: name, ...(move ? { start: { q: move.start } } : {}) };
  if (whole && move)
    await openCell({ request: { ...asked, goal: { q: move.goal } } }, `First move of ${title}`);
  else await openCell({ request: asked }, "New cell", false);
}

/** The project that was saved last; the example, where there is none. */
export async function openLast(): Promise<void> {
  const [last] = await projects().catch((): Saved[] => []);
  const shown = page.value;
  // the cell comes, and the page stays
  await batch(() => {
    const opening = last ? openProject(last) : openFirst();
    page.value = shown;
    return opening;
  });
}

/** A saved project, with its answer where the service still has it. */
export async function openProject(project: Saved): Promise<void> {
  replaceCell({
    project: { id: project.id, name: project.name },
    request: project.request,
    typed: project.typed,
    economics: project.economics,
  });
  page.value = "cell";
  if (!project.answer || !project.asked) return;
  try {
    const path = `answers/${encodeURIComponent(project.answer)}`;
    await showAnswer(await keptAnswer(path), project.asked);
  } catch {
    toast.value = "The answer of this project is no longer stored: optimise again.";
  }
}

/** A kept answer by its id or path, with its request as it was typed. Throws Problem. */
export async function openKept(path: string): Promise<void> {
  const address = path.includes("/") ? path : `answers/${encodeURIComponent(path)}`;
  const { name, request: sent, typed, answer } = await get<Kept>(address);
  if (!answer?.branch && !answer?.legs)
    throw new Error("Only answers with a motion or a cycle can be shown here.");
  const here = answer.id ? await askedFor(answer.id) : null;
  const request = here?.request ?? sent ?? requestOfMove(answer);
  replaceCell({
    project: { id: newId(), name: name ?? `Answer ${answer.id?.slice(0, 8) ?? ""}`.trim() },
    request,
    typed: here?.typed ?? typed ?? {},
    economics: here?.economics,
  });
  page.value = "cell";
  await showAnswer(answer, request);
  if (!here && !sent)
    toast.value = "This part of an answer has no request: its joint positions are the targets.";
}

/**
 * The same arm between the same ends: what the answer does not say of its request stays at the
 * defaults.
 */
const requestOfMove = ({ robot, arm, branch }: Solution): ApiRequest => ({
  robot,
  ...arm,
  start: { q: branch.start.q },
  goal: { q: branch.goal.q },
});
