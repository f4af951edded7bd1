// What the service keeps: answers, jobs and studies. A click opens an answer.
import { get, send } from "./api.js";
import { $, el, figure } from "./dom.js";
import { problem, showAnswer } from "./request.js";
import { showCycle } from "./cycle.js";
import { set, state } from "./store.js";

const MOST = 50; // entries of each kind that are listed at a time
const OPENED = ["optimize", "cycle"]; // endpoints whose answers are drawn

const OF_LOGS = ["identify", "residuals"]; // answers of identifications, which have a list of their own

let file = null; // the log that is to be added

const when = (time) => new Date(time).toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" });
const button = (text, act) => el("button", { type: "button", onclick: () => act().catch(problem) }, text);

function entry(text, detail, act) {
  const words = [text, el("small", {}, detail)];
  return el("li", {}, act ? el("button", { type: "button", class: "jump", onclick: () => act().catch(problem) }, words) : words);
}

const group = (title, entries) => [el("h2", {}, title), entries.length ? el("ul", { class: "kept" }, entries) : el("p", { class: "hint" }, "none")];

/** Lists what is kept; `after`: the answers from there on. Throws Problem. */
export async function showKept(after) {
  const box = $("pane-kept");
  if (box.hidden) return;
  const of = (kind, from) => get(`${kind}?limit=${MOST}${from ? `&after=${from}` : ""}`);
  const [{ answers, next }, { jobs }, { studies }, { identifications }, { logs }] = await Promise.all([of("answers", after), of("jobs"), of("studies"), of("identifications"), of("logs")]);
  const opened = async (id, path, kind) => list((await get(path))[kind], box, id);
  box.replaceChildren(
    ...group("Answers", answers.filter(({ kind }) => !OF_LOGS.includes(kind)).map((each) => entry(words(each), when(each.created), OPENED.includes(each.kind) && (() => openAnswer(each.id))))),
    ...(next ? [button("older", () => showKept(next))] : []),
    ...group("Jobs", jobs.map(({ id, name, state: now, created }) => entry(`${name ?? id.slice(0, 8)}: ${now}`, when(created), () => opened(id, `jobs/${id}?limit=${MOST}`, "requests")))),
    ...group("Identifications", identifications.map(({ id, robot, state: now, created }) => entry(`${robot ?? id.slice(0, 8)}: ${now}`, when(created), () => openIdentification(id)))),
    ...group("Logs", logs.map(({ id, name, robot, created }) =>
      entry(`${robot}: ${name ?? id.slice(0, 8)}`, when(created), async () => ask({ logs: [...new Set([...(state.request?.logs ?? []), id])] })))),
    el("label", { class: "row small" }, "Add a log", el("input", { type: "file", accept: ".csv,.gz,.txt", onchange: chooseLog })),
    ...group("Studies", studies.map(({ id, name, created }) => entry(name, when(created), () => opened(id, `studies/${id}`, "history")))),
  );
}

const words = ({ kind, energy, duration, robot }) =>
  `${kind === "optimize" ? "" : `${kind}: `}${energy === null ? "" : `${figure(energy)} J, ${figure(duration)} s, `}${robot ?? ""}`;

/** The answers of a job or a study of this id. */
function list(entries, box, id) {
  const rows = entries.slice(0, MOST).map(({ number, index, kind, energy, state: now, answer }) => {
    const title = `${number ?? index + 1}: ${kind}, ${(energy ?? null) === null ? (now ?? "no energy") : `${figure(energy)} J`}`;
    const open = kind === "identify" ? () => openIdentification(id) : OPENED.includes(kind) && answer && (() => openAnswer(answer));
    return entry(title, answer ? "" : "no kept answer", open);
  });
  box.replaceChildren(button("← all", showKept), el("ul", { class: "kept" }, rows));
}

/** Puts a request into the form. */
function ask(request) {
  set({ request });
  $("tab-form").click();
}

function chooseLog({ target }) {
  [file] = target.files;
  target.value = ""; // so that the same file can be chosen again
  if (file) ask({ log: file.name, robot: state.request?.robot ?? state.answer?.robot ?? "ur5e", name: file.name.slice(0, 80) });
}

/** Sends the chosen file; the other fields of the request say how it is read. Throws Problem, or AbortError. */
export async function addLog({ log, ...settings }, signal) {
  const text = (value) => (typeof value === "string" ? value : JSON.stringify(value));
  const query = new URLSearchParams(Object.entries(settings).map(([name, value]) => [name, text(value)]));
  if (file?.name !== log) throw new Error(`Choose the file ${log} again: the page has no file of this name.`);
  return (await send(`logs?${query}`, { method: "POST", body: file, signal, headers: { "Content-Type": "text/csv" } })).json();
}

/** Shows an identification; its page is loaded when it is needed. Throws Problem. */
export const openIdentification = async (id) => (await import("./residuals.js")).showIdentification(id);

/** Shows a kept answer by its path or id, of a motion or of a cycle. Throws Problem. */
export async function openAnswer(path) {
  problem(null);
  const { answer } = await get(path.includes("/") ? path : `answers/${encodeURIComponent(path)}`);
  // what was asked for cannot be told from a cycle
  if (answer?.legs) return set({ request: null }), showCycle(answer, null);
  if (!answer?.branch) throw new Error("Only motions and cycles are shown here: this answer is of another kind.");
  // the same arm between the same ends: what the answer does not say of its request stays at the defaults
  set({ request: { robot: answer.robot, ...answer.arm, start: { q: answer.branch.start.q }, goal: { q: answer.branch.goal.q } } });
  return showAnswer(answer, state.request);
}
