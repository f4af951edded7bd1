import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { fileOf, report, reports } from "../src/store/report";

const fetchOf = globalThis.fetch;
let answer: (response: Response) => void;
let refuse: (error: Error) => void;
let saved: string[];

beforeEach(() => {
  saved = [];
  vi.stubGlobal("document", {
    createElement: () => ({
      click() {},
      remove() {},
      set download(name: string) {
        saved.push(name);
      },
    }),
    body: { append() {} },
  });
  vi.stubGlobal(
    "fetch",
    (_: string, { signal }: RequestInit) =>
      new Promise((resolve, reject) => {
        [answer, refuse] = [resolve, reject];
        signal!.addEventListener("abort", () => reject(signal!.reason));
      }),
  );
});

afterEach(() => {
  for (const each of reports.value) each.dismiss();
  vi.unstubAllGlobals();
});

const states = () => reports.value.map(({ state }) => state);

it("a report is told of while it is written, and stays to be opened", async () => {
  const written = report({ job: "1" }, "Line 2", "pdf");
  expect(states()).toEqual(["writing"]);
  answer(new Response("%PDF"));
  await written;
  expect(states()).toEqual(["saved"]);
  expect([saved, fileOf(reports.value[0]!)]).toEqual([["line-2.pdf"], "line-2.pdf"]);
  expect(await (await fetchOf(reports.value[0]!.address)).text()).toBe("%PDF");
  reports.value[0]!.dismiss();
  expect(states()).toEqual([]);
});

it("an error stays, and the report is asked for again", async () => {
  const failed = report({ job: "1" }, "Line 2", "html");
  answer(new Response(JSON.stringify({ detail: "No such job." }), { status: 404 }));
  await failed;
  expect(reports.value.map(({ why }) => why)).toEqual(["No such job."]);
  const again = reports.value[0]!.again();
  expect(states()).toEqual(["writing"]);
  refuse(new TypeError("offline"));
  await again;
  expect(reports.value[0]!.why).toContain("cannot be reached");
});

it("a report that is cancelled leaves nothing", async () => {
  const first = report({ job: "1" }, "One", "html");
  const second = report({ job: "2" }, "Two", "html");
  reports.value[0]!.dismiss();
  await first;
  expect(reports.value.map(({ title }) => title)).toEqual(["Two"]);
  answer(new Response("<p>"));
  await second;
  expect(saved).toEqual(["two.html"]);
});
