import { useEffect, useState } from "preact/hooks";
import { Dialog } from "../ui/Dialog";
import { KeptRow } from "../ui/KeptRow";
import { deleteProject, projects, renameProject, saveNow, type Saved } from "../store/persist";
import { kindOf, listOf, robotName } from "../store/request";
import { project } from "../store/state";
import type { ApiRequest } from "../store/types";
import { when } from "../store/units";
import { openProject } from "../store/open";

/** What a cell is, to tell it from others of its name. */
function cellText(asked: ApiRequest): string {
  const kind = kindOf(asked);
  const count = listOf(asked.stops).length;
  const stops = count === 1 ? "1 stop" : `${count} stops`;
  return `${robotName(asked)}, ${kind === "cycle" ? stops : kind}`;
}

/** The projects of this browser. */
export function ProjectsDialog({ onClose }: { onClose: () => void }) {
  const [all, setAll] = useState<Saved[] | null>(null);
  const [filter, setFilter] = useState("");
  useEffect(() => {
    void saveNow()
      .then(projects)
      .then(setAll, () => setAll([]));
  }, []);
  const isOpen = ({ id }: Saved) => id === project.value.id;
  const open = async (each: Saved) => {
    onClose();
    await openProject(each);
  };
  const rename = async (each: Saved, name: string | null) => {
    if (!name) return;
    const kept = await renameProject(each, name);
    setAll((all ?? []).map((one) => (one === each ? { ...each, name: kept } : one)));
  };
  const drop = async (each: Saved) => {
    await deleteProject(each.id);
    setAll((all ?? []).filter(({ id }) => id !== each.id));
  };
  const shown = (all ?? []).filter(({ name }) => name.toLowerCase().includes(filter.toLowerCase()));
  return (
    <Dialog title="Projects in this browser" onClose={onClose}>
      <input
        type="search"
        class="search"
        aria-label="Search projects"
        placeholder="Search"
        value={filter}
        onInput={(event) => setFilter(event.currentTarget.value)}
      />
      {all && !shown.length && <p class="hint">No project found.</p>}
      <ul class="kept">
        {shown.map((each) => (
          <KeptRow
            key={each.id}
            name={each.name}
            facts={`${cellText(each.request)} · ${when(new Date(each.savedAt).toISOString())}${isOpen(each) ? " · open" : ""}`}
            current={isOpen(each)}
            onOpen={() => open(each)}
            onRename={(name) => rename(each, name)}
            onDelete={isOpen(each) ? undefined : () => drop(each)}
          />
        ))}
      </ul>
    </Dialog>
  );
}
