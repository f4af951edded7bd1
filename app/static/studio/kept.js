// What the service keeps: answers seen in this browser, jobs and studies. A click opens an answer.
import { get, send } from "./api.js";
import { $, el, figure } from "./dom.js";
import { problem, setRequest, showAnswer } from "./request.js";
import { showRound } from "./round.js";
import { follow, state } from "./store.js";

const SEEN = "joulepath answers";
const MOST_SEEN = 40;
const MOST_LISTED = 50;

export const createKept = () => follow("answer", remember);

const seen = () => JSON.parse(localStorage.getItem(SEEN) ?? "[]");

function remember() {
  const { answer, round } = state;
  if (!answer?.answer || round) return;
  const entry = { path: answer.answer, text: `${figure(answer.energy.electrical.total)} J, ${figure(answer.duration)} s, ${answer.robot}`, at: new Date().toISOString() };
  localStorage.setItem(SEEN, JSON.stringify([entry, ...seen().filter(({ path }) => path !== entry.path)].slice(0, MOST_SEEN)));
}

/** Lists what is kept. Throws Problem. */
export async function showKept() {
  const box = $("pane-kept");
  if (box.hidden) return;
  const [{ jobs }, { studies }] = await Promise.all([get("jobs"), get("studies")]);
  const entry = (text, detail, act) => el("li", {}, el("button", { type: "button", class: "jump", onclick: () => act().catch(problem) }, text, el("small", {}, ` ${detail}`)));
  const group = (title, entries) => [el("h2", {}, title), entries.length ? el("ul", { class: "kept" }, entries) : el("p", { class: "hint" }, "none")];
  const when = (time) => new Date(time).toLocaleString();
  box.replaceChildren(
    ...group("Answers seen in this browser", seen().map(({ path, text, at }) => entry(text, when(at), () => openAnswer(path)))),
    ...group("Jobs", jobs.slice(0, MOST_LISTED).map((job) => entry(`${job.name ?? job.id.slice(0, 8)}: ${job.state}`, when(job.created), async () => list(await results(job.id), box)))),
    ...group("Studies", studies.slice(0, MOST_LISTED).map((study) => entry(study.name, when(study.created), async () => list((await get(`studies/${study.id}`)).history, box)))),
  );
}

/** The answers of a job or a study. */
function list(entries, box) {
  const back = el("button", { type: "button", onclick: () => showKept().catch(problem) }, "← all");
  const rows = entries.slice(0, MOST_LISTED).map((each) => {
    const answer = each.answer ?? null;
    const title = `${each.number ?? each.index + 1}: ${each.kind}, ${each.energy === null ? (each.state ?? "no energy") : `${figure(each.energy)} J`}`;
    return el("li", {}, typeof answer === "string" ? el("button", { type: "button", class: "jump", onclick: () => openAnswer(answer).catch(problem) }, title) : el("span", {}, `${title}: no kept answer`));
  });
  box.replaceChildren(back, el("ul", { class: "kept" }, rows));
}

/** The outcomes of a job: a line of JSON each. */
async function results(id) {
  const text = await (await send(`jobs/${id}/results`, {})).text();
  return text.split("\n").filter(Boolean).slice(0, MOST_LISTED).map((line) => JSON.parse(line));
}

/** Shows a kept answer by its path or id, of a motion or of a round. Throws Problem. */
export async function openAnswer(path) {
  const { answer } = await get(path.includes("/") ? path : `answers/${encodeURIComponent(path)}`);
  if (answer.legs) return showRound(answer, {});
  if (!answer.branch) throw new Error("Only motions and rounds are shown here: this answer is of another kind.");
  // the same arm between the same ends: what the answer does not say of its request stays at the defaults
  setRequest({ robot: answer.robot, ...answer.arm, start: { q: answer.branch.start.q }, goal: { q: answer.branch.goal.q } });
  return showAnswer(answer, state.request);
}
