// The request: examples, JSON, and its way to the service and back.
import { Problem, get, stream } from "./api.js";
import { cellOf } from "./chain.js";
import { chart, steps } from "./chart.js";
import { $, el, figure, style } from "./dom.js";
import { addLog, openIdentification } from "./kept.js";
import { showCycle } from "./cycle.js";
import { follow, set, state } from "./store.js";

// what may be asked for, by the field that tells it
const KINDS = {
  stops: { path: "cycle", schema: "CycleRequest", verb: "Optimise", drawn: true, show: (answer, request) => showCycle(answer, request) },
  logs: { path: "identifications", schema: "IdentifyRequest", verb: "Identify", show: ({ id }) => openIdentification(id) },
  log: { path: "logs", verb: "Add the log", show: added },
};
const MOTION = { path: "optimize", schema: "OptimizeRequest", verb: "Optimise", drawn: true, show: (answer, request) => showAnswer(answer, request) };
const FIRST = "studio/first.json";
const PATIENCE = 3; // times that a busy service is asked again
export const robots = new Map(); // figures of those that are known, by name
let example = null; // the request that the list of examples names
let running = null; // AbortController of the request that is on its way

export function createRequest() {
  $("optimise").onclick = () => optimise().catch(problem);
  $("cancel").onclick = () => running?.abort();
  $("json").onchange = readJson;
  follow("request", () => {
    $("optimise").disabled = !state.request;
    $("optimise").textContent = state.request ? kindOf(state.request).verb : "Optimise";
    const text = JSON.stringify(state.request, null, 1);
    if ($("json").value !== text) $("json").value = text;
    if (state.request !== example) $("examples").selectedIndex = -1;
  });
  $("examples").onchange = (event) => set({ request: (example = structuredClone(event.target.selectedOptions[0].body)) });
  // the first answer does not wait for the document
  follow("answer", () => state.answer && fillExamples().catch(problem));
}

/** Puts the example of the first visit into the editor. */
export const setFirst = async () => set({ request: (example = await get(FIRST)) });

let document_ = null;

/** The OpenAPI document, asked for once. */
export const openapi = () => (document_ ??= get("openapi.json"));

export async function fillExamples() {
  if ($("examples").options.length) return;
  const [first, { paths }] = await Promise.all([get(FIRST), openapi()]);
  const option = (name, body) => Object.assign(el("option", {}, name), { body });
  const of = (path, mark) => Object.values(paths[path].post.requestBody.content["application/json"].examples).map(({ summary, value }) => option(mark + summary, value));
  $("examples").replaceChildren(option("From a bin to a shelf", first), ...of("/optimize", ""), ...of("/cycle", "Cycle: "));
  if (state.request !== example) $("examples").selectedIndex = -1;
}

/** A log was added: it can be used now. */
function added({ id, warnings }) {
  set({ request: { logs: [id] } });
  $("status").textContent = `The log is there. ${warnings.join(" ")}`;
}

function readJson() {
  try {
    const request = parsed($("json").value);
    problem(null);
    $("json").removeAttribute("aria-invalid");
    set({ request });
  } catch (error) {
    $("json").setAttribute("aria-invalid", "true");
    $("optimise").disabled = true; // it would send the request before this one
    problem(new Problem({ title: "This is no request", detail: error.message }));
  }
}

/** The request that a text holds. Throws SyntaxError. */
export function parsed(text) {
  const request = JSON.parse(text);
  if (typeof request === "object" && request && !Array.isArray(request)) return request;
  throw new SyntaxError("Give a JSON object: names and values in braces.");
}

/** What kind of thing a request asks for. */
export const kindOf = (request) => KINDS[Object.keys(KINDS).find((name) => name in request)] ?? MOTION;

/** Sends the request, shows its progress, then its answer. Throws Problem. */
export async function optimise(request = state.request) {
  const { path, show } = kindOf(request);
  const answer = await compute(path, request);
  if (answer) await show(answer, request);
}

/** The answer to a POST with progress; null if it was cancelled. Throws Problem. */
export async function compute(path, request) {
  running?.abort();
  const own = (running = new AbortController());
  const began = performance.now();
  const progress = { done: 0, total: 0, incumbents: [] };
  problem(null);
  busy(true);
  const timer = setInterval(() => tell(progress, began), 200);
  try {
    return await patiently(() => (path === "logs" ? addLog(request, own.signal) : streamed(path, request, progress, own.signal)));
  } catch (error) {
    if (error.name === "AbortError") {
      if (running === own) $("status").textContent = "Cancelled.";
      return null;
    }
    throw error;
  } finally {
    clearInterval(timer);
    if (running === own) busy(false), set({ best: null });
  }
}

async function streamed(path, request, progress, signal) {
  let answer = null;
  await stream(path, request, (name, data) => {
    if (name === "answer") answer = data;
    else if (name === "candidates") progress.total = data.total;
    else if (name === "candidate") progress.done += 1;
    else if (name === "incumbent") {
      progress.incumbents.push({ ...data, at: performance.now() });
      set({ best: { ...data, robot: request.robot ?? "ur5e" } });
    }
  }, signal);
  if (!answer) throw new Problem({ title: "The answer broke off", detail: "The connection ended before the answer came: send the request again." });
  return answer;
}

/** Asks a busy service again after the time that it names. */
async function patiently(attempt) {
  for (let left = PATIENCE; ; left--) {
    try {
      return await attempt();
    } catch (error) {
      if (!(left > 0 && error.details?.status === 503 && error.details.retry)) throw error;
      $("status").textContent = `The service is busy: trying again in ${error.details.retry} s.`;
      await new Promise((resolve) => setTimeout(resolve, 1000 * error.details.retry));
    }
  }
}

function busy(on) {
  $("cancel").hidden = !on;
  $("progress").hidden = !on;
  $("optimise").disabled = on;
  document.body.toggleAttribute("aria-busy", on);
  $("progress-chart").replaceChildren();
  if (on) $("progress-bar").removeAttribute("value");
}

function tell({ done, total, incumbents }, began) {
  if (total) $("progress-bar").value = Math.min(1, done / total);
  const incumbent = incumbents.at(-1);
  if (incumbents.length > 1) falling(incumbents, began);
  const parts = [`${((performance.now() - began) / 1000).toFixed(1)} s`];
  if (total) parts.push(`${done} of ${total} branches`);
  if (incumbent) parts.push(`best ${figure(incumbent.energy)} J, bound ${figure(incumbent.bound)} J, gap ${figure(100 * (incumbent.gap ?? NaN), 2)} %`);
  $("progress-text").textContent = parts.join(" · ");
}

/** Draws the best energy and its bound over time, as they fall and rise. */
function falling(incumbents, began) {
  const all = [...incumbents, { ...incumbents.at(-1), at: performance.now() }];
  const column = (key) => all.map((each) => each[key]);
  const line = (colour, dash) => ({ stroke: style(colour), width: 2, dash, paths: steps, points: { show: false } });
  const data = [column("at").map((at) => (at - began) / 1000), column("energy"), column("bound")];
  chart($("progress-chart"), [line("--good"), line("--bound", [5, 3])], data, { x: [0, data[0].at(-1)] });
}

/** Figures of a robot, asked for once. */
export async function robotOf(name) {
  if (!robots.has(name)) robots.set(name, await get(`robots/${encodeURIComponent(name)}`));
  return robots.get(name);
}

/** Shows an answer of POST /optimize. Without its request, the cell is what the answer says of its arm. */
export async function showAnswer(answer, request, cycle = null) {
  const robot = await robotOf(answer.robot);
  const asked = { ...answer.arm, ...request, robot: answer.robot };
  set({
    asked: request ?? null, cell: cellOf(asked, robot), robot, answer, chosen: [], cycle, time: 0, duration: answer.duration,
    arms: [{ name: "this motion", answer }],
  });
  const { warnings } = answer;
  $("status").textContent = warnings.join(" ").replaceAll("`", "");
}

/** Shows what went wrong; null: nothing. */
export function problem(error) {
  const box = $("problem");
  box.hidden = !error;
  box.replaceChildren();
  set({ problem: error });
  if (!error) return;
  if (!(error instanceof Problem)) console.error(error);
  const { title, type, errors = [] } = error.details ?? {};
  box.append(el("strong", {}, title ?? "Something went wrong"), " ", el("span", {}, error.message));
  if (errors.length) box.append(el("ul", {}, errors.map(({ loc, msg }) => el("li", {}, el("code", {}, loc.filter((part) => part !== "body").join(".")), ` ${msg}`))));
  if (type?.includes("/problems/")) box.append(" ", el("a", { href: type.slice(type.indexOf("problems/")) }, "What this means"));
}
