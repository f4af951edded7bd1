// What was changed since an answer was computed, in words.
import { rotvecOf, turnOf } from "./chain";
import { at, keysOf, type Pointer } from "./pointer";
import { isObject, stopName } from "./request";
import type { ApiRequest, Pose } from "./types";
import { shown, UNITS, words, type UnitName } from "./units";

export interface Change {
  pointer: Pointer;
  name: string;
  before: string;
  after: string;
}

const AXES = ["X", "Y", "Z"];

/** Every leaf in which two requests differ. */
export function diff(before: ApiRequest, after: ApiRequest): Change[] {
  return leaves(before, after, "").map((pointer) => ({
    pointer,
    name: nameOf(pointer, after, before),
    before: textOf(pointer, valueAt(before, pointer)),
    after: textOf(pointer, valueAt(after, pointer)),
  }));
}

/** What stands at a pointer; of an orientation in another form, its rotation vector. */
function valueAt(request: ApiRequest, pointer: Pointer): unknown {
  const found = at(request, pointer);
  const pose = at(request, pointer.replace(/\/rotvec$/, ""));
  const turned = isObject(pose) && turnForm(pose) !== undefined;
  return found === undefined && turned && pointer.endsWith("/rotvec")
    ? rotvecOf(turnOf(pose as Partial<Pose>))
    : found;
}

function leaves(a: unknown, b: unknown, pointer: Pointer): Pointer[] {
  if (Object.is(a, b)) return [];
  const lists = Array.isArray(a) && Array.isArray(b) && a.length === b.length;
  if (!lists && !(isObject(a) && isObject(b)))
    return JSON.stringify(a) === JSON.stringify(b) ? [] : [pointer];
  const [one, two] = [a as Record<string, unknown>, b as Record<string, unknown>];
  const keys = new Set([...Object.keys(one), ...Object.keys(two)]);
  const turned = isObject(a) && isObject(b) && turnForm(a) !== turnForm(b);
  const inner = [...keys]
    .filter((key) => !turned || !TURNS.includes(key))
    .flatMap((key) => leaves(one[key], two[key], `${pointer}/${key}`));
  return turned ? [...inner, `${pointer}/rotvec`] : inner;
}

const TURNS = ["quaternion", "rpy", "rotvec"];

const turnForm = (pose: Record<string, unknown>) => TURNS.find((key) => key in pose);

/** What stands at a pointer, as the page names it. */
export function nameOf(
  pointer: Pointer,
  request: ApiRequest,
  before: ApiRequest = request,
): string {
  const keys = keysOf(pointer);
  const [first = "", second = ""] = keys;
  if (first === "start" || first === "goal")
    return [capital(first), ...tail(keys.slice(1))].join(" ");
  if (first === "stops" && second !== "") {
    const stop = at(request, `/stops/${second}`) ?? at(before, `/stops/${second}`);
    return [stopName(stop, Number(second)), ...tail(keys.slice(2))].join(" ");
  }
  if (first === "scene" && second === "obstacles" && keys[2] !== undefined) {
    const obstacle =
      at(request, `/scene/obstacles/${keys[2]}/name`) ??
      at(before, `/scene/obstacles/${keys[2]}/name`);
    return [String(obstacle ?? "Obstacle"), ...tail(keys.slice(3))].join(" ");
  }
  if (first === "scene") return "Scene";
  if (first === "tcp") return ["TCP", ...tail(keys.slice(1))].join(" ");
  if (pointer === "/payload/mass") return "Payload";
  if (first === "payload") return ["Payload", ...tail(keys.slice(1))].join(" ");
  return capital(
    keys
      .filter((key) => key !== "target")
      .map(words)
      .join(" "),
  );
}

const capital = (text: string) => text.charAt(0).toUpperCase() + text.slice(1);

function tail(keys: string[]): string[] {
  const [last, index] = [keys.at(-2), keys.at(-1)];
  if (last === "position") return [AXES[Number(index)] ?? ""];
  if (last === "rotvec") return [`R${AXES[Number(index)] ?? ""}`];
  if (last === "q") return [`joint ${Number(index) + 1}`];
  if (last === "size") return [`size ${AXES[Number(index)] ?? ""}`];
  if (last === "com") return [`centre of mass ${AXES[Number(index)] ?? ""}`];
  return keys
    .filter((key, k) => !["target", "pose", "q"].includes(key) && key !== keys[k - 1])
    .map((key) => NAMES[key] ?? words(key));
}

const NAMES: Record<string, string> = { rotvec: "orientation", com: "centre of mass" };

/** The unit in which a value at a pointer is shown. */
export function unitAt(pointer: Pointer): UnitName {
  if (
    /\/(position|size|com|start|end)(\/\d)?$|\/(margin|radius|length|distance|blend)$/.test(pointer)
  )
    return "mm";
  if (/\/q\/\d$/.test(pointer)) return "deg";
  if (/\/(rotvec|rpy)\/\d$/.test(pointer)) return "rad";
  if (/\/mass$/.test(pointer)) return "kg";
  if (/speed(\/m(ax|in))?$/.test(pointer)) return "mmps";
  if (/\/(duration|dwell|time|max|min|deadline)$/.test(pointer)) return "s";
  return "one";
}

function textOf(pointer: Pointer, value: unknown): string {
  if (value === undefined || value === null) return "none";
  if (typeof value === "number") {
    const unit = unitAt(pointer);
    return `${shown(value, unit)} ${UNITS[unit].sign}`.trim();
  }
  if (typeof value === "string") return value;
  if (typeof value === "boolean") return value ? "yes" : "no";
  if (Array.isArray(value)) {
    const numbers = value.every((each) => typeof each === "number");
    const unit = unitAt(pointer);
    return numbers
      ? `${value.map((each) => shown(each, unit)).join(", ")} ${UNITS[unit].sign}`.trim()
      : `${value.length} entries`;
  }
  if (!isObject(value)) return "set";
  if (typeof value.mass === "number") return `${value.mass} kg`;
  if (typeof value.max !== "number") return "set";
  const most = textOf(`${pointer}/max`, value.max);
  return value.min === value.max ? `exactly ${most}` : `at most ${most}`;
}
