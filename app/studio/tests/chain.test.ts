import { expect, it } from "vitest";
import { Chain } from "../src/store/chain";
import type { Robot } from "../src/store/types";

const figure = (value: unknown) => ({ value });
const origins = [
  [0, 0, 0.3, 0, 0, 0],
  [0.1, 0, 0, 1.57, 0, 0],
  [0.5, 0, 0, 0, 0, 0],
];
const arm = (coupling?: number[][]) =>
  ({
    kinematics: {
      joint_origin: figure(origins),
      flange_origin: figure([0.2, 0, 0, 0, 0, 0]),
      ...(coupling && { coupling: figure(coupling) }),
    },
  }) as unknown as Robot;

it("a joint that follows another turns with it", () => {
  const law = [
    [0, 1, 0],
    [1, 1, 0],
    [1, -1, 0.2],
  ];
  const follows = new Chain(arm(law)).frames([0.4, 0.7]);
  expect(follows).toEqual(new Chain(arm()).frames([0.4, 0.7, -0.7 + 0.2]));
});
