import { useEffect, useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { Dialog } from "../ui/Dialog";
import { deleteProject, projects, saveNow, type Saved } from "../store/persist";
import { project } from "../store/state";
import { when } from "../store/units";
import { openProject } from "../store/open";

/** The projects of this browser. */
export function ProjectsDialog({ onClose }: { onClose: () => void }) {
  const [all, setAll] = useState<Saved[] | null>(null);
  const [filter, setFilter] = useState("");
  useEffect(() => {
    void saveNow()
      .then(projects)
      .then(setAll, () => setAll([]));
  }, []);
  const open = (each: Saved) => {
    onClose();
    void openProject(each);
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
      {all && !shown.length && <p class="hint">None.</p>}
      <ul class="kept">
        {shown.map((each) => (
          <li key={each.id}>
            <button
              type="button"
              class="choice"
              aria-current={each.id === project.value.id ? "true" : undefined}
              onClick={() => open(each)}
            >
              <b>{each.name}</b>
              <small>
                {when(new Date(each.savedAt).toISOString())}
                {each.id === project.value.id ? " · open" : ""}
              </small>
            </button>
            {each.id !== project.value.id && (
              <Button
                kind="quiet"
                icon="trash"
                label={`Delete ${each.name}`}
                onClick={() => drop(each)}
              />
            )}
          </li>
        ))}
      </ul>
    </Dialog>
  );
}
