import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { csvOfJob, lacksDetails, opened, type JobRow, type Opened } from "../src/jobs/model";

const row = (index: number, energy: number | null) =>
  ({ index, name: `move ${index}`, state: energy ? "done" : "failed", energy }) as JobRow;
const JOB = {
  job: { id: "1" },
  rows: [row(0, 50), row(1, null), row(2, 70)],
  notes: null,
  details: null,
} as Opened;
const result = (index: number, total: number) =>
  JSON.stringify({
    index,
    result: {
      duration: 1,
      arm: { payload: { mass: 2 } },
      energy: { electrical: { total, interval: { p5: total - 5, p95: total + 5 } } },
      baselines: [{ name: "ruckig", duration: 1, within_limits: true, saving: 0.5 }],
    },
  });

let asked: string[];
beforeEach(() => {
  asked = [];
  vi.stubGlobal("fetch", (path: string) => {
    asked.push(path);
    return Promise.resolve(new Response([result(0, 50), result(2, 70)].join("\n")));
  });
});
afterEach(() => vi.unstubAllGlobals());

it("the CSV of a job has the intervals of all moves, read or not", async () => {
  opened.value = JOB;
  const lines = (await csvOfJob(JOB)).split("\n");
  expect(lines[1]).toBe("1,move 0,2,done,,50,45,55,ruckig,100,0.5,,");
  expect(lines[2]).toBe("2,move 1,,failed,,,,,,,,,");
  expect(lines[3]).toBe("3,move 2,2,done,,70,65,75,ruckig,140,0.5,,");
  expect(opened.value.details?.size).toBe(2);
  await csvOfJob(opened.value);
  expect(asked).toEqual(["jobs/1/results"]);
});

it("moves that were done after the answers were read lack theirs", async () => {
  opened.value = JOB;
  await csvOfJob(JOB);
  expect(lacksDetails(opened.value)).toBe(false);
  expect(lacksDetails({ ...opened.value, rows: [...JOB.rows, row(3, 20)] })).toBe(true);
});
