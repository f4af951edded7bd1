// Keys of the whole page.
import { goTo, neighbour, toggle } from "../picture/clock";
import { tool, type Tool } from "../picture/drag";
import { picture } from "../picture/instance";
import { alone } from "../store/alone";
import { cancel } from "../store/run";
import { duration, page, redo, run, undo } from "../store/state";
import { takePose } from "../task/take";
import { send } from "../task/RunBar";
import { dialog } from "./dialog";
import { openFile, saveFile } from "./files";

export const KEYS: [string, string][] = [
  ["Ctrl ↵", "optimise"],
  ["Esc", "cancel, close"],
  ["Ctrl Z, Ctrl Shift Z", "undo, redo"],
  ["Ctrl S", "save the project as a file"],
  ["Ctrl O", "open a project file"],
  ["Ctrl E", "export"],
  ["Ctrl V", "in a target: fill all of its numbers"],
  ["↑ ↓", "in a number: change the last digit by 1, with Shift by 10"],
  ["Alt ↑ ↓", "move a stop up or down"],
  ["Ctrl D, Del", "duplicate, delete a stop"],
  ["Space", "play, pause"],
  ["← →", "previous, next sample"],
  ["Home, End", "start, end of the motion"],
  ["1 to 6", "choose a view; in view 1, the least of the arm is hidden"],
  ["R", "reset the view"],
  ["D, T, B, P", "in the picture: drag, turn, draw a box, take the pose"],
  ["?", "show this list"],
];

const WRITING = "input:not([type=range]):not([type=checkbox]):not([type=radio]), select, textarea";

export function onKey(event: KeyboardEvent): void {
  if (event.defaultPrevented) return;
  const target = event.target as HTMLElement;
  const act =
    event.ctrlKey || event.metaKey
      ? withControl(event, target)
      : event.altKey
        ? null
        : single(event, target);
  if (!act) return;
  event.preventDefault();
  act();
}

function withControl(event: KeyboardEvent, target: HTMLElement): (() => unknown) | null {
  if (alone) return null;
  const key = event.key.toLowerCase();
  if (key === "enter" && page.value === "cell") {
    return () => {
      // what is being typed counts
      (document.activeElement as HTMLElement | null)?.blur();
      send();
    };
  }
  if (key === "s") return saveFile;
  if (key === "o") return openFile;
  if (key === "e" && page.value === "cell") return () => (dialog.value = "export");
  if (target.closest("textarea, input[type=search]")) return null;
  if (key === "z") return event.shiftKey ? redo : undo;
  return key === "y" ? redo : null;
}

function single(event: KeyboardEvent, target: HTMLElement): (() => unknown) | null {
  if (event.key === "Escape" && run.value) return cancel;
  if (
    page.value !== "cell" ||
    target.closest(`${WRITING}, dialog, [role=tab], [role=radio], summary`)
  )
    return null;
  const key = event.key.length > 1 ? event.key : event.key.toLowerCase();
  if (/^[1-6]$/.test(key)) return () => picture.value?.look(Number(key));
  if (key === " " && target.closest("button, a, input")) return null;
  if (key === "?") return () => (dialog.value = "keys");
  const inPicture = target.closest("#view") && !alone;
  const tools: Record<string, Tool> = { d: "move", t: "turn", b: "box" };
  if (inPicture && tools[key])
    return () => (tool.value = tool.value === tools[key] ? "look" : tools[key]!);
  if (inPicture && key === "p") return takePose;
  const acts: Record<string, () => unknown> = {
    " ": toggle,
    ArrowRight: () => goTo(neighbour(1)),
    ArrowLeft: () => goTo(neighbour(-1)),
    Home: () => goTo(0),
    End: () => goTo(duration.value),
    r: () => picture.value?.look(1),
  };
  if (target.closest("[tabindex][role=region], .answer") && key.startsWith("Arrow")) return null;
  return acts[key] ?? null;
}
