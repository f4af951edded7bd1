import { expect, it } from "vitest";
import { gapOf } from "../src/answer/Legs";
import { heightsOf } from "../src/charts/LegTimeline";
import type { Leg } from "../src/store/types";

const leg = (electrical: number, lower_bound: number, more = {}) =>
  ({ answer: "/answers/1", electrical, lower_bound, mechanical: 6, ...more }) as unknown as Leg;

it("a leg has a gap only where its bound says something", () => {
  expect(gapOf(leg(11, 10), "electrical")).toBe("10 %");
  expect(gapOf(leg(0.05, 0.001), "electrical")).toBe("–"); // fifty times the bound
  expect(gapOf(leg(0.05, 0), "electrical")).toBe("–");
  expect(gapOf(leg(-5, -5.5), "electrical")).toBe("–"); // it gives energy back
  expect(gapOf(leg(11, 10, { answer: null }), "electrical")).toBe("–"); // a rest
});

it("the gap of a leg is that of the energy that was minimised", () => {
  expect(gapOf(leg(11, 5), "mechanical")).toBe("20 %");
});

it("legs are as high as their mean powers, and those of little energy can still be chosen", () => {
  const of = (...powers: number[]) =>
    heightsOf(powers.map((power) => ({ electrical: 2 * power, duration: 2 })));
  expect(of(100, 50, 0, -20)).toEqual([100, 50, 8, 8]);
  expect(of(-10, -20)).toEqual([8, 8]);
  expect(
    heightsOf([
      { electrical: 1, duration: 1 },
      { electrical: 0, duration: 0 },
    ]),
  ).toEqual([100, 8]);
});
