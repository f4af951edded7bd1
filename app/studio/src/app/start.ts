// What the page shows first: the cell of a link, the last project, or the example.
import { play } from "../picture/clock";
import { followRobot } from "../picture/pictured";
import { followAdvice } from "../answer/advice";
import { followPostures } from "../answer/postures";
import { followDrops } from "./files";
import { followHistory } from "./history";
import { alone, embedded } from "../store/alone";
import { openCell, openFirst, openKept, openLast } from "../store/open";
import { followChanges } from "../store/persist";
import { followReach } from "../store/reach";
import { knowMeshes, knowRobot } from "../store/service";
import { fromBase64, shared } from "../store/share";
import { answered, replaceCell } from "../store/state";
import { followTool } from "../store/tools";
import { tell } from "../store/trouble";

/** Follows what changes, and shows the first cell. */
export async function start(): Promise<void> {
  if (alone) return showEmbedded();
  followRobot();
  followReach();
  followTool();
  followChanges();
  followPostures();
  followAdvice();
  followHistory();
  followDrops();
  window.addEventListener(
    "hashchange",
    () => /^#(r|answer)=/.test(location.hash) && location.reload(),
  );
  const given = await shared(location.hash).catch(async (error) => {
    await openFirst();
    tell(error);
    return { done: true } as const;
  });
  if ("done" in given) return undefined;
  if (given.answer)
    await openKept(given.answer).catch(async (error) => {
      await openFirst();
      tell(error);
    });
  else if (given.cell) await openCell(given.cell, given.cell.name ?? "Shared cell");
  else await openLast();
  return begin();
}

/** Plays, unless motion is unwanted. */
export function begin(): void {
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) play();
}

function showEmbedded(): void {
  const inside = embedded()!;
  knowRobot(inside.answered.robot);
  if (inside.meshes) knowMeshes(inside.answered.robot.name, fromBase64(inside.meshes));
  else inside.answered.robot.has_meshes = false;
  const asked = inside.answered.asked ?? inside.answered.cell;
  replaceCell({ project: { id: "", name: "A motion" }, request: asked });
  answered.value = { ...inside.answered, asked };
  begin();
}
