import { beforeEach, describe, expect, it, vi } from "vitest";
import { IDENTITY, inverse, multiply, ofPose } from "../src/store/chain";
import { put } from "../src/store/pointer";
import { accept, regionOf, regionTyped, cycleOf, search } from "../src/store/placement";
import { columnsOf, coordinatesOf, movedTo, pitchOf, worldOf, yawOf } from "../src/store/places";
import type { Place } from "../src/store/places";
import { seenFrom } from "../src/store/seenFrom";
import { knowRobot } from "../src/store/service";
import {
  answered,
  edit,
  looked,
  looking,
  placing,
  played,
  replaceCell,
  request,
  stale,
  undo,
  type Answered,
} from "../src/store/state";
import type { ApiRequest, Pose, Robot } from "../src/store/types";
import { MOVE } from "./cells";

const UR = {
  name: "ur5e",
  kinematics: { base_link_origin: { value: [0, 0, 0, 0, 0, Math.PI] } },
} as unknown as Robot;
const QUARTER = ofPose({ position: [0.1, -0.2, 0.3], rotvec: [0, 0, Math.PI / 2] });
const goal = (asked: ApiRequest) => (asked.goal as { pose: Pose }).pose;

describe("a task seen from another place", () => {
  it("keeps joints, and what is not turned in its form", () => {
    const next = seenFrom(MOVE, ofPose({ position: [0.05, 0.02, 0] }), UR);
    expect(next.start).toEqual(MOVE.start);
    expect(goal(next)).toEqual({ ...goal(MOVE), position: [-0.4, -0.54, 0.45] });
    expect(next.scene!.obstacles![0]!.pose!.position).toEqual([-0.05, -0.02, -0.02]);
    expect("gravity" in next).toBe(false);
  });
  it("has every point where it was", () => {
    const next = seenFrom(MOVE, QUARTER, UR);
    const back = multiply(QUARTER, ofPose(goal(next)));
    ofPose(goal(MOVE)).forEach((value, k) => expect(back[k]).toBeCloseTo(value, 9));
    const again = seenFrom(next, inverse(QUARTER), UR);
    goal(again).position.forEach((value, k) =>
      expect(value).toBeCloseTo(goal(MOVE).position[k]!, 9),
    );
  });
  it("is in the frame of the base, whatever frame it was in", () => {
    const given = put(MOVE, "/goal/pose/frame", "base_link");
    const next = seenFrom(put(given, "/scene/frame", "base_link"), IDENTITY, UR);
    const [x, y, z] = goal(MOVE).position;
    expect(goal(next).position).toEqual([-x!, -y!, z]);
    expect(["frame" in goal(next), "frame" in next.scene!]).toEqual([false, false]);
  });
  it("turns gravity with a base that hangs", () => {
    const hanging = ofPose({ position: [0, 0, 2], rotvec: [Math.PI, 0, 0] });
    expect(seenFrom(MOVE, hanging, UR).gravity).toEqual([0, 0, 9.81]);
  });
  it("refuses a pose of ROS, which it cannot read", () => {
    const pose = { header: { frame_id: "base" }, pose: { position: { x: 0, y: 0, z: 0 } } };
    expect(() => seenFrom(put(MOVE, "/goal/pose", pose), QUARTER, UR)).toThrow("form of ROS");
  });
});

it("the world of a tilted base has gravity downwards", () => {
  for (const gravity of [
    [0, 0, 9.81],
    [-9.81, 0, 0],
    [0, -9.81, 0],
  ]) {
    const world = worldOf({ ...MOVE, gravity }, UR);
    const felt = seenFrom({ ...MOVE, gravity }, inverse(world), UR).gravity as number[];
    expect(felt).toEqual([0, 0, -9.81]);
  }
  expect(worldOf(MOVE, UR)).toEqual(IDENTITY);
});

it("a place is moved to coordinates and tells them", () => {
  const world = worldOf({ ...MOVE, gravity: [0, 0, 9.81] }, UR);
  const to = { at: [0.1, 0.2, -0.3] as [number, number, number], yaw: 0.4 };
  const found = coordinatesOf(movedTo(IDENTITY, world, to), world);
  found.at.forEach((value, k) => expect(value).toBeCloseTo(to.at[k]!, 12));
  expect(found.yaw).toBeCloseTo(0.4, 12);
  expect(yawOf(ofPose({ rotvec: [0, Math.PI / 2, 0] }))).toBeCloseTo(0, 12);
});

it("a column of the map is its best place; one left out may be good", () => {
  const place = (
    x: number,
    z: number,
    energy: number | null,
    more: Partial<Place> = {},
  ): Place => ({
    at: [x, 0, z],
    yaw: 0,
    mount: "floor",
    pose: IDENTITY,
    energy,
    reason: null,
    ...more,
  });
  const places = [
    place(0, 0, 120),
    place(0, 0.1, 110),
    place(0.1, 0, null, { reason: "reach" }),
    place(0.1, 0.1, null),
    place(0.1, 0.1, null, { reason: "torque", mount: "wall" }),
  ];
  const all = columnsOf(places, { height: null, mount: null });
  expect(all.map(({ energy, reason }) => energy ?? reason)).toEqual([110, null]);
  const low = columnsOf(places, { height: 0, mount: null });
  expect(low.map(({ energy, reason }) => energy ?? reason)).toEqual([120, "reach"]);
  expect(columnsOf(places, { height: null, mount: "wall" })).toHaveLength(1);
  expect(pitchOf(all)).toEqual([0.1, 0.1]);
});

describe("what is sent", () => {
  const given = regionTyped.value;
  it("is the region that was typed, from the yaw of the base on", () => {
    const free = { x: true, y: false, z: false, yaw: true };
    expect(regionOf({ ...given, free, yaw: ["-90", "90"], step: "50" }, 1)).toEqual({
      resolution: 0.05,
      region: { x: [-0.2, 0.2], yaw: [1 - Math.PI / 2, 1 + Math.PI / 2] },
      deadline: 60,
    });
  });
  it.each([
    [{ x: ["", "200"] as [string, string] }, "Enter two numbers for x"],
    [{ x: ["50", "200"] as [string, string] }, "The range of x must contain 0"],
    [{ free: { x: false, y: false, z: false, yaw: false } }, "Tick what may change"],
    [{ deadline: "soon" }, "Enter the search time"],
    [{ step: "0" }, "Enter the spacing"],
  ])("or says what is wrong with %o", (wrong, why) => {
    expect((regionOf({ ...given, ...wrong }, 0) as { why: string }).why).toContain(why);
  });
  it("is a cycle of one stop for a move, with its time and its wait", () => {
    const cycle = cycleOf({ ...MOVE, dwell: { time: 6, hold: "brakes" } });
    expect([cycle.closed, cycle.time, cycle.wait, cycle.hold]).toEqual([
      false,
      6,
      "goal",
      { hold: "brakes" },
    ]);
    expect(cycle.stops).toEqual([{ name: "goal", target: MOVE.goal }]);
    expect(cycleOf({ ...MOVE, duration: { max: 2 } }).time).toEqual({ max: 2 });
    expect(cycleOf(cycle)).toBe(cycle);
  });
});

describe("a look at a place", () => {
  beforeEach(() => replaceCell({ project: { id: "1", name: "test" }, request: MOVE }));
  it("ends with any edit, and with the panel", () => {
    placing.value = true;
    looking.value = { asked: request.value, robot: UR, pose: QUARTER } as typeof looking.value;
    expect(looked.value?.pose).toBe(QUARTER);
    expect(played.value).toBe(undefined);
    edit(put(request.value, "/payload/mass", 1));
    expect(looked.value).toBe(null);
    looking.value = { ...looking.value!, asked: request.value };
    placing.value = false;
    expect(looked.value).toBe(null);
  });
  it("is accepted with its motion, which one step of undo takes back", () => {
    const before = (answered.value = { asked: MOVE, solution: {} } as Answered);
    const there = put(MOVE, "/goal/pose/position", [0.1, 0.2, 0.3]);
    const motion = { asked: there, cycle: null, solution: {} } as Answered;
    placing.value = true;
    looking.value = { asked: MOVE, robot: UR, pose: QUARTER, motion } as typeof looking.value;
    accept();
    expect([request.value, answered.value, stale.value]).toEqual([there, motion, false]);
    undo();
    expect([request.value, answered.value, stale.value]).toEqual([MOVE, before, false]);
  });
  it.each([
    ["which was placed as a cycle of this move alone", MOVE, "answers/move"],
    ["which its wait made another cycle of", { ...MOVE, dwell: { time: 6 } }, "optimize"],
  ])("at the best place shows the move, %s", async (_, asked, last) => {
    const sent: string[] = [];
    const base = { position: [0.1, 0, 0] };
    const best = { base, mount: null, energy: 1, cycles: [{ answer: "answers/cycle" }] };
    const legs = [{ answer: "answers/move" }, ...("dwell" in asked ? [{ answer: null }] : [])];
    const move = { id: null, robot: "ur5e", objective: "electrical" };
    const answers: Record<string, unknown> = {
      placement: { id: null, best, nominal: null, map: [] },
      "answers/cycle": { answer: { legs } },
      "answers/move": { answer: { ...move, energy: { electrical: { total: 1 } } } },
      optimize: { ...move, energy: { electrical: { total: 1 } } },
    };
    vi.stubGlobal("fetch", (path: string) => {
      sent.push(path);
      return Promise.resolve(Response.json(answers[path]));
    });
    knowRobot({ ...UR, links: [] } as unknown as Robot);
    placing.value = true;
    replaceCell({ project: { id: "1", name: "test" }, request: asked });
    await search();
    expect([looked.value?.state, sent.at(-1)]).toEqual(["shown", last]);
    expect(looked.value?.motion?.cycle).toBe(null);
  });
});
