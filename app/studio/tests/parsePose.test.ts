import { describe, expect, it } from "vitest";
import { parsePose, parseTable, type Reading } from "../src/store/parsePose";

const readings = (text: string, prefer?: Reading["kind"], joints = 6): Reading[] => {
  const parsed = parsePose(text, joints, prefer);
  return "readings" in parsed ? parsed.readings : [];
};
const why = (text: string, joints = 6) => {
  const parsed = parsePose(text, joints);
  return "why" in parsed ? parsed.why : null;
};

describe("a pose of a program", () => {
  it("is in m and rad", () => {
    const [only, ...others] = readings(
      "movel(p[-0.42, 0.28, 0.1, 0, 3.1416, 0], a=1.2)".replace(", a=1.2)", ")"),
    );
    expect(others).toEqual([]);
    expect(only).toEqual({
      kind: "pose",
      values: [-0.42, 0.28, 0.1, 0, 3.1416, 0],
      echo: "pose in m and RX RY RZ in rad",
    });
  });
  it("in mm is read so where metres are out of reach", () => {
    expect(readings("p[-420, 280, 100, 0, 3.1416, 0]").map(({ values }) => values[0])).toEqual([
      -0.42,
    ]);
  });
});

describe("numbers of a pendant", () => {
  const text = "−420.0 280.0 100.0 2.221 −2.221 0.000";
  it("are asked about where an angle can be rad or degrees", () => {
    expect(readings(text).map(({ echo }) => echo)).toEqual([
      "pose in mm and RX RY RZ in rad",
      "pose in mm and RX RY RZ in degrees",
    ]);
    expect(readings(text)[0]!.values).toEqual([-0.42, 0.28, 0.1, 2.221, -2.221, 0]);
  });
  it("are clear with units", () => {
    expect(
      readings("X -420 mm Y 280 mm Z 100 mm RX 2.221 rad RY -2.221 rad RZ 0 rad"),
    ).toHaveLength(1);
    expect(
      readings("X=-420mm, Y=280mm, Z=100mm, RX=0°, RY=180°, RZ=0°").map(({ echo }) => echo),
    ).toEqual(["pose in mm and RX RY RZ in degrees"]);
  });
  it("with a comma for a point are numbers", () => {
    expect(readings("-420,5 280,0 100,0 0,0 3,142 0,0")[0]!.values[0]).toBeCloseTo(-0.4205);
  });
  it("need no question without a turn", () => {
    expect(readings("-420 280 100 0 0 0")).toHaveLength(1);
  });
  it("of two turns in degrees are a vector, or roll, pitch and yaw", () => {
    expect(readings("-420 280 100 90 0 45").map(({ echo }) => echo)).toEqual([
      "pose in mm and RX RY RZ in degrees",
      "pose in mm and roll, pitch, yaw in degrees",
    ]);
  });
});

describe("joint positions", () => {
  it("beyond a turn are degrees", () => {
    const [only] = readings("[0, -90, 90, -90, -90, 0]", "joints");
    expect(only!.echo).toBe("joints in degrees");
    expect(only!.values[1]).toBeCloseTo(-Math.PI / 2);
  });
  it("within one are asked about", () => {
    expect(readings("[0, -1.5, 1.5, -1.5, -1.5, 0]", "joints").map(({ echo }) => echo)).toEqual([
      "joints in rad",
      "joints in degrees",
    ]);
  });
  it("of movej are rad", () => {
    expect(readings("movej([0, -1.5, 1.5, -1.5, -1.5, 0])")).toHaveLength(1);
  });
  it("are those of an arm of seven", () => {
    expect(readings("[0, -90, 90, -90, -90, 0, 30]", undefined, 7)).toHaveLength(1);
    expect(
      readings("[0, -90, 90, -90, -90, 0]", undefined, 7).every(({ kind }) => kind === "pose"),
    ).toBe(true);
  });
});

it("what is far away says so", () => {
  expect(why("p[-4200000, 280, 100, 0, 3.1, 0]")).toContain("check the units");
  expect(why("hello")).toContain("No number");
  expect(why("1 2 3")).toContain("Numbers found: 3.");
  expect(why("1e999 0 0 0 0 0")).toContain("Numbers found: 5.");
});

it("a table has names and rows", () => {
  const rows = parseTable(
    "name;x;y;z;rx;ry;rz\nbin;-420;280;100;0;3.142;0\nshelf;-350;-520;450;1.571;0;0",
  );
  expect(rows).toEqual([
    { name: "bin", text: "-420 ; 280 ; 100 ; 0 ; 3.142 ; 0" },
    { name: "shelf", text: "-350 ; -520 ; 450 ; 1.571 ; 0 ; 0" },
  ]);
  expect(parseTable("-420;280;100;0;3.142;0")).toBeNull();
});
