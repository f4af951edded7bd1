// JSON pointers (RFC 6901) into a request, which is never changed in place.

export type Pointer = string;

export const keysOf = (pointer: Pointer): string[] =>
  pointer
    .split("/")
    .slice(1)
    .map((key) => key.replaceAll("~1", "/").replaceAll("~0", "~"));

export const join = (...keys: (string | number)[]): Pointer =>
  keys.map((key) => `/${String(key).replaceAll("~", "~0").replaceAll("/", "~1")}`).join("");

const isObject = (value: unknown): value is Record<string, unknown> =>
  typeof value === "object" && value !== null;

/** The value at a pointer; undefined where there is none. */
export function at(value: unknown, pointer: Pointer): unknown {
  let found = value;
  for (const key of keysOf(pointer)) {
    if (!isObject(found)) return undefined;
    found = found[key];
  }
  return found;
}

// groups that say nothing when they are empty
const GROUPS = ["limits", "branch"];

/** A copy with another value at a pointer; undefined takes the field or the item away. */
export function put<T>(value: T, pointer: Pointer, next: unknown): T {
  return changed(value, keysOf(pointer), next) as T;
}

function changed(value: unknown, keys: string[], next: unknown): unknown {
  const [key, ...rest] = keys;
  if (key === undefined) return next;
  if (next === undefined && !isObject(value)) return value;
  const inner = isObject(value) ? changed(value[key], rest, next) : changed(undefined, rest, next);
  if (Array.isArray(value)) {
    const index = Number(key);
    if (inner === undefined) return value.filter((_, k) => k !== index);
    const copy: unknown[] = [...value];
    copy[index] = inner;
    return copy;
  }
  const copy: Record<string, unknown> = isObject(value) ? { ...value } : {};
  const empty =
    next === undefined && GROUPS.includes(key) && isObject(inner) && !Object.keys(inner).length;
  if (inner === undefined || empty) delete copy[key];
  else copy[key] = inner;
  return copy;
}

/** Where an error of the service belongs: the parts of its location that the request has. */
export function located(request: unknown, loc: (string | number)[]): Pointer {
  let pointer = "";
  let value = request;
  const parts = loc[0] === "body" ? loc.slice(1) : loc;
  parts.forEach((part, k) => {
    const next = parts[k + 1];
    const has =
      isObject(value) &&
      holds(value, part) &&
      !(next !== undefined && !holds(value[String(part)], next) && holds(value, next));
    // a part that the request lacks is the kind of an alternative, or the field that is missing
    const missing =
      k === parts.length - 1 && isObject(value) && !Array.isArray(value) && isField(part);
    if (!has && !missing) return;
    pointer += join(part);
    value = isObject(value) ? value[String(part)] : undefined;
  });
  return pointer;
}

const holds = (value: unknown, part: string | number) => isObject(value) && String(part) in value;

const isField = (part: string | number) => typeof part === "string" && /^[a-z_]+$/.test(part);
