// Numbers as people read and type them.

export interface Unit {
  sign: string;
  /** From SI to what is shown. */
  factor: number;
  digits: number;
}

export const UNITS = {
  mm: { sign: "mm", factor: 1000, digits: 1 },
  deg: { sign: "°", factor: 180 / Math.PI, digits: 2 },
  rad: { sign: "rad", factor: 1, digits: 3 },
  kg: { sign: "kg", factor: 1, digits: 3 },
  s: { sign: "s", factor: 1, digits: 2 },
  mmps: { sign: "mm/s", factor: 1000, digits: 0 },
  one: { sign: "", factor: 1, digits: 3 },
} satisfies Record<string, Unit>;

export type UnitName = keyof typeof UNITS;

/** A number with so many significant digits as tell something, never as 1e5. */
export function figure(value: number | null | undefined, digits = 3): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size === 0) return "0";
  if (size < 1e-4) return value.toExponential(1).replace("e-", " · 10⁻").replace(/\d+$/, raised);
  return grouped(value.toFixed(placesOf(value, digits)));
}

/** The places after the point of so many significant digits. */
const placesOf = (value: number, digits: number) =>
  Math.max(0, Math.min(6, digits - 1 - Math.floor(Math.log10(Math.abs(value)))));

/** The ends of an interval, rounded outwards as in the reports. */
export function ends({ p5, p95 }: { p5: number; p95: number }): string {
  const outwards = (value: number, round: (scaled: number) => number) => {
    const scale = 10 ** placesOf(value || 1, 3);
    return figure(round(value * scale) / scale);
  };
  return `${outwards(p5, Math.floor)} to ${outwards(p95, Math.ceil)}`;
}

const raised = (digits: string) => [...digits].map((digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(digit)]).join("");

/** Thousands with commas, and a true minus sign. */
function grouped(text: string): string {
  const [whole = "", rest] = text.split(".");
  const spaced = whole.replace(/\B(?=(\d{3})+(?!\d))/g, ",");
  return (rest === undefined ? spaced : `${spaced}.${rest}`).replace("-", "−");
}

export const fixed = (value: number, digits: number) => grouped(value.toFixed(digits));

export const percent = (share: number, digits = 2) => `${figure(share * 100, digits)} %`;

/** An upper bound in percent, rounded up. */
export function atMost(share: number): string {
  const places = share < 0.1 ? 1 : 0;
  const scale = 100 * 10 ** places;
  return `${((Math.ceil(share * scale - 1e-9) / scale) * 100).toFixed(places)} %`;
}

/** The number that a text holds; null if it holds none. Commas may stand for points. */
export function parseNumber(text: string): number | null {
  const plain = text.trim().replace("−", "-").replace(",", ".");
  if (!/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain)) return null;
  return Number(plain);
}

/** An SI value in its unit, as a cell shows it before anybody has typed in it. */
export function shown(value: unknown, name: UnitName): string {
  if (typeof value !== "number" || !Number.isFinite(value)) return "";
  const { factor, digits } = UNITS[name];
  const text = (value * factor).toFixed(digits);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "−");
}

/** The SI value of a text in a unit; null if it is no number. */
export function typedValue(text: string, name: UnitName): number | null {
  const value = parseNumber(text);
  return value === null ? null : value / UNITS[name].factor;
}

export const words = (name: string) => name.replaceAll("_", " ");

/** The name of a joint, in short. */
export const jointName = (name: string) => words(name.replace(/_joint$/, ""));

const LONGEST = 5; // what is longer is told in metres [m]

const inDegrees = (text: string) =>
  text
    .replaceAll(" rad", "°")
    .replace(/-?\d+\.?\d*(e[+-]?\d+)?/g, (value) => shown(Number(value), "deg"))
    .replace(" and ", "° and ");

/** What the service says, in the units and the names of joints of the page. */
export const asShown = (text: string): string =>
  text
    .replace(/\b[a-z0-9_]+_joint\b/g, jointName)
    .replaceAll("stops/", "stop ")
    .replace("give it in metres, not millimetres, or ", "") // lengths are typed in millimetres
    .replace(" The value looks like degrees: divide it by 57.29578.", "") // joints are typed in degrees
    .replace(/ is at .* rad: give a value between .* rad/, inDegrees)
    .replace(/(\d+(?:\.\d+)?(?:e-?\d+)?) m\b(?![²³])/g, (whole, metres: string) =>
      Number(metres) < LONGEST ? `${figure(Number(metres) * 1000, 2)} mm` : whole,
    );

export const when = (time: string) =>
  new Date(time).toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" });
