// A form made from the OpenAPI document: it shows the fields that the request sets, and offers the others.
import { get } from "./api.js";
import { $, el } from "./dom.js";
import { kindOf, openapi, problem } from "./request.js";
import { follow, set, state } from "./store.js";

// how a unit is shown and read; requests are in SI units always
const SHOWN = { rad: { deg: ["°", 180 / Math.PI] }, m: { mm: ["mm", 1000] } };
const MOST_LISTED = 24; // items of a list that are shown

let schemas = null;
let own = false; // whether the present change comes from the form
const open = new Set(["start", "goal", "start.pose", "goal.pose"]);

export function createForm() {
  follow("request", () => {
    if (!own) showForm().catch(problem);
  });
  follow("problem", placeErrors);
  // the first answer does not wait for the document
  follow("answer", () => $("form").firstChild || showForm().catch(problem));
  for (const id of ["angles", "lengths"]) $(id).onchange = () => showForm().catch(problem);
}

/** Draws the form, where it is shown. */
export async function showForm() {
  if ($("pane-form").hidden || !(state.answer || state.problem)) return;
  if (!state.request) return $("form").replaceChildren(el("p", { class: "hint" }, "The request of a kept cycle is not kept. Choose an example, or write one as JSON."));
  schemas ??= (await openapi()).components.schemas;
  if (!$("robots").childElementCount) $("robots").replaceChildren(...(await get("robots")).robots.map(({ name }) => el("option", {}, name)));
  const { schema, path, drawn } = kindOf(state.request);
  $("drag-tools").hidden = !drawn;
  $("form").replaceChildren(fields(schemas[schema] ?? (await querySchema(path)), state.request, []));
  placeErrors();
}

/** The query parameters of a POST as a schema. */
async function querySchema(path) {
  const asked = (await openapi()).paths[`/${path}`].post.parameters.filter((each) => each.in === "query");
  return { properties: Object.fromEntries(asked.map(({ name, schema, content, ...about }) => [name, { ...about, ...(schema ?? content["application/json"].schema) }])) };
}

const resolve = (schema) => (schema.$ref ? { ...schemas[schema.$ref.split("/").at(-1)], ...schema, $ref: undefined } : schema);
const words = (name) => name.replaceAll("_", " ");

/** The alternatives of a schema, null among them, with what they share; null if it has none. */
function alternatives(schema) {
  const { anyOf, oneOf, ...shared } = schema;
  const all = (anyOf ?? oneOf)?.flatMap((each) => alternatives(resolve(each)) ?? [resolve(each)]);
  return all?.map((each) => ({ ...each, "x-unit": each["x-unit"] ?? shared["x-unit"] })) ?? null;
}

/** How well a value fits a schema: 0 if not at all. */
function fit(schema, value) {
  if (schema.type === "null") return value === null ? 9 : 0;
  if (value === null || value === undefined) return 0;
  if (schema.type === "array") return Array.isArray(value) ? 5 : 0;
  if (schema.properties) {
    if (typeof value !== "object" || Array.isArray(value)) return 0;
    const known = Object.entries(schema.properties);
    if (known.some(([name, each]) => each.const !== undefined && name in value && value[name] !== each.const)) return 0;
    if (!Object.keys(value).every((name) => name in schema.properties)) return 0;
    return (schema.required ?? []).every((name) => name in value) ? 5 + known.filter(([name]) => name in value).length : 0;
  }
  return { number: "number", integer: "number", string: "string", boolean: "boolean" }[schema.type] === typeof value ? 5 : 0;
}

function fresh(schema) {
  const resolved = resolve(schema);
  if (resolved.const !== undefined) return resolved.const;
  if (resolved.examples?.length) return structuredClone(resolved.examples[0]);
  const others = alternatives(resolved);
  if (others) return fresh(others.find(({ type }) => type !== "null"));
  if (resolved.properties)
    return Object.fromEntries((resolved.required ?? []).concat(Object.keys(resolved.properties).filter((name) => resolve(resolved.properties[name]).const)).map((name) => [name, fresh(resolved.properties[name])]));
  if (resolved.type === "array") return Array.from({ length: resolved.minItems ?? 0 }, () => fresh(resolved.items));
  return resolved.default ?? { number: 0, integer: 0, boolean: false, string: "" }[resolved.type] ?? null;
}

/** Writes a value (undefined: none) at a path of the request; `redraw`: the form has other fields then. */
function write(path, value, redraw = true) {
  const request = structuredClone(state.request);
  let parent = request;
  for (const key of path.slice(0, -1)) parent = parent[key];
  const last = path.at(-1);
  if (value !== undefined) parent[last] = value;
  else if (Array.isArray(parent)) parent.splice(last, 1);
  else delete parent[last];
  own = !redraw;
  set({ request });
  own = false;
}

/** Set fields of an object, and a list that adds others. */
function fields(schema, value, path) {
  const needed = (name) => (schema.required?.includes(name) ? 0 : 1);
  const there = Object.keys(schema.properties).filter((name) => name in value).toSorted((a, b) => needed(a) - needed(b));
  const unset = Object.keys(schema.properties).filter((name) => !(name in value));
  const add = el("select", { "aria-label": `Add a field${path.length ? ` to ${path.join(" ")}` : ""}`, class: "add" }, el("option", { value: "" }, "add …"),
    unset.map((name) => el("option", { value: name, title: schema.properties[name].description }, words(name))));
  add.onchange = () => {
    open.add([...path, add.value].join("."));
    write([...path, add.value], fresh(schema.properties[add.value]));
  };
  return el("div", { class: "fields" }, there.map((name) => field(schema.properties[name], value[name], [...path, name], schema.required?.includes(name))), unset.length ? add : null);
}

/** One field with its name, its control and, unless it has to be there, a button that takes it away. */
function field(given, value, path, required) {
  const schema = resolve(given);
  const name = path.at(-1);
  const key = path.join(".");
  const label = typeof name === "number" ? (value?.name ?? `${name + 1}`) : words(name);
  const away = required || schema.const !== undefined ? null : el("button", { type: "button", class: "away", "aria-label": `Remove ${label}`, onclick: () => write(path, undefined) }, "×");
  const title = given.description ?? schema.description;
  const { control, block } = controlOf(schema, value, path, label);
  if (!block) return el("div", { class: "field", "data-path": key, title }, el("span", { class: "label-text" }, label), control, away);
  const details = el("details", { class: "group", "data-path": key, open: open.has(key) }, el("summary", { title }, label, away), control);
  details.ontoggle = () => (details.open ? open.add(key) : open.delete(key));
  return details;
}

function controlOf(schema, value, path, label) {
  const others = alternatives(schema);
  if (others) return choice(others, value, path, label);
  const wrong = schema.type === "array" ? !Array.isArray(value) : schema.properties && typeof (value ?? {}) !== "object";
  if (wrong) return { control: el("code", {}, JSON.stringify(value)) };
  if (schema.properties) return { control: fields(schema, value ?? {}, path), block: true };
  if (schema.const !== undefined) return { control: el("code", {}, String(schema.const)) };
  if (schema.enum) return { control: pick(schema.enum.map((each) => [each, each]), value, (chosen) => write(path, chosen, false), label) };
  if (schema.type === "boolean") {
    const box = el("input", { type: "checkbox", checked: value, "aria-label": label });
    box.onchange = () => write(path, box.checked, false);
    return { control: box };
  }
  if (schema.type === "array") return list(schema, value, path);
  if (schema.type === "number" || schema.type === "integer") return { control: number(schema, value, path, label) };
  const text = el("input", { type: "text", value: value ?? "", "aria-label": label, list: label === "robot" ? "robots" : null });
  text.onchange = () => write(path, text.value, false);
  return { control: text };
}

function pick(options, chosen, then, label) {
  const select = el("select", { "aria-label": label }, options.map(([value, text]) => el("option", { value }, words(String(text)))));
  select.value = chosen;
  select.onchange = () => then(select.value);
  return select;
}

const kind = (schema) => schema.type === "null" ? "none" : schema.const ?? schema.properties?.shape?.const ?? schema.properties?.mode?.const ?? (schema.required?.length ? schema.required.filter((name) => name !== "position" && name !== "direction").join(", ") || schema.title : schema.title ?? schema.type);

/** One of several forms of a value: a list that chooses, then the form chosen. */
function choice(others, value, path, label) {
  const fits = others.map((each) => fit(each, value));
  const at = fits.indexOf(Math.max(...fits));
  const select = pick(others.map((each, k) => [k, kind(each)]), at, (k) => write(path, others[k].type === "null" ? null : fresh(others[k])), `Kind of ${label}`);
  const { control, block } = others[at].type === "null" ? {} : controlOf(others[at], value, path, label);
  return { control: el("div", { class: block ? "choice" : "inline" }, others.length > 1 ? select : null, control), block };
}

function list(schema, value, path) {
  const items = resolve(schema.items);
  const flat = items.type === "number" || items.type === "integer";
  if (flat && value.length <= 16) return { control: el("span", { class: "vector" }, value.map((each, k) => number({ ...items, "x-unit": schema["x-unit"] }, each, [...path, k], `${path.at(-1)} ${k + 1}`))) };
  const shown = value.slice(0, flat || items.type === "array" ? 0 : MOST_LISTED).map((each, k) => field(schema.items, each, [...path, k]));
  const rest = value.length - shown.length;
  const add = el("button", { type: "button", onclick: () => { open.add([...path, value.length].join(".")); write([...path, value.length], renamed(fresh(schema.items), value)); } }, "add");
  return { control: el("div", { class: "fields" }, shown, rest ? el("p", { class: "hint" }, `${rest} more: see JSON.`) : null, shown.length === value.length ? add : null), block: true };
}

/** A new item with a name that no other has. */
function renamed(item, others) {
  if (item?.name) for (let k = 2; others.some(({ name }) => name === item.name); k++) item.name = item.name.replace(/( \d+)?$/, ` ${k}`);
  return item;
}

function number(schema, value, path, label) {
  const unit = schema["x-unit"];
  const [sign, factor] = SHOWN[unit]?.[$(unit === "rad" ? "angles" : "lengths").value] ?? [unit === "1" ? "" : (unit ?? ""), 1];
  const bounds = { min: schema.minimum === undefined ? null : schema.minimum * factor, max: schema.maximum === undefined ? null : schema.maximum * factor };
  const input = el("input", { type: "number", step: "any", ...bounds, value: +(value * factor).toFixed(factor > 1 ? 3 : 6), "aria-label": `${label}${sign ? ` in ${sign}` : ""}` });
  input.onchange = () => {
    input.toggleAttribute("aria-invalid", !input.checkValidity());
    if (input.value !== "") write(path, input.valueAsNumber / factor, false);
  };
  return el("span", { class: "amount" }, input, sign ? el("small", {}, sign) : null);
}

/** Puts errors of the service beside the fields that they name. */
function placeErrors() {
  for (const old of document.querySelectorAll("#form .error")) old.remove();
  for (const { loc, msg } of state.problem?.details?.errors ?? []) {
    let path = "";
    let found = null;
    for (const part of loc) {
      const next = path ? `${path}.${part}` : String(part);
      const node = [...document.querySelectorAll("#form [data-path]")].find(({ dataset }) => dataset.path === next);
      // parts that are no field name the kind of an alternative
      if (node) [path, found] = [next, node];
    }
    for (let node = found; node; node = node.parentElement.closest("details")) if (node.tagName === "DETAILS") node.open = true;
    (found?.tagName === "DETAILS" ? found.querySelector("summary") : found)?.append(el("small", { class: "error", role: "alert" }, msg));
  }
}
