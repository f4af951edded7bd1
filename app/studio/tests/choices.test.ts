import { expect, it } from "vitest";
import { found, ledTo, type Choice } from "../src/ui/Choices";

const CHOICES: Choice[] = ["KUKA KR 10", "Universal Robots UR10e"].map((title) => ({
  value: title,
  title,
  facts: "6 joints · 10 kg payload",
  note: "kuka",
}));

it("a choice is found by words of its title and facts, in any order and case", () => {
  const values = (text: string) => found(CHOICES, text).map(({ value }) => value);
  expect(values("")).toHaveLength(2);
  expect(values("10 kuka ")).toEqual(["KUKA KR 10"]);
  expect(values("10 KG")).toHaveLength(2);
  expect(values("fanuc")).toEqual([]);
});

it("arrows lead around the list", () => {
  expect([ledTo("ArrowDown", 0, 3), ledTo("ArrowDown", 2, 3), ledTo("ArrowUp", 0, 3)]).toEqual([
    1, 0, 2,
  ]);
  expect([ledTo("ArrowDown", 0, 0), ledTo("Home", 1, 3)]).toEqual([null, null]);
});
