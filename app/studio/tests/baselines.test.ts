import { expect, it } from "vitest";
import { reasonOf } from "../src/answer/Baselines";
import type { Baseline } from "../src/store/types";

const way = (more: Partial<Baseline>) => more as Baseline;

it("a way of a cycle says which move breaks what, each limit once", () => {
  const broken = [
    { start: "start", goal: "pick", reason: "unbounded jerk" },
    { start: "pick", goal: "place", reason: "unbounded jerk; post and wrist are 3 mm too close" },
  ];
  expect(reasonOf(way({ broken }))).toBe(
    "unbounded jerk (start → pick, pick → place); post and wrist are 3 mm too close (pick → place)",
  );
  expect(reasonOf(way({ reason: "unbounded jerk" }))).toBe("unbounded jerk");
  expect(reasonOf(way({ reason: null, broken: [] }))).toBe("");
});
