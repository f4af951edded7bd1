import { busyAfter } from "../src/logs/model";
import { expect, it } from "vitest";
import { costsOf, DEFAULT_ECONOMICS } from "../src/store/economics";
import { baselineName, periodOf, plain } from "../src/store/facts";
import { csvOfJob, refusal, type Job, type JobRow } from "../src/jobs/model";
import { moveName, parseMoves, requestsOf } from "../src/store/moves";
import { Problem } from "../src/store/client";
import { trouble, type Answered } from "../src/store/state";
import { tell } from "../src/store/trouble";
import type { ApiRequest, ProblemDetails } from "../src/store/types";
import { asShown, atMost, ends, figure, parseNumber, shown, typedValue } from "../src/store/units";
import { MOVE } from "./cells";

it("numbers are read as people type them", () => {
  expect([
    parseNumber("−4,5"),
    parseNumber(" 1e-3 "),
    parseNumber("4 kg"),
    parseNumber(""),
  ]).toEqual([-4.5, 0.001, null, null]);
  expect([typedValue("450", "mm"), typedValue("90", "deg")]).toEqual([
    0.45,
    expect.closeTo(Math.PI / 2),
  ]);
  expect([shown(-0.00001, "mm"), shown(0.4567, "mm"), shown("x", "mm")]).toEqual([
    "0.0",
    "456.7",
    "",
  ]);
});

it("intervals are rounded outwards", () => {
  expect([
    ends({ p5: 610.6, p95: 989.4 }),
    ends({ p5: 55.46, p95: 59.61 }),
    ends({ p5: -1.234, p95: 0 }),
  ]).toEqual(["610 to 990", "55.4 to 59.7", "−1.24 to 0"]);
});

it("bounds from above are never below", () => {
  expect([atMost(0.0851), atMost(0.085), atMost(0.104), atMost(0)]).toEqual([
    "8.6 %",
    "8.5 %",
    "11 %",
    "0.0 %",
  ]);
});

it("figures have three digits and no exponents", () => {
  expect([figure(74.3189), figure(1239.3), figure(0.0608), figure(null), figure(-2)]).toEqual([
    "74.3",
    "1,239",
    "0.0608",
    "–",
    "−2.00",
  ]);
});

it("costs are those of whole cycles in a shift", () => {
  const parts = [
    { name: "The move", joules: 74.4 },
    { name: "Waiting", joules: 208.9 },
  ];
  const costs = costsOf(parts, 6, DEFAULT_ECONOMICS);
  expect(costs.cyclesPerShift).toBe(4800);
  expect(costs.total.shift).toBeCloseTo((283.3 * 4800) / 3.6e6);
  expect(costs.total.year).toBeCloseTo(460 * costs.total.shift);
  expect(costs.money.year).toBeCloseTo(0.2 * costs.total.year);
});

it("one motion begins as often as it comes, and a request with a wait says it itself", () => {
  const shown = (asked: ApiRequest) => ({ asked, solution: { duration: 2 } }) as Answered;
  expect([null, 1, 6].map((every) => periodOf(shown({}), every))).toEqual([2, 2, 6]);
  expect(periodOf(shown({ time: { max: 4 } }), 6)).toBe(6);
  expect(periodOf(shown({ dwell: { time: 3 } }), 6)).toBe(3);
});

it("joint positions of the service are told in degrees", () => {
  const limits = "give a value between -6.28319 and 6.28319 rad.";
  const said = `The start's shoulder_lift_joint is at 87.2665 rad: ${limits}`;
  expect(asShown(`${said} The value looks like degrees: divide it by 57.29578.`)).toBe(
    "The start's shoulder lift is at 5000.00°: give a value between −360.00° and 360.00°.",
  );
});

it("baselines and their faults are named in the words of the panel", () => {
  expect([baselineName("quintic"), baselineName("quintic", true)]).toEqual([
    "Quintic polynomial",
    "Quintic along the path",
  ]);
  expect(plain("`controller_default` is left out.")).toBe("“Controller default” is left out.");
});

it("the control box counts once a reading is given", () => {
  const costs = costsOf([{ name: "The move", joules: 10 }], 2, {
    ...DEFAULT_ECONOMICS,
    box: { value: 50, source: "yours" },
  });
  expect(costs.rows.map(({ joules }) => joules)).toEqual([10, 100]);
});

const HEAD = "from;to;kg;x mm;y;z;rx rad;ry;rz;x;y;z;rx;ry;rz";

it("a table of moves becomes requests of the cell", () => {
  const read = parseMoves(
    `${HEAD}\nbin;shelf;1,5;-420;280;100;0;3,142;0;-350;-520;450;1,571;0;0`,
    6,
  );
  if ("why" in read) throw new Error(read.why);
  expect(read.choices).toHaveLength(1);
  const [request] = requestsOf(read.moves, read.choices[0]!, { ...MOVE, duration: 3 });
  expect(request).toEqual({
    robot: "ur5e",
    scene: MOVE.scene,
    start: { pose: { position: [-0.42, 0.28, 0.1], rotvec: [0, 3.142, 0] } },
    goal: { pose: { position: [-0.35, -0.52, 0.45], rotvec: [1.571, 0, 0] } },
    payload: { mass: 1.5, com: [0, 0, 0.05] },
  });
  expect(read.moves[0]).toMatchObject({ from: "bin", to: "shelf", mass: 1.5 });
});

it("the moves of a job have names, also in its CSV", async () => {
  const move = { from: "bin\u200b 1", to: "s".repeat(300), mass: null, start: "", goal: "" };
  expect(moveName(move)).toBe(`bin 1 to ${"s".repeat(191)}`);
  const row = { index: 0, name: 'a "b", c', kind: "optimize", state: "done", answer: "/answers/1" };
  const rows = [row, { ...row, index: 1, name: null }].map(
    (each) => ({ ...each, energy: 1, duration: 2, problem: null }) as JobRow,
  );
  const notes = { id: "j", source: "", masses: [1.5, null], requests: [] };
  const none = { mass: null, interval: null, rival: null, rivalEnergy: null, saving: null };
  const details = new Map(rows.map(({ index }) => [index, none]));
  const shown = { job: {} as Job, rows, notes, details };
  expect((await csvOfJob(shown)).split("\n").slice(0, 3)).toEqual([
    "no,move,kg,state,duration_s,energy_J,p5_J,p95_J,rival,rival_J,saving,problem,answer",
    '1,"a ""b"", c",1.5,done,2,1,,,,,,,/answers/1',
    "2,move 2,,done,2,1,,,,,,,/answers/1",
  ]);
});

it("a table that the service refuses is told by its rows", () => {
  const loc = ["body", "requests", 2, "optimize", "payload", "mass"];
  const errors = [{ loc, msg: "Input should be less than or equal to 2000" }];
  expect(refusal(new Problem({ title: "Invalid request", errors }))).toBe(
    "Row 3, payload.mass: Input should be less than or equal to 2000.",
  );
});

it("targets in rows are moves from each to the next", () => {
  const read = parseMoves("a;0;-90;90;-90;-90;0\nb;30;-90;90;-90;-90;0\nc;60;-90;90;-90;-90;0", 6);
  if ("why" in read) throw new Error(read.why);
  expect(read.moves.map(({ from, to }) => `${from}-${to}`)).toEqual(["a-b", "b-c"]);
  const joints = read.choices.find(({ rows }) => rows[0]!.kind === "joints")!;
  expect(requestsOf(read.moves, joints, {})[1]!.goal).toEqual({
    q: [60, -90, 90, -90, -90, 0].map((x) => (x * Math.PI) / 180),
  });
});

it("rows that do not fit are named", () => {
  expect(parseMoves("1;2;3", 6)).toHaveProperty("why");
  expect(parseMoves(`${HEAD}\n${Array(12).fill(1).join(";")}\n1;2`, 6)).toEqual({
    why: "Row 2 has 2 numbers, but row 1 has 11.",
  });
});

it("an identification says which fits are done, and how long the rest takes", () => {
  const queued = busyAfter({ text: "", share: null }, "state", { state: "running" });
  expect(queued).toEqual({ text: "Identification: running …", share: null });
  const first = busyAfter(queued, "progress", { eta: null, requests: [{ share: 0 }] });
  expect(first).toEqual({ text: "Identification: 0 % of the fits", share: 0 });
  const second = busyAfter(first, "progress", { eta: 12.3, requests: [{ share: 0.25 }] });
  expect(second).toEqual({
    text: "Identification: 25 % of the fits, about 12 s left",
    share: 0.25,
  });
  expect(busyAfter(second, "progress", { eta: 1, requests: [] })).toBe(second);
  expect(busyAfter(second, "state", { state: "done" })).toBe(second);
});

it("what the service says has the units and the names of the page", () => {
  expect(asShown("elbow_joint needs 155 N·m, 0.2969 m short of 12 m, in 3 moves")).toBe(
    "elbow needs 155 N·m, 297 mm short of 12 m, in 3 moves",
  );
  expect(asShown("7 m away: give it in metres, not millimetres, or move it closer.")).toBe(
    "7 m away: move it closer.",
  );
  const errors = [
    { loc: ["body", "goal", "pose", "position", 0], msg: "At most 100" },
    { loc: ["body", "payload", "mass"], msg: "Too heavy" },
  ];
  tell(new Problem({ title: "Invalid request", detail: "See `errors`.", errors }), MOVE);
  expect(trouble.value).toMatchObject({
    text: "Correct the marked fields.",
    fields: [
      { pointer: "/goal/pose/position/0", text: "At most 100 (in SI units, not mm)" },
      { pointer: "/payload/mass", text: "Too heavy" },
    ],
  });
});

it("a problem stands at the places that it names", () => {
  const stops = [{ name: "bin" }, { name: "bead/2" }, {}];
  const cycle = { ...MOVE, stops } as ApiRequest;
  const at = (details: ProblemDetails, asked = cycle) => {
    tell(new Problem({ title: "No", detail: "Why.", ...details }), asked);
    return trouble.value!.fields.map(({ pointer }) => pointer);
  };
  const type = "/problems/duration-too-short";
  expect(at({ target: "goal" }, MOVE)).toEqual(["/goal"]);
  expect(at({ path: "path" }, MOVE)).toEqual(["/path"]);
  expect(at({ target: "stops.2.target" })).toEqual(["/stops/2/target"]);
  expect(at({ target: "stops/bead/2" })).toEqual(["/stops/1/target"]);
  expect(at({ path: "stops/bin/approach" })).toEqual(["/stops/0/target"]);
  expect(at({ stop: "stops/3" })).toEqual(["/stops/2/target"]);
  expect(at({ stop: "start" })).toEqual(["/start"]);
  expect(at({ type }, MOVE)).toEqual(["/duration"]);
  expect(at({ type })).toEqual(["/time"]);
  expect(at({ pair: ["forearm_link", "table"] })).toEqual(["/scene/obstacles/0"]);
  const pair: [string, string] = ["forearm_link", "table"];
  expect(at({ pair, target: "goal" }, MOVE)).toEqual(["/goal", "/scene/obstacles/0"]);
  expect(at({ pair: ["forearm_link", "tool"] })).toEqual([]);
});

it("a mass of a table that is no number is named, and not left out", () => {
  const six = "-420;280;300;0;3.142;0";
  for (const text of [
    `from;to;kg;x mm;y;z;rx rad;ry;rz;x;y;z;rx;ry;rz\na;b;heavy;${six};${six}`,
    `from;to;kg;x mm;y;z;rx rad;ry;rz;x;y;z;rx;ry;rz\na;b;-2;${six};${six}`,
    `a;b;NaN;${six};${six}`,
  ])
    expect(parseMoves(text, 6)).toMatchObject({
      why: expect.stringMatching(/Row 1: .*not a mass/),
    });
  const read = parseMoves(`from;to;kg;x;y;z;rx;ry;rz;x;y;z;rx;ry;rz\na;b;;${six};${six}`, 6);
  expect(read).toMatchObject({ moves: [{ from: "a", to: "b", mass: 0 }] });
});
