// What the service keeps: answers, jobs and studies. A click opens an answer.
import { get } from "./api.js";
import { $, el, figure } from "./dom.js";
import { problem, setRequest, showAnswer } from "./request.js";
import { showRound } from "./round.js";
import { state } from "./store.js";

const MOST = 50; // entries of each kind that are listed at a time
const OPENED = ["optimize", "cycle"]; // endpoints whose answers are drawn

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
  const page = `answers?limit=${MOST}${after ? `&after=${after}` : ""}`;
  const [{ answers, next }, { jobs }, { studies }] = await Promise.all([get(page), get(`jobs?limit=${MOST}`), get(`studies?limit=${MOST}`)]);
  const opened = async (path, kind) => list((await get(path))[kind], box);
  box.replaceChildren(
    ...group("Answers", answers.map((each) => entry(words(each), when(each.created), OPENED.includes(each.kind) && (() => openAnswer(each.id))))),
    ...(next ? [button("older", () => showKept(next))] : []),
    ...group("Jobs", jobs.map(({ id, name, state: now, created }) => entry(`${name ?? id.slice(0, 8)}: ${now}`, when(created), () => opened(`jobs/${id}?limit=${MOST}`, "requests")))),
    ...group("Studies", studies.map(({ id, name, created }) => entry(name, when(created), () => opened(`studies/${id}`, "history")))),
  );
}

const words = ({ kind, energy, duration, robot }) =>
  `${kind === "optimize" ? "" : `${kind}: `}${energy === null ? "" : `${figure(energy)} J, ${figure(duration)} s, `}${robot ?? ""}`;

/** The answers of a job or a study. */
function list(entries, box) {
  const rows = entries.slice(0, MOST).map(({ number, index, kind, energy, state: now, answer }) => {
    const title = `${number ?? index + 1}: ${kind}, ${(energy ?? null) === null ? (now ?? "no energy") : `${figure(energy)} J`}`;
    return entry(title, answer ? "" : "no kept answer", answer && OPENED.includes(kind) && (() => openAnswer(answer)));
  });
  box.replaceChildren(button("← all", showKept), el("ul", { class: "kept" }, rows));
}

/** Shows a kept answer by its path or id, of a motion or of a round. Throws Problem. */
export async function openAnswer(path) {
  const { answer } = await get(path.includes("/") ? path : `answers/${encodeURIComponent(path)}`);
  // what was asked for cannot be told from a round
  if (answer.legs) return setRequest(null), showRound(answer, null);
  if (!answer.branch) throw new Error("Only motions and rounds are shown here: this answer is of another kind.");
  // the same arm between the same ends: what the answer does not say of its request stays at the defaults
  setRequest({ robot: answer.robot, ...answer.arm, start: { q: answer.branch.start.q }, goal: { q: answer.branch.goal.q } });
  return showAnswer(answer, state.request);
}
