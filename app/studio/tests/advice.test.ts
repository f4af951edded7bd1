import { expect, it } from "vitest";
import { ofCycle } from "../src/answer/Baselines";
import { waits, wordsOf, type Change } from "../src/answer/advice";
import type { Answered } from "../src/store/state";
import type { ApiRequest } from "../src/store/types";

const change: Change = {
  name: "without_home",
  energy: 607.2,
  instead_of: 755.7,
  share: 0.1965,
  duration: 11.42,
  request: null,
};

const way = (energy: number, duration = 1) => ({ energy, duration });

it("every change says its joules", () => {
  expect(wordsOf(change)).toBe("Omit the start position: 607 J in 11.4 s, 20 % less.");
  expect(wordsOf({ ...change, name: "brakes", share: 0.0533 })).toMatch(
    /at rest: 607 J, 5.3 % less/,
  );
});

it("a saving is one of the cycle where the motion waits", () => {
  expect(ofCycle(0.07, way(74.4), way(80), 0)).toBeCloseTo(0.07);
  // 80 J against 74.4 J, and 209 J of waiting for both
  expect(ofCycle(0.07, way(74.4), way(80), 209)).toBeCloseTo(5.6 / 289, 3);
  expect(ofCycle(-0.1, way(110), way(100), 90)).toBeCloseTo(-10 / 190);
  // the longer way has waited less: 93 J against 74 J and 20 J of waiting, then 80 J for both
  expect(ofCycle(1 - 94 / 93, way(74), way(93, 1.5), 100)).toBeCloseTo(-1 / 173);
});

it("a motion waits that is shorter than its cycle time and has no wait of its own", () => {
  const shown = (asked: ApiRequest) => ({ asked, solution: { duration: 2 } }) as Answered;
  expect(waits(shown({}), 6)).toBe(true);
  expect(waits(shown({ dwell: null }), 6)).toBe(true);
  expect([waits(shown({}), 1.5), waits(shown({}), null)]).toEqual([false, false]);
  expect(waits(shown({ dwell: { time: 3 } }), 6)).toBe(false);
  expect(waits(shown({ time: { max: 4 } }), 6)).toBe(true);
});
