// The back button leads through the pages of the studio, and not out of it.
import { expect, it, vi } from "vitest";
import { dialog } from "../src/app/dialog";
import { followHistory } from "../src/app/history";
import { edit, page, replaceCell } from "../src/store/state";
import { MOVE } from "./cells";

it("the back button leads from the library to the cell", () => {
  const entries: unknown[] = [null];
  let back: (event: { state: unknown }) => void = () => undefined;
  vi.stubGlobal("history", {
    replaceState: (state: unknown) => (entries[entries.length - 1] = state),
    pushState: (state: unknown) => entries.push(state),
  });
  vi.stubGlobal("window", {
    addEventListener: (_: string, listener: typeof back) => (back = listener),
  });
  followHistory();
  page.value = "library";
  expect(entries).toEqual([{ page: "cell" }, { page: "library" }]);
  dialog.value = "projects";
  back({ state: entries[0] });
  expect([page.value, dialog.value]).toEqual(["cell", null]);
  expect(entries).toHaveLength(2);
});

it("a page that is loaded again shows what it showed", () => {
  const ignore = () => undefined;
  vi.stubGlobal("history", { state: { page: "logs" }, replaceState: ignore, pushState: ignore });
  vi.stubGlobal("window", { addEventListener: () => undefined });
  followHistory();
  expect(page.value).toBe("logs");
});

it("an edited cell is no longer that of the link in the address", () => {
  const address = { hash: "#r=abc", pathname: "/studio", search: "" };
  const replaced: string[] = [];
  vi.stubGlobal("location", address);
  vi.stubGlobal("window", { addEventListener: () => undefined });
  vi.stubGlobal("history", {
    state: null,
    pushState: () => undefined,
    replaceState: (_: unknown, __: string, url?: string) => url && replaced.push(url),
  });
  followHistory();
  replaceCell({ project: { id: "1", name: "of the link" }, request: MOVE });
  expect(replaced).toEqual([]);
  edit({ ...MOVE, duration: 2 });
  expect(replaced.at(-1)).toBe("/studio");
});
