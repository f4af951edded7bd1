import { beforeEach, expect, it } from "vitest";
import { diff } from "../src/store/diff";
import { put } from "../src/store/pointer";
import {
  answered,
  canRedo,
  canUndo,
  changes,
  economics,
  edit,
  redo,
  replaceCell,
  request,
  revert,
  stale,
  typed,
  undo,
  write,
  type Answered,
} from "../src/store/state";
import { MOVE } from "./cells";

beforeEach(() => replaceCell({ project: { id: "1", name: "test" }, request: MOVE }));

const answer = () => (answered.value = { asked: request.value } as Answered);

it("an edit is undone and done again, with what was typed", () => {
  write("/payload/mass", 1.6, "1,6");
  expect(request.value.payload?.mass).toBe(1.6);
  expect(typed.value).toEqual({ "/payload/mass": "1,6" });
  undo();
  expect(request.value).toBe(MOVE);
  expect(typed.value).toEqual({});
  redo();
  expect([request.value.payload?.mass, typed.value["/payload/mass"]]).toEqual([1.6, "1,6"]);
  expect([canUndo.value, canRedo.value]).toEqual([true, false]);
});

it("what was typed stays where another field changes", () => {
  write("/payload/mass", 1.6, "1,6");
  answer();
  edit(put(request.value, "/goal", { q: [0] }));
  revert();
  expect(typed.value).toEqual({ "/payload/mass": "1,6" });
});

it("undo and redo bring back the answers that belonged to the requests", () => {
  const first = answer();
  write("/payload/mass", 2, "2");
  const second = answer();
  undo();
  expect(answered.value).toBe(first);
  expect(stale.value).toBe(false);
  redo();
  expect(answered.value).toBe(second);
  expect(stale.value).toBe(false);
});

it("an edit that was not computed leaves the answer that is older", () => {
  const first = answer();
  write("/payload/mass", 2, "2");
  write("/payload/mass", 3, "3");
  undo();
  expect(answered.value).toBe(first);
  expect(stale.value).toBe(true);
});

it("a new edit ends what could be done again", () => {
  write("/payload/mass", 1, "1");
  undo();
  write("/payload/mass", 2, "2");
  expect(canRedo.value).toBe(false);
});

it("edits of one name in a row are one step", () => {
  for (const mass of [1, 2, 3]) edit(put(request.value, "/payload/mass", mass), {}, "slide");
  undo();
  expect(request.value).toBe(MOVE);
});

it("an answer is stale as long as its request differs", () => {
  answer();
  expect(stale.value).toBe(false);
  write("/goal/pose/position/2", 0.5, "500");
  write("/payload/mass", 1.6, "1.6");
  expect(changes.value.map(({ name, before, after }) => `${name} ${before} → ${after}`)).toEqual([
    "Goal Z 450.0 mm → 500.0 mm",
    "Payload 0.800 kg → 1.600 kg",
  ]);
  undo();
  undo();
  expect(stale.value).toBe(false);
});

it("all changes since the answer are taken back in one step", () => {
  answer();
  write("/payload/mass", 1.6, "1.6");
  write("/duration", 2, "2");
  revert();
  expect(stale.value).toBe(false);
  undo();
  expect(changes.value).toHaveLength(2);
});

it("another cell has nothing to undo", () => {
  write("/payload/mass", 1.6, "1.6");
  replaceCell({ project: { id: "2", name: "other" }, request: {} });
  expect(canUndo.value).toBe(false);
});

it("differences are named as the page names them", () => {
  const names = (next: typeof MOVE) => diff(MOVE, next).map(({ name }) => name);
  expect(names(put(MOVE, "/start/q/1", 0))).toEqual(["Start joint 2"]);
  expect(names(put(MOVE, "/scene/obstacles/0/pose/position/2", 0))).toEqual(["table Z"]);
  expect(
    names(put(MOVE, "/goal/pose", { position: [-0.35, -0.52, 0.45], rotvec: [1.57, 0, 0] })),
  ).toEqual(["Goal orientation"]);
  const turned = put(MOVE, "/goal/pose", { position: [-0.35, -0.52, 0.45], rotvec: [0, 0, 1] });
  expect(diff(MOVE, turned)[0]?.before).toBe("1.571, 0.000, 0.000");
  expect(names({ ...MOVE })).toEqual([]);
});

it("prices stay for another cell, and how often a motion came does not", () => {
  economics.value = { ...economics.value, cycleTime: 8, shift: 7 };
  replaceCell({ project: { id: "2", name: "other" }, request: MOVE });
  expect(economics.value).toMatchObject({ cycleTime: null, shift: 7 });
});

it("changed times and speeds are told with their units", () => {
  const speed = (given: unknown) => ({ ...MOVE, path: { speed: given } });
  const [held] = diff(speed(0.25), speed({ min: 0.3, max: 0.3 }));
  expect([held!.before, held!.after]).toEqual(["250 mm/s", "exactly 300 mm/s"]);
  const [time] = diff({ ...MOVE, duration: 2 }, { ...MOVE, duration: { max: 3 } });
  expect([time!.before, time!.after]).toEqual(["2.00 s", "at most 3.00 s"]);
});
