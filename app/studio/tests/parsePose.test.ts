import { describe, expect, it } from "vitest";
import { parseAlike, parsePose, type Reading } from "../src/store/parsePose";
import { parseTable, type Table } from "../src/store/tables";

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

it("angles of other makers' pendants turn in their own order", () => {
  const [kuka, ...others] = readings("{X 700, Y 0, Z 500, A 90, B 0, C 180}");
  expect(others).toEqual([]);
  // a half turn about x, then a quarter about z
  const [wpr] = readings("X 700 Y 0 Z 500 W 180 P 0 R 90");
  kuka!.values.forEach((value, k) => expect(value).toBeCloseTo(wpr!.values[k]!));
  expect(Math.hypot(...kuka!.values.slice(3))).toBeCloseTo(Math.PI);
  expect(kuka!.values[3]).toBeCloseTo(kuka!.values[4]!);
  const [joints] = readings("{A1 0, A2 -1, A3 2, A4 0, A5 1, A6 0}");
  expect(joints!.values[2]).toBeCloseTo((2 * Math.PI) / 180);
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
  it("of movej are rad, without its speeds", () => {
    const [only, ...others] = readings("movej([0, -1.5, 1.5, -1.5, -1.5, 0], a=1.4, v=1.05)");
    expect(others).toEqual([]);
    expect(only!.values).toEqual([0, -1.5, 1.5, -1.5, -1.5, 0]);
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

describe("a table", () => {
  const table = (text: string) => parseTable(text) as Table;
  const why = (text: string) => (parseTable(text) as { why: string }).why;
  it("has names and rows", () => {
    const { rows, choices } = table(
      "name;x;y;z;rx;ry;rz\nbin;-420;280;100;0;3.142;0\nshelf;-350;-520;450;1.571;0;0",
    );
    expect(rows.map(({ name }) => name)).toEqual(["bin", "shelf"]);
    expect(choices[0]!.rows[1]!.values).toEqual([-0.35, -0.52, 0.45, 1.571, 0, 0]);
    expect(parseTable("-420;280;100;0;3.142;0")).toBeNull();
  });
  it("of a spreadsheet has decimal commas between semicolons or tabs", () => {
    for (const mark of [";", "\t"]) {
      const line = ["pick", "-420,5", "280", "100", "0", "3,1416", "0"].join(mark);
      const [row] = table(`${line}\n${line}`).choices[0]!.rows;
      expect(row!.values).toEqual([-0.4205, 0.28, 0.1, 0, 3.1416, 0]);
    }
  });
  it("takes units from its head", () => {
    const { choices } = table(
      "name;x [mm];y;z;rx [rad];ry;rz\na;-420;280;100;0;3.1;0\nb;-420;280;200;0;3.1;0",
    );
    expect(choices.map(({ echo }) => echo)).toEqual(["pose in mm and RX RY RZ in rad"]);
  });
  it("without a row is refused by the name of the row", () => {
    const rows = (third: string) => `a;-420;280;100;0;3;0\nb;-420;280;90;0;3;0\n${third}`;
    expect(why(rows("c;-420;280;;0;3;0"))).toMatch(/^Row 3 \(c\): Numbers found: 5/);
    expect(why(rows("c;-42000;280;0;0;3;0"))).toMatch(/^Row 3 \(c\): .*check the units/);
  });
  it("is asked about as a whole", () => {
    // the first row has no turn, and the second is no vector in rad
    const degrees = table("a;-420;280;100;0;0;0\nb;-420;280;100;90;0;45").choices;
    expect(degrees.map(({ echo }) => echo)).toEqual([
      "pose in mm and RX RY RZ in degrees",
      "pose in mm and roll, pitch, yaw in degrees",
    ]);
    // the second row can only be degrees, so the first one is
    const [only, ...others] = parseChoices("q1 0 1 1 1 1 0", "q1 0 -90 90 0 0 0");
    expect(others).toEqual([]);
    expect(only!.echo).toBe("joints in degrees");
  });
  it("may be a program", () => {
    const { choices } = table(
      "set_payload(2, [0, 0, 0.05])\nmovej([0, -1.5, 1.5, -1.5, -1.5, 0], a=1.4, v=1.05)\n" +
        "sleep(0.5)\nmovel(p[-0.42, 0.28, 0.1, 0, 3.1416, 0], a=1.2, v=0.25)",
    );
    expect(choices).toHaveLength(1);
    expect(choices[0]!.rows.map(({ kind }) => kind)).toEqual(["joints", "pose"]);
    expect(choices[0]!.rows[1]!.values[0]).toBe(-0.42);
  });
});

function parseChoices(...texts: string[]) {
  const parsed = parseAlike(texts);
  return "why" in parsed ? [] : parsed.choices;
}
