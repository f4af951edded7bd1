import { Button } from "../ui/Button";
import { ReportMenu } from "../ui/ReportMenu";
import { alone } from "../store/alone";
import { reportAnswer } from "../store/report";
import { link, presentCell } from "../store/share";
import {
  answered,
  canRedo,
  canUndo,
  page,
  placing,
  redo,
  saved,
  stale,
  toast,
  trouble,
  undo,
  type Page,
} from "../store/state";
import { trying } from "../store/trouble";
import { dialog } from "./dialog";
import { ProjectMenu } from "./ProjectMenu";

const PAGES: { value: Page; text: string }[] = [
  { value: "cell", text: "Cell" },
  { value: "jobs", text: "Jobs" },
  { value: "logs", text: "Logs" },
  { value: "library", text: "Library" },
];
const SAVED = {
  "": "",
  saving: "Saving …",
  saved: "Saved in this browser",
  elsewhere: "Changed in another tab: reload the page",
  failed: "Not saved: this browser stores no data",
};

/** Puts the cell into the address of the page, and the address into the clipboard. */
async function share(): Promise<void> {
  const address = await link(presentCell(), location.href);
  history.replaceState(history.state, "", address);
  try {
    await navigator.clipboard.writeText(address);
    toast.value = "The link is copied, and is now the address of this page.";
  } catch {
    toast.value = "The link is now the address of this page: copy the address.";
  }
}

/** What went wrong elsewhere is not of the next page. */
function open(next: Page): void {
  trouble.value = null;
  page.value = next;
}

/** Where one is, what one works on, and what leaves the page. */
export function TopBar() {
  const ready = Boolean(answered.value) && !stale.value;
  return (
    <header class="top">
      <h1 class="brand">
        <svg viewBox="0 0 18 18" aria-hidden="true">
          <rect width="18" height="18" rx="5" />
          <path d="M4.5 12.5C6 5.5 9.5 11 13.5 5" />
        </svg>
        joulepath
      </h1>
      {!alone && (
        <>
          <nav class="pages" aria-label="Pages">
            {PAGES.map(({ value, text }) => (
              <button
                type="button"
                key={value}
                aria-current={page.value === value ? "page" : undefined}
                onClick={() => open(value)}
              >
                {text}
              </button>
            ))}
          </nav>
          {page.value === "cell" && (
            <div class="project">
              <ProjectMenu />
              <small class="saved" id="saved">
                {SAVED[saved.value]}
              </small>
              <Button
                kind="quiet"
                icon="undo"
                label="Undo"
                id="undo"
                disabled={!canUndo.value}
                onClick={undo}
              />
              <Button
                kind="quiet"
                icon="redo"
                label="Redo"
                id="redo"
                disabled={!canRedo.value}
                onClick={redo}
              />
            </div>
          )}
          <span class="space" />
          <a class="button quiet" href="docs">
            API
          </a>
        </>
      )}
      {alone && <span class="space" />}
      {page.value === "cell" && (
        <>
          {!alone && (
            <Button kind="quiet" icon="share" id="share" onClick={trying(share)}>
              Share
            </Button>
          )}
          {!alone && ready && <ReportMenu write={reportAnswer} />}
          <Button
            kind={ready && !placing.value ? "primary" : undefined}
            icon="download"
            id="export"
            disabled={!ready}
            title={ready ? "Ctrl E" : "Optimise first"}
            onClick={() => (dialog.value = "export")}
          >
            Export…
          </Button>
        </>
      )}
    </header>
  );
}
