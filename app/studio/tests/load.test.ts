import { expect, it } from "vitest";
import { carried, centreOf, gripped } from "../src/store/load";
import type { ToolDetail } from "../src/store/tools";
import { MOVE } from "./cells";

const TOOL = { mass: { value: 1 }, center_of_mass: { value: [0, 0, 0.06] } } as ToolDetail;
const BOX = { shape: "box", size: [0.1, 0.1, 0.1], pose: { position: [0, 0, 0.2] } };

it("a part without a centre of its own has that of its shape", () => {
  expect(centreOf({ mass: 1, shape: BOX })).toEqual([0, 0, 0.2]);
  expect(centreOf({ mass: 1, shape: BOX, com: [0, 0, 0.1] })).toEqual([0, 0, 0.1]);
  expect(centreOf({ mass: 1, shape: { shape: "mesh", vertices: [] } })).toBeNull();
});

it("a part is gripped at the TCP", () => {
  expect(gripped({ ...MOVE, tcp: { position: [0, 0, 0.15] } })).toEqual([0, 0, 0.15]);
  expect(gripped(MOVE)).toEqual([0, 0, 0.05]);
});

it("the controller is told the part and the gripper as one body", () => {
  const both = carried({ mass: 3, shape: BOX }, TOOL)!;
  expect(both.mass).toBe(4);
  expect(both.com[2]).toBeCloseTo(0.165, 12);
  expect(carried(null, TOOL)).toEqual({ mass: 1, com: [0, 0, 0.06] });
  expect(carried(null, null)).toEqual({ mass: 0, com: [0, 0, 0] });
  expect(carried({ mass: 3, shape: { shape: "mesh" } }, TOOL)).toBeNull();
});
