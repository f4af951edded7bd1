import { describe, expect, it } from "vitest";
import {
  asKind,
  asKindAgain,
  duplicated,
  moved,
  ownFields,
  withObstacle,
  withoutRow,
  withRobot,
  withSpeed,
  withStop,
} from "../src/store/edits";
import { extentOf } from "../src/picture/shapes";
import { at, located, put } from "../src/store/pointer";
import {
  kindOf,
  lackOf,
  likelyUnit,
  rowsOf,
  sixOf,
  targetAt,
  withNumber,
} from "../src/store/request";
import type { ApiRequest, Pose, Robot } from "../src/store/types";
import { withTime } from "../src/task/TimeField";
import { MOVE } from "./cells";

const cycle = withStop(
  withStop(asKind(MOVE, "cycle"), { q: [1, 2, 3, 4, 5, 6] }, "pick 1"),
  null,
  "pick 1",
);
const names = (request: ApiRequest) => rowsOf(request).map(({ name }) => name);
const row = (request: ApiRequest, name: string) =>
  rowsOf(request).find((each) => each.name === name)!;

describe("kinds", () => {
  it("a move with a stop becomes a cycle that ends in it", () => {
    expect(kindOf(cycle)).toBe("cycle");
    expect(names(cycle)).toEqual(["Start", "goal", "pick 1", "pick 2"]);
    expect("goal" in cycle).toBe(false);
  });
  it("and a cycle a move to its last stop", () => {
    const back = asKind(cycle, "move");
    expect(back.goal).toEqual({ q: [1, 2, 3, 4, 5, 6] });
    expect(asKind(asKind(MOVE, "cycle"), "move")).toEqual(MOVE);
  });
  it("a cycle comes back with its stops, and ends where the move ended", () => {
    const { stops } = cycle;
    const back = asKindAgain(asKind(cycle, "move"), "cycle", ownFields(cycle));
    expect(back).toEqual(cycle);
    const other = { ...asKind(cycle, "move"), goal: { q: [6, 5, 4, 3, 2, 1] } };
    const moved = asKindAgain(other, "cycle", ownFields(cycle)).stops!;
    expect(moved.map(({ name }) => name)).toEqual(stops!.map(({ name }) => name));
    expect(moved[1]!.target).toEqual(other.goal);
  });
  it("a move comes back with its time", () => {
    const timed = { ...MOVE, duration: 3 };
    const back = asKindAgain(asKind(timed, "cycle"), "move", ownFields(timed));
    expect(back).toEqual(timed);
  });
  it("a path keeps its ends", () => {
    const path = asKind(MOVE, "path");
    expect([kindOf(path), path.goal]).toEqual(["path", MOVE.goal]);
  });
});

describe("stops", () => {
  it("are duplicated under names of their own", () => {
    expect(names(duplicated(cycle, row(cycle, "pick 1")))).toEqual([
      "Start",
      "goal",
      "pick 1",
      "pick 3",
      "pick 2",
    ]);
  });
  it("are moved and deleted", () => {
    expect(names(moved(cycle, row(cycle, "pick 2"), -1))).toEqual([
      "Start",
      "goal",
      "pick 2",
      "pick 1",
    ]);
    expect(moved(cycle, row(cycle, "goal"), -1).stops).toEqual(cycle.stops);
    expect(names(withoutRow(cycle, row(cycle, "goal")))).toEqual(["Start", "pick 1", "pick 2"]);
  });
  it("what lacks is told", () => {
    expect(lackOf(cycle)?.text).toContain("pick 2 is empty");
    expect(lackOf(MOVE)).toBeNull();
    expect(lackOf(put(MOVE, "/goal", undefined))?.pointer).toBe("/goal");
  });
});

describe("poses", () => {
  const pose = at(MOVE, "/goal/pose") as Pose;
  it("are shown as on the pendant", () => {
    expect(sixOf(pose)).toEqual([-0.35, -0.52, 0.45, expect.closeTo(Math.PI / 2), 0, 0]);
  });
  it("keep the form of their orientation until it is edited", () => {
    expect(withNumber(pose, 2, 0.5)).toEqual({ ...pose, position: [-0.35, -0.52, 0.5] });
    expect(withNumber(pose, 4, 0.1)).toEqual({
      position: pose.position,
      rotvec: [expect.closeTo(Math.PI / 2), 0.1, 0],
    });
  });
});

it("values of wrong types are read as something else", () => {
  for (const goal of [3, null, { q: "x" }, { pose: { position: 1 } }, []]) {
    const wrong = { ...MOVE, goal } as ApiRequest;
    expect(["other", "empty"]).toContain(targetAt(wrong, row(wrong, "Goal")).kind);
  }
  expect(names({ stops: 3 } as unknown as ApiRequest)).toEqual(["Start"]);
});

it("pointers set and delete without changing what was", () => {
  const next = put(MOVE, "/limits/tcp_speed", 0.5);
  expect([at(next, "/limits/tcp_speed"), "limits" in MOVE]).toEqual([0.5, false]);
  expect(put(next, "/limits/tcp_speed", undefined)).toEqual(MOVE);
  expect(put(MOVE, "/duration/max", undefined)).toEqual(MOVE);
});

it("errors are located at the field that a request has", () => {
  expect(located(MOVE, ["body", "payload", "mass"])).toBe("/payload/mass");
  expect(located(MOVE, ["body", "goal", "pose", "rpy", "position", 2])).toBe(
    "/goal/pose/position/2",
  );
  expect(located(MOVE, ["body", "goal", "PoseTarget", "pose", "position", 1])).toBe(
    "/goal/pose/position/1",
  );
  expect(located(MOVE, ["body", "payload", "inertia"])).toBe("/payload/inertia");
});

it("obstacles have names of their own", () => {
  const two = withObstacle(withObstacle(MOVE, { shape: "box" }, "box"), { shape: "box" }, "box");
  expect(two.scene?.obstacles?.map(({ name }) => name)).toEqual(["table", "box", "box 2"]);
});

it("names that a table or a file gives stay as they are", () => {
  const listed = withStop(withStop(asKind(MOVE, "cycle"), null, "press"), null, "press");
  expect(names(listed).slice(-2)).toEqual(["press", "press 2"]);
});

it("a mesh file larger than any fixture in metres is one in millimetres", async () => {
  const facet = (x: number, y: number) =>
    `facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex ${x} 0 0\nvertex 0 ${y} 40\nendloop\nendfacet\n`;
  const read = (text: string) => extentOf("stl", new TextEncoder().encode(text));
  const extent = await read(`solid cad\n${facet(300, 200)}endsolid cad\n`);
  expect(extent).toEqual([300, 200, 40]);
  expect([likelyUnit(extent!), likelyUnit([0.3, 0.2, 0.04])]).toEqual([0.001, 1]);
  expect(await read("solid empty\nendsolid empty\n").catch(() => null)).toBeNull();
});

it("a move keeps its branches at its goal as a cycle, and has its own turns again as a move", () => {
  const branch = { wrist: "no_flip" };
  const move = { ...MOVE, branch, windings: false };
  const cycle = asKind(move, "cycle");
  expect(cycle.stops).toEqual([{ name: "goal", target: MOVE.goal, branch }]);
  expect(cycle.branch).toEqual(branch);
  expect("windings" in cycle).toBe(false);
  expect(asKindAgain(cycle, "move", ownFields(move))).toEqual(move);
});

const robot = (name: string, low: number[], high: number[], example_move: unknown = null) =>
  ({
    name,
    joints: low.map((_, k) => `joint ${k}`),
    limits: { position_min: { value: low }, position_max: { value: high } },
    example_move,
  }) as unknown as Robot;

it("another robot takes what fits it", () => {
  const two = robot("two", [-1, -3], [2, -1]);
  const asked = { robot: "ur5e", start: { q: [1, 2, 3] }, goal: MOVE.goal, figures: "own" };
  expect(withRobot(asked, two, null)).toEqual({
    robot: "two",
    start: { q: [0.5, -2] },
    goal: MOVE.goal,
  });
});

it("a robot starts with its own example move, unless joints were given that it can reach", () => {
  const first = robot("first", [-3, -3], [3, 3], { start: [0, 1], goal: [1, 1] });
  const second = robot("second", [-3, -3], [3, 0], { start: [0, -1], goal: [2, -1] });
  const of = (start: number[], goal: number[]) => ({ start: { q: start }, goal: { q: goal } });
  const taken = (start: number[], goal: number[]) =>
    withRobot({ robot: "first", ...of(start, goal) }, second, first);
  expect(taken([0, 1], [1, 1])).toEqual({ robot: "second", ...of([0, -1], [2, -1]) });
  expect(taken([0.5, -2], [0.5, 2])).toEqual({ robot: "second", ...of([0.5, -2], [2, -1]) });
});

it("a held speed of the TCP is its least one too, and keeps its ramps", () => {
  const path = asKind(MOVE, "path");
  const speedOf = (asked: ApiRequest) => at(asked, "/path/speed");
  const limited = withSpeed(path, 0.1, false);
  expect(speedOf(limited)).toBe(0.1);
  const held = put(withSpeed(limited, 0.1, true), "/path/speed/ramp", 0.03);
  expect(speedOf(held)).toEqual({ min: 0.1, max: 0.1, ramp: 0.03 });
  expect(speedOf(withSpeed(held, 0.2, true))).toEqual({ min: 0.2, max: 0.2, ramp: 0.03 });
  expect(speedOf(withSpeed(held, 0.2, false))).toBe(0.2);
  expect(at(withSpeed(held, undefined, false), "/path")).toEqual({});
});

it("another kind of time begins with the seconds of before", () => {
  expect(withTime(MOVE, "exact", null, 1.234).duration).toBe(1.24);
  expect(withTime(MOVE, "most", 8).duration).toEqual({ max: 2 });
  expect(withTime(MOVE, "period", 8, 1.2).dwell).toEqual({ time: 8 });
  expect(withTime({ ...cycle, time: 5 }, "most", 8, 4).time).toEqual({ max: 5 });
  expect(withTime({ ...MOVE, dwell: { time: 6 } }, "free", null)).toEqual(MOVE);
});
