import { useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { useDraft } from "../ui/draft";
import { Menu } from "../ui/Menu";
import { projectName } from "../store/persist";
import { robotName } from "../store/request";
import { examples } from "../store/service";
import { project, request } from "../store/state";
import { tell, trying } from "../store/trouble";
import type { ApiRequest } from "../store/types";
import { dialog } from "./dialog";
import { readFile, saveFile } from "./files";
import { openCell, openFirst, openRobot } from "../store/open";

/** New, open, save and rename; and the examples. */
export function ProjectMenu() {
  const [known, setKnown] = useState<{ summary: string; value: ApiRequest }[] | null>(null);
  const load = () => void (known ?? examples().then(setKnown, (error) => tell(error)));
  const create = trying(() => openRobot(robotName(request.value), false));
  const { field } = useDraft(project.value.name);
  const pick = (index: string) => {
    const example = known?.[Number(index)];
    if (index === "first") void openFirst();
    else if (index === "robot") trying(() => openRobot(robotName(request.value), true))();
    else if (example) void openCell({ request: example.value }, example.summary, false);
  };
  return (
    <>
      <input
        type="text"
        class="project-name"
        aria-label="Name of the project"
        {...field}
        onChange={(event) =>
          (project.value = { ...project.value, name: projectName(event.currentTarget.value) })
        }
      />
      <Menu label="" name="Project" icon="down" quiet id="project">
        <Button kind="quiet" icon="plus" onClick={create}>
          New cell
        </Button>
        <Button kind="quiet" onClick={() => (dialog.value = "projects")}>
          Open a project …
        </Button>
        <Button kind="quiet" onClick={saveFile}>
          Save as a file
        </Button>
        <label class="button quiet">
          Open a file …
          <input
            type="file"
            class="unseen"
            id="open-file"
            accept=".json,application/json"
            onChange={(event) => {
              const file = event.currentTarget.files?.[0];
              event.currentTarget.value = "";
              if (file) void readFile(file);
            }}
          />
        </label>
        <label class="examples">
          Example{" "}
          <select
            id="examples"
            value=""
            onFocus={load}
            onMouseDown={load}
            onChange={(event) => pick(event.currentTarget.value)}
          >
            <option value="">choose …</option>
            <option value="robot">First move of this robot</option>
            <option value="first">From a bin to a shelf</option>
            {known?.map(({ summary }, k) => (
              <option key={summary} value={k}>
                {summary}
              </option>
            ))}
          </select>
        </label>
        <Button kind="quiet" onClick={() => (dialog.value = "keys")}>
          Keyboard shortcuts …
        </Button>
      </Menu>
    </>
  );
}
