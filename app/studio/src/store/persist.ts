// Projects in this browser: saved half a second after each change, one record each (IndexedDB).
import { effect, untracked } from "@preact/signals";
import { freshName } from "./request";
import { answered, economics, project, request, saved, toast, typed } from "./state";
import { cellFrom, type Cell } from "./share";

export interface Saved extends Cell {
  id: string;
  name: string;
  savedAt: number;
  /** Id of the answer that was shown, and the request that it belongs to. */
  answer: string | null;
  asked: Cell["request"] | null;
}

/** The request of an answer that this browser has asked for. */
interface Asked {
  id: string;
  cell: Cell;
}

const PAUSE = 500;
const MOST_ASKED = 500;
let opened: Promise<IDBDatabase> | null = null;

function database(): Promise<IDBDatabase> {
  opened ??= new Promise((resolve, reject) => {
    const asked = indexedDB.open("joulepath studio", 1);
    asked.onupgradeneeded = () => {
      for (const name of ["projects", "asked", "jobs"])
        asked.result.createObjectStore(name, { keyPath: "id" });
    };
    asked.onsuccess = () => resolve(asked.result);
    asked.onerror = () => reject(asked.error ?? new Error("IndexedDB is not open."));
  });
  return opened;
}

/** Waits for the end of a transaction; a browser without room ends it after its requests. */
const ended = (transaction: IDBTransaction) =>
  new Promise<void>((resolve, reject) => {
    transaction.oncomplete = () => resolve();
    transaction.onabort = () => reject(transaction.error ?? new Error("IndexedDB refused."));
  });

async function within<T>(
  store: string,
  mode: IDBTransactionMode,
  act: (store: IDBObjectStore) => IDBRequest<T>,
): Promise<T> {
  const transaction = (await database()).transaction(store, mode);
  const asked = act(transaction.objectStore(store));
  await ended(transaction);
  return asked.result;
}

export const newId = () =>
  crypto.randomUUID?.() ?? `${Date.now()}-${Math.random().toString(36).slice(2)}`;

/** When the newest project was saved: the next one is newer, even after a clock was set back. */
let newest = 0;

/** All projects, the last saved first. */
export async function projects(): Promise<Saved[]> {
  const all = await within<Saved[]>("projects", "readonly", (store) => store.getAll());
  newest = Math.max(newest, ...all.map(({ savedAt }) => savedAt));
  return all
    .map((each) => ({ ...each, name: "Untitled cell", ...cellFrom({ ...each }) }))
    .sort((a, b) => b.savedAt - a.savedAt);
}

export const deleteProject = (id: string) =>
  within("projects", "readwrite", (store) => store.delete(id));

/** The name of a project as it is kept: without spaces around it, and never empty. */
export const projectName = (typed: string) => typed.trim() || "Untitled cell";

/** Gives a project of this browser another name. */
export async function renameProject(record: Saved, typed: string): Promise<string> {
  const name = projectName(typed);
  if (record.id === project.value.id) project.value = { ...project.value, name };
  else await write({ ...record, name });
  return name;
}

/** What was asked when an answer was computed here; null for answers of others. */
export async function askedFor(id: string): Promise<Cell | null> {
  const found = await within<Asked | undefined>("asked", "readonly", (store) =>
    store.get(id),
  ).catch(() => undefined);
  return found ? cellFrom({ ...found.cell }) : null;
}

async function keepAsked(id: string, cell: Cell): Promise<void> {
  await within("asked", "readwrite", (store) => store.put({ id, cell } satisfies Asked));
  const ids = await within<IDBValidKey[]>("asked", "readonly", (store) => store.getAllKeys());
  if (ids.length > MOST_ASKED) await within("asked", "readwrite", (store) => store.delete(ids[0]!));
}

/** What the page knows of a job that it has started. */
export interface JobNotes {
  id: string;
  source: string;
  /** What each move carries [kg]; null: the payload of the cell. */
  masses: (number | null)[];
  requests: Cell["request"][];
}

export const keepJob = (notes: JobNotes) =>
  within("jobs", "readwrite", (store) => store.put(notes));

export const jobNotes = (id: string) =>
  within<JobNotes | undefined>("jobs", "readonly", (store) => store.get(id)).catch(() => undefined);

const write = (record: Saved) => within("projects", "readwrite", (store) => store.put(record));

function recordNow(): Saved {
  const shown = answered.value;
  return {
    ...project.value,
    savedAt: (newest = Math.max(newest + 1, Date.now())),
    request: request.value,
    typed: typed.value,
    economics: economics.value,
    answer: shown?.asked ? shown.solution.id : null,
    asked: shown?.asked ?? null,
  };
}

/** The request that this tab last read or wrote, as text: another tab may have saved since. */
let known = { id: "", request: "" };

/** Writes a record, unless another tab has saved another request; in one transaction, for a tab that is closed. */
async function writeUnlessChanged(record: Saved): Promise<boolean> {
  const before = known;
  const own = JSON.stringify(record.request);
  const transaction = (await database()).transaction("projects", "readwrite");
  const store = transaction.objectStore("projects");
  const asked = store.get(record.id) as IDBRequest<Saved | undefined>;
  let written = false;
  asked.onsuccess = () => {
    const kept = asked.result && JSON.stringify(asked.result.request);
    written = !(kept && before.id === record.id && kept !== before.request && kept !== own);
    if (written) store.put(record);
  };
  await ended(transaction);
  if (written && known.id === record.id) known = { id: record.id, request: own };
  return written;
}

/** Writes the present project now; as another project, if both this and another tab have changed it. */
export async function saveNow(): Promise<void> {
  if (!project.value.id) return;
  const record = recordNow();
  try {
    const written = await writeUnlessChanged(record);
    saved.value = written ? "saved" : "elsewhere";
    if (written || JSON.stringify(record.request) === known.request) return;
    const others = (await projects()).map(({ name }) => name);
    const name = freshName(record.name, others);
    project.value = { id: newId(), name };
    toast.value = `Another tab has changed ${record.name}: your version is now ${name}.`;
  } catch {
    saved.value = "failed"; // a private window, or no room
  }
}

/** Saves after each change, from now on. */
export function followChanges(): void {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let waiting: Saved | null = null;
  effect(() => {
    void [project.value, request.value, typed.value, economics.value, answered.value];
    untracked(() => {
      const { id } = project.value;
      if (!id) return;
      saved.value = "saving";
      clearTimeout(timer);
      // what was changed just before another cell was opened is not lost
      if (waiting && waiting.id !== id) void writeUnlessChanged(waiting).catch(() => undefined);
      if (known.id !== id) known = { id, request: JSON.stringify(request.value) };
      waiting = recordNow();
      timer = setTimeout(() => {
        waiting = null;
        void saveNow();
      }, PAUSE);
    });
  });
  effect(() => {
    const shown = answered.value;
    const id = shown?.solution.id;
    if (!shown?.asked || !id) return;
    const { asked } = shown;
    untracked(
      () =>
        void keepAsked(id, {
          request: asked,
          typed: typed.value,
          economics: economics.value,
        }).catch(() => undefined),
    );
  });
  window.addEventListener("pagehide", () => void saveNow());
}
