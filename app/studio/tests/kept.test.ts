import "fake-indexeddb/auto";
import { beforeAll, expect, it, vi } from "vitest";
import {
  askedFor,
  deleteProject,
  followChanges,
  jobNotes,
  keepJob,
  projects,
  renameProject,
  saveNow,
} from "../src/store/persist";
import { DEFAULT_ECONOMICS } from "../src/store/economics";
import { openKept } from "../src/store/open";
import { cellOf, link, presentCell, shared } from "../src/store/share";
import {
  answered,
  replaceCell,
  request,
  saved,
  toast,
  typed,
  write,
  type Answered,
} from "../src/store/state";
import { MOVE } from "./cells";

vi.mock("../src/store/run", () => ({ showAnswer: () => Promise.resolve() }));

beforeAll(() => {
  vi.stubGlobal("window", new EventTarget());
  followChanges();
});

it("a project is saved by itself, as it was typed", async () => {
  replaceCell({ project: { id: "a", name: "bin" }, request: MOVE });
  write("/payload/mass", 1.6, "1,60");
  await vi.waitFor(() => expect(saved.value).toBe("saved"), 3000);
  const [project] = await projects();
  expect(project).toMatchObject({
    id: "a",
    name: "bin",
    typed: { "/payload/mass": "1,60" },
    request: { payload: { mass: 1.6 } },
  });
  await deleteProject("a");
  expect(await projects()).toEqual([]);
});

/** Another tab saves the project with another mass. */
async function savedElsewhere(mass: number): Promise<void> {
  const [record] = await projects();
  const asked = indexedDB.open("joulepath studio", 1);
  await vi.waitFor(() => expect(asked.readyState).toBe("done"));
  const store = asked.result.transaction("projects", "readwrite").objectStore("projects");
  const put = store.put({ ...record, request: { ...MOVE, payload: { mass } } });
  await vi.waitFor(() => expect(put.readyState).toBe("done"));
}
const kept = async () =>
  Object.fromEntries((await projects()).map(({ name, request }) => [name, request.payload?.mass]));

it("a tab without changes does not overwrite what another tab has saved", async () => {
  replaceCell({ project: { id: "t", name: "tabs" }, request: MOVE });
  await saveNow();
  await savedElsewhere(3);
  await saveNow(); // as when it is closed
  expect([await kept(), saved.value]).toEqual([{ tabs: 3 }, "elsewhere"]);
  write("/payload/mass", 2, "2");
  await saveNow();
  await vi.waitFor(async () => expect(await kept()).toEqual({ tabs: 3, "tabs 2": 2 }), 3000);
  expect(toast.value).toContain("your version is now tabs 2");
  for (const { id } of await projects()) await deleteProject(id);
});

it("the request of an answer is known again by its id", async () => {
  replaceCell({ project: { id: "b", name: "b" }, request: MOVE });
  write("/payload/mass", 2, "2,0");
  answered.value = {
    asked: { ...MOVE, payload: { mass: 2 } },
    solution: { id: "answer-1" },
  } as Answered;
  await vi.waitFor(async () =>
    expect(await askedFor("answer-1")).toMatchObject({
      request: { payload: { mass: 2 } },
      typed: { "/payload/mass": "2,0" },
    }),
  );
  expect(await askedFor("answer-2")).toBeNull();
  await saveNow();
  expect((await projects())[0]).toMatchObject({ answer: "answer-1" });
  answered.value = null;
});

it("a kept answer that this browser has not asked for comes back as it was typed", async () => {
  const branch = { start: { q: [0] }, goal: { q: [1] } };
  const kept = {
    name: "Night cell",
    request: MOVE as typeof MOVE | null,
    typed: { "/payload/mass": "0,80" } as Record<string, string> | null,
    answer: { id: "answer-9", robot: "ur5e", arm: null, branch },
  };
  vi.stubGlobal("fetch", () => Promise.resolve(Response.json(kept)));
  await openKept("answer-9");
  expect([request.value, typed.value]).toEqual([MOVE, { "/payload/mass": "0,80" }]);
  kept.request = kept.typed = null; // a move of a cycle
  await openKept("/answers/answer-9");
  expect(request.value).toEqual({ robot: "ur5e", ...branch });
  expect(typed.value).toEqual({});
});

it("what the moves of a job carry is kept", async () => {
  await keepJob({
    id: "j",
    source: "moves.csv",
    masses: [1.5, null],
    requests: [MOVE],
  });
  expect((await jobNotes("j"))?.masses).toEqual([1.5, null]);
});

it("a link brings the whole cell back", async () => {
  replaceCell({ project: { id: "c", name: "cell" }, request: MOVE });
  write("/goal/pose/position/2", 0.5, "500,0");
  const address = await link(presentCell(), "http://cell/studio");
  expect((await shared(new URL(address).hash)).cell).toEqual(presentCell());
  await expect(shared(new URL(address.slice(0, -20)).hash)).rejects.toThrow(
    "A part of the link is missing",
  );
  expect(await shared("#answer=x")).toEqual({ answer: "x" });
  expect(await shared("")).toEqual({});
});

it("a file holds a project or a request", () => {
  expect(cellOf(JSON.stringify(MOVE)).request).toEqual(MOVE);
  expect(cellOf(JSON.stringify(presentCell()))).toEqual(presentCell());
  for (const text of ["3", "[]", "null", "{"]) expect(() => cellOf(text)).toThrow();
});

it("a file of another program or version is opened as far as it holds a project", () => {
  const price = { value: 0.3, source: "yours" };
  const { cycleTime, carbon, ...defaults } = DEFAULT_ECONOMICS;
  const read = cellOf(
    JSON.stringify({
      name: 5,
      request: MOVE,
      typed: { "/payload/mass": 5, "/goal/pose/position/2": "450,0", "/duration": null },
      economics: { cycle: "6", shift: null, shiftsPerYear: -3, price, carbon: 0.2, box: {} },
    }),
  );
  expect(read).toEqual({
    request: MOVE,
    typed: { "/goal/pose/position/2": "450,0" },
    economics: { ...defaults, cycleTime, carbon, price },
  });
  // the cycle time had another name once
  const old = { ...defaults, carbon, price, cycle: 6 };
  expect(cellOf(JSON.stringify({ request: MOVE, economics: old })).economics?.cycleTime).toBe(6);
  for (const typed of [3, null, ["a"]])
    expect(cellOf(JSON.stringify({ request: MOVE, typed, economics: typed }))).toEqual({
      request: MOVE,
      typed: {},
    });
});

it.each([
  [{ hello: "world" }, "Neither targets nor a robot"],
  [{ request: [1] }, "Neither targets nor a robot"],
  [{ robot: "ur5e", trajectory: { t: [] } }, "an answer"],
  [{ robot: "ur5e", legs: [] }, "an answer"],
])("a file that holds no request is refused: %o", (held, why) => {
  expect(() => cellOf(JSON.stringify(held))).toThrow(why);
});

it("the project that was saved last is the first, after a clock was set back", async () => {
  vi.spyOn(Date, "now").mockReturnValueOnce(Date.now() + 864e5);
  replaceCell({ project: { id: "v", name: "tomorrow" }, request: MOVE });
  await saveNow();
  replaceCell({ project: { id: "w", name: "today" }, request: MOVE });
  await saveNow();
  expect((await projects())[0]!.name).toBe("today");
});

it("a browser without room says that nothing is saved", async () => {
  const put = vi.spyOn(IDBObjectStore.prototype, "put").mockImplementation(function (
    this: IDBObjectStore,
  ) {
    // Chromium ends the transaction after its requests
    queueMicrotask(() => this.transaction.abort());
    return {} as IDBRequest<IDBValidKey>;
  });
  replaceCell({ project: { id: "x", name: "big" }, request: MOVE });
  await saveNow();
  expect(saved.value).toBe("failed");
  put.mockRestore();
  await saveNow();
  expect(saved.value).toBe("saved");
});

it("a project has another name, whether it is open or not", async () => {
  replaceCell({ project: { id: "m", name: "closed" }, request: MOVE });
  await saveNow();
  replaceCell({ project: { id: "n", name: "open" }, request: MOVE });
  await saveNow();
  const named = async (id: string) => (await projects()).find((each) => each.id === id)!;
  await renameProject(await named("m"), "shut");
  await renameProject(await named("n"), "ajar");
  await saveNow();
  expect((await named("m")).name).toBe("shut");
  expect((await named("n")).name).toBe("ajar");
});
