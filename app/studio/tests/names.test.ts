import { expect, it } from "vitest";
import { projectName } from "../src/store/persist";
import { fileName } from "../src/store/share";

it("a file is named after its content in any language, and never without a name", () => {
  expect(fileName("Zelle für Öl, Halle 3", "cell", "csv")).toBe("zelle-für-öl-halle-3.csv");
  expect(fileName("Line 2.1 / night", "job", "joulepath.json")).toBe(
    "line-2.1-night.joulepath.json",
  );
  expect(fileName("../../etc", "cell", "csv")).toBe("etc.csv");
  expect(fileName(" … ", "report", "pdf")).toBe("report.pdf");
});

it("a project has a name without spaces around it", () => {
  expect([projectName("  Press 3 "), projectName("   "), projectName("")]).toEqual([
    "Press 3",
    "Untitled cell",
    "Untitled cell",
  ]);
});
