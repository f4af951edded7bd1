import { expect, it } from "vitest";
import { withoutHome } from "../src/answer/home";
import type { ApiRequest } from "../src/store/types";

const part = { mass: 2, com: [0, 0, 0.1] };
const target = (x: number) => ({ q: [x, 0, 0, 0, 0, 0] });
const round: ApiRequest = {
  start: target(0),
  stops: [
    { name: "pick", target: target(1), payload: part },
    { name: "place", target: target(2), payload: null },
  ],
};

it("a round without the way home begins at its last stop", () => {
  expect(withoutHome(round)).toEqual({ ...round, start: target(2) });
});

it("it is none where the arm would carry something else, or does not come back", () => {
  expect(withoutHome({ ...round, stops: round.stops!.slice(0, 1) })).toBeNull();
  expect(withoutHome({ ...round, payload: part })).toBeNull();
  expect(withoutHome({ ...round, closed: false })).toBeNull();
  expect(withoutHome({ ...round, order: "free" })).toBeNull();
  expect(withoutHome({ ...round, start: target(2) })).toBeNull();
});
