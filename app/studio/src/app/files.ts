// Projects as files.
import { newId } from "../store/persist";
import { cellOf, fileName, presentCell, save } from "../store/share";
import { page, project, replaceCell, toast } from "../store/state";
import { tell } from "../store/trouble";

/** Saves the project as a file. */
export function saveFile(): void {
  const name = fileName(project.value.name, "cell", "joulepath.json");
  save(name, JSON.stringify(presentCell(), null, 1), "application/json");
  toast.value = "The project is saved as a file.";
}

/** Opens a project file that is chosen, or a request as JSON. */
export function openFile(): void {
  const input = Object.assign(document.createElement("input"), {
    type: "file",
    accept: ".json,application/json",
  });
  input.onchange = () => {
    const file = input.files?.[0];
    if (file) void readFile(file);
  };
  input.click();
}

export async function readFile(file: File): Promise<void> {
  let text = "";
  try {
    text = await file.text();
    const cell = cellOf(text);
    const name = cell.name ?? file.name.replace(/(\.joulepath)?\.json$/, "");
    replaceCell({
      project: { id: newId(), name },
      request: cell.request,
      typed: cell.typed,
      economics: cell.economics,
    });
    page.value = "cell";
  } catch (error) {
    const why = text.trimStart().startsWith("{")
      ? (error as Error).message
      : "Choose a file saved by “Save as a file”, or a request in JSON.";
    tell(new Error(`${file.name} is not a project. ${why}`));
  }
}

/** A file that is dropped on the cell is opened; elsewhere the browser would leave the page for it. */
export function followDrops(): void {
  const isFile = ({ target, dataTransfer }: DragEvent) =>
    dataTransfer?.types.includes("Files") && !(target as HTMLElement).matches?.("[type=file]");
  document.addEventListener("dragover", (event) => isFile(event) && event.preventDefault());
  document.addEventListener("drop", (event) => {
    if (!isFile(event)) return;
    event.preventDefault();
    const file = event.dataTransfer!.files[0];
    if (file && page.value === "cell" && !document.querySelector("dialog[open]"))
      void readFile(file);
  });
}
