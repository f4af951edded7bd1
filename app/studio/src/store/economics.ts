// What a motion costs: joules to kWh, money and CO₂e, with every assumption named.
import { isObject } from "./request";

export interface Sourced {
  value: number;
  /** Where it is from, or "yours". */
  source: string;
  /** Trust letter of a figure that is not the user's: C, second-hand. */
  letter?: string;
}

export interface Economics {
  /** One move every so many seconds; null: back to back. */
  cycleTime: number | null;
  /** Hours of a shift. */
  shift: number;
  shiftsPerYear: number;
  /** € per kWh. */
  price: Sourced;
  /** kg CO₂e per kWh. */
  carbon: Sourced;
  /** Power of the control box by a wattmeter [W]; null: not counted. */
  box: Sourced | null;
}

export const DEFAULT_ECONOMICS: Economics = {
  cycleTime: null,
  shift: 8,
  shiftsPerYear: 460,
  price: {
    value: 0.2,
    source: "Eurostat: non-household consumers in the EU, second half of 2023",
    letter: "C",
  },
  carbon: { value: 0.21, source: "EEA: electricity generation in the EU, 2023", letter: "C" },
  box: null,
};

/** The assumptions that a project holds; in place of what is no number of its kind, the default. */
export function economicsOf(given: Record<string, unknown>): Economics {
  const known = DEFAULT_ECONOMICS;
  return {
    // projects of earlier versions name it `cycle`
    cycleTime: numberOf(given.cycleTime ?? given.cycle, 0) || null,
    shift: numberOf(given.shift, known.shift),
    shiftsPerYear: numberOf(given.shiftsPerYear, known.shiftsPerYear),
    price: sourcedOf(given.price, known.price),
    carbon: sourcedOf(given.carbon, known.carbon),
    box: sourcedOf(given.box, known.box),
  };
}

const numberOf = <T>(given: unknown, otherwise: T): number | T =>
  typeof given === "number" && given >= 0 ? given : otherwise;

function sourcedOf<T>(given: unknown, otherwise: T): Sourced | T {
  if (!isObject(given) || numberOf(given.value, null) === null) return otherwise;
  const { value, source, letter } = given;
  return {
    value: value as number,
    source: typeof source === "string" ? source : "yours",
    ...(typeof letter === "string" ? { letter } : {}),
  };
}

const JOULES = 3.6e6; // of a kWh

export interface Costs {
  cycleTime: number;
  cyclesPerShift: number;
  rows: { name: string; joules: number; shift: number; year: number }[];
  total: { joules: number; shift: number; year: number };
  money: { shift: number; year: number };
  carbon: { shift: number; year: number };
}

/** Costs of a motion of several parts, of which one begins every `cycleTime` seconds. */
export function costsOf(
  parts: { name: string; joules: number }[],
  cycleTime: number,
  given: Economics,
): Costs {
  const cyclesPerShift = Math.floor((given.shift * 3600) / cycleTime + 1e-9);
  const box = given.box ? [{ name: "Control box", joules: given.box.value * cycleTime }] : [];
  const rows = [...parts, ...box].map((part) => {
    const shift = (part.joules * cyclesPerShift) / JOULES;
    return { ...part, shift, year: shift * given.shiftsPerYear };
  });
  const sum = (key: "joules" | "shift" | "year") => rows.reduce((all, row) => all + row[key], 0);
  const total = { joules: sum("joules"), shift: sum("shift"), year: sum("year") };
  const times = (value: number) => ({ shift: total.shift * value, year: total.year * value });
  return {
    cycleTime,
    cyclesPerShift,
    rows,
    total,
    money: times(given.price.value),
    carbon: times(given.carbon.value),
  };
}
