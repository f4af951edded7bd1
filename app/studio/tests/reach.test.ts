import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { followReach, reached } from "../src/store/reach";
import { deadlineOf } from "../src/store/request";
import { edit } from "../src/store/state";
import { leftOf } from "../src/ui/Progress";
import { MOVE } from "./cells";

const answers: [number, unknown][] = [];

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal("fetch", () => {
    const [status, body] = answers.shift()!;
    return Promise.resolve(new Response(JSON.stringify(body), { status }));
  });
});
afterEach(() => vi.useRealTimers());

it("a pose is asked about again after the service was busy, and not where a field is wrong", async () => {
  answers.push([503, { status: 503 }], [504, { status: 504 }], [200, { solutions: [] }]);
  followReach();
  edit(MOVE);
  await vi.advanceTimersByTimeAsync(400);
  expect(reached.value).toEqual({ "/goal": { state: "asking" } });
  await vi.advanceTimersByTimeAsync(7000);
  expect(reached.value).toEqual({ "/goal": { state: "reached", solutions: [] } });
  answers.push([422, { status: 422, errors: [{ loc: ["body", "scene"], msg: "No." }] }]);
  edit({ ...MOVE, robot: "ur10e" });
  await vi.advanceTimersByTimeAsync(10_000);
  expect(reached.value).toEqual({});
  answers.push([422, { status: 422, detail: "The pose is 0.4 m out of reach." }]);
  edit({ ...MOVE, robot: "ur3e" });
  await vi.advanceTimersByTimeAsync(400);
  expect(reached.value).toEqual({
    "/goal": { state: "refused", text: "The pose is 400 mm out of reach." },
  });
});

it("the time left is that of the search, and never beyond the deadline", () => {
  expect(leftOf(2, 0.5, 10)).toBe(", about 2 s left");
  expect(leftOf(2, 0.01, 60)).toBe(", at most 58 s left");
  expect(leftOf(2, 0.1, 10)).toBe(", at most 8 s left");
  expect(leftOf(70, 0.1, 60)).toBe(", at most 0 s left");
  expect([leftOf(2, 0, null), leftOf(2, 1, null)]).toEqual(["", ""]);
  expect([deadlineOf(MOVE), deadlineOf({ ...MOVE, deadline: 3 })]).toEqual([10, 3]);
  expect(deadlineOf({ ...MOVE, stops: [{ target: { q: [] } }] })).toBe(60);
});
