import { expect, it } from "vitest";
import { movejProgram } from "../src/export/movej";
import type { Answered } from "../src/store/state";

const PART = { mass: 2, com: [0, 0, 0.1] };
const leg = (kind: string, stop: string, duration = 1) => ({
  kind,
  goal: { stop, q: [0, 0], label: "" },
  duration,
});

/** From the start to pick, stand, to place, stand, and back; `loads` as the answer has them. */
const SHOWN = {
  solution: { branch: { start: { q: [0, 0] }, goal: { q: [0, 0] } } },
  cell: {},
  cycle: {
    legs: [
      leg("move", "pick"),
      leg("dwell", "pick", 0.3),
      leg("move", "place"),
      leg("dwell", "place", 0.3),
      leg("move", "start"),
    ],
    loads: [null, PART, PART, null, null].map((payload, t0) => ({ t0, payload, ignored: [] })),
  },
} as unknown as Answered;

it("a part is put down where it belongs, not at the end of the way back", () => {
  const program = movejProgram(SHOWN, 1, 3, null);
  const at = (stop: string) => program.split(`# ${stop}\n`)[1]!.split("# ")[0]!;
  expect(at("pick")).toMatch(
    /out\(3, True\)\n  sleep\(0.3\)\n  set_target_payload\(2, \[0, 0, 0.1\]\)/,
  );
  expect(at("place")).toMatch(/out\(3, False\)\n  sleep\(0.3\)\n  set_target_payload\(0,/);
  expect(program.split("# place")[1]!.split("# start")[1]).not.toMatch(/out|payload/);
});

it("the payload of the start is set before the arm moves there", () => {
  const [head] = movejProgram(SHOWN, 1, null, null).split("movej([");
  expect(head).toContain("set_target_payload(0,");
});
