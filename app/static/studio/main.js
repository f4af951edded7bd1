// Puts the page together, and shows an example at once.
import { createCandidates } from "./candidates.js";
import { $, figure, percent, tabs } from "./dom.js";
import { createDrag } from "./drag.js";
import { createEnergy } from "./energy.js";
import { createForm, showForm } from "./form.js";
import { createFront } from "./front.js";
import { openAnswer, showKept } from "./kept.js";
import { createLimits } from "./limits.js";
import { createMeshes } from "./meshes.js";
import { createPlayer, play } from "./player.js";
import { createPlots } from "./plots.js";
import { createRequest, fillExamples, optimise, problem, robots, setFirst, showAnswer } from "./request.js";
import { createCycle } from "./cycle.js";
import { createShare, shared } from "./share.js";
import { embedded } from "./standalone.js";
import { follow, set, state } from "./store.js";
import { createView, drawnTcp } from "./view.js";

const view = createView();
createPlayer(view);
createPlots();
createEnergy();
createLimits();
createCandidates();
createShare(view);
createCycle();
const inside = embedded();
if (!inside) for (const create of [createFront, createRequest, createForm, createDrag]) create(view);
createMeshes(view, inside);
if (!inside) tabs(document.querySelector("#ask > .tabs"), () => Promise.all([showForm(), showKept()]).catch(problem));
follow("answer", headline);

/** For tests, and for those who look in the console. */
window.studio = { state, view, tcp: drawnTcp };

/** Shows the example instead of what a link asks for, and why. */
const instead = (error) => setFirst().then(() => optimise()).then(() => problem(error));

start().catch((error) => (problem(error), Promise.all([showForm(), fillExamples()]))).catch(problem);
window.onhashchange = () => /^#(r|answer)=/.test(location.hash) && location.reload(); // another link in this tab

async function start() {
  const given = inside ?? (await shared().catch(instead));
  if (inside) {
    robots.set(inside.robot.name, inside.robot);
    await showAnswer(inside.answer, inside.request, inside.cycle);
  } else if (given?.answer) {
    await openAnswer(given.answer).catch(instead);
  } else if (given) {
    await (given.request ? set({ request: given.request }) : setFirst());
    await optimise();
  }
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) play();
}

function headline() {
  const { answer } = state;
  if (!answer) return;
  const { total } = answer.energy[answer.objective];
  const bound = answer.energy.lower_bound;
  const usual = answer.baselines.find(({ name }) => name === "controller_default");
  const facts = [`${figure(answer.duration)} s`, answer.status];
  if (bound > 0) facts.push(`within ${percent(total / bound - 1, 2)} of the least possible`);
  if (usual && usual.saving > 0) facts.push(`${percent(usual.saving, 2)} less than the controller's default${usual.within_limits ? "" : " (breaks a limit)"}`);
  $("facts").textContent = facts.join(" · ");
  $("joules").textContent = `${figure(total)} J`;
  const [from, to] = [answer.branch.start.label, answer.branch.goal.label];
  $("view").setAttribute("aria-label", `The arm ${answer.robot} moves from ${from} to ${to} in ${figure(answer.duration)} s and draws ${figure(answer.energy.electrical.total)} J.`);
  document.title = `${figure(total)} J in ${figure(answer.duration)} s · joulepath studio`;
}
