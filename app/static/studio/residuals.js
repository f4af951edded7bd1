// An identification: measured and modelled torques and power over time, and how well the figures are known.
import { get, Problem } from "./api.js";
import { chart } from "./chart.js";
import { $, el, figure, percent, style, table } from "./dom.js";
import { jointName } from "./plots.js";
import { kindOf, robotOf, setFirst } from "./request.js";
import { follow, set, state } from "./store.js";

const PAUSE = 500; // between two looks at work that runs [ms]
const APART = 1e-6; // after a move, where its curve ends [s]
const COLOURS = { measured: "ink-2", modelled: "good", residual: "bad", "held out: predicted by a fit without it": "held" };
const UNITS = { offset: "N·m", payload_mass: "kg", link_mass_scale: "1" }; // of what no document has
const box = $("identification");

follow("answer", () => show(false));

/** Opens an identification by its id, after its end. Throws Problem. */
export async function showIdentification(id) {
  const path = `identifications/${encodeURIComponent(id)}`;
  let found = await get(path);
  while (["queued", "running"].includes(found.state)) {
    $("status").textContent = `Identification: ${found.state} …`;
    await new Promise((resolve) => setTimeout(resolve, PAUSE));
    found = await get(path);
  }
  $("status").textContent = "";
  if (found.problem) throw new Problem(found.problem);
  if (!found.result) throw new Problem({ title: "Nothing was found", detail: `The identification is ${found.state}.` });
  const [{ moves }, robot] = await Promise.all([get(`${path}/residuals`), robotOf(found.result.robot)]);
  const ids = [...new Set(moves?.map(({ log }) => log))];
  const logs = await Promise.all(ids.map((log) => get(`logs/${log}`).catch(() => ({ id: log, warnings: ["This log was deleted."] }))));
  set({ playing: false });
  box.replaceChildren(
    head(found, robot),
    el("div", { class: "columns" }, curves(moves ?? [], logs, robot), errors(found.result.validation, robot), notes(found, logs), figures(found.result, robot)),
  );
  show(true);
  box.querySelector("select")?.onchange();
}

/** Shows the identification, or the motion. */
function show(on) {
  for (const id of ["stage", "figures"]) $(id).hidden = on;
  box.hidden = !on;
  (on ? box : $("stage")).scrollIntoView();
}

function head({ figures: id, created, result }, robot) {
  const told = result.parameters.filter(({ identified }) => identified).length;
  const use = el("button", { type: "button", class: "primary", disabled: !id, onclick: () => useFigures(robot.name, id) }, "Use these figures");
  return el("h2", { class: "split" },
    el("span", {}, `Identification of ${robot.name} `, el("small", {}, `${new Date(created).toLocaleString()}, ${told} of ${result.parameters.length} figures told by the logs`)),
    el("span", { class: "tools" }, use, el("button", { type: "button", onclick: () => show(false) }, "Back to the motion")));
}

/** The next request computes with these figures. */
async function useFigures(robot, figures) {
  const motion = [state.request, state.asked].find((request) => request && kindOf(request).drawn);
  if (!motion) await setFirst();
  set({ request: { ...(motion ?? state.request), robot, figures } });
  show(false);
  $("tab-form").click();
  $("status").textContent = "The request has these figures now: Optimise computes with them.";
}

/** Charts of all joints and of the power, of the moves that a list chooses. */
function curves(moves, logs, robot) {
  if (!moves.length) return el("article", {}, el("h2", {}, "Residuals"), el("p", { class: "hint" }, "None are kept: an earlier version identified these figures."));
  const groups = logs.map(({ id, name }) => ({ name: name ?? `log ${id.slice(0, 8)}`, own: moves.filter(({ log }) => log === id).toSorted((a, b) => a.t[0] - b.t[0]) }));
  const single = (name) => (move, k) => [`${name}: move ${k + 1}${move.held_out ? ", held out" : ""}`, [move]];
  const options = groups.flatMap(({ name, own }) => [[`${name}: all moves`, own], ...own.map(single(name))]);
  const choice = el("select", { "aria-label": "Moves shown" }, options.map(([text], k) => el("option", { value: k }, text)));
  const plotOf = (name, unit, of) => ({ of, unit, title: el("h3", {}, name), plot: el("div", { class: "plot" }) });
  const torqueOf = (j) => ({ torque }) => torque && { measured: torque.measured[j], modelled: torque.modelled[j] };
  const plots = robot.joints.map((name, j) => plotOf(jointName(name), "N·m", torqueOf(j)));
  plots.push(plotOf("power", "W", ({ power }) => power));
  choice.onchange = () => plots.forEach((each) => draw(each, options[choice.value][1]));
  return el("article", { class: "wide" },
    el("h2", { class: "split" }, el("span", {}, "Measured and modelled ", el("small", {}, "drag to zoom, double click to see all")), choice),
    el("p", {}, Object.entries(COLOURS).map(([text, colour]) => el("span", { class: `key ${colour}` }, text))),
    el("div", { class: "columns" }, plots.map(({ title, plot }) => el("div", {}, title, plot))));
}

function draw({ of, unit, title, plot }, moves) {
  const known = moves.filter(of);
  plot.parentNode.hidden = !known.length;
  if (!known.length) return;
  const rows = known.flatMap((move) => {
    const { measured, modelled } = of(move);
    const samples = move.t.map((t, k) => [t, measured[k], modelled[k], modelled[k] === null ? null : measured[k] - modelled[k], move.held_out]);
    return [...samples, [move.t.at(-1) + APART, null, null, null, false]];
  });
  const [t, measured, modelled, residual, held] = [0, 1, 2, 3, 4].map((column) => rows.map((row) => row[column]));
  const all = [measured, modelled, residual].flat().filter((value) => value !== null);
  const [low, high] = [Math.min(0, ...all) * 1.08, Math.max(0, ...all) * 1.08];
  const line = (colour, width) => ({ stroke: style(`--${colour}`), width, points: { show: false } });
  const band = { fill: style("--held"), fillTo: low, width: 0, points: { show: false } };
  const cursor = { drag: { x: true, y: false }, sync: { key: "residuals" } };
  chart(plot, [band, line("ink-2", 1), line("good", 2), line("bad", 1)], [t, held.map((out) => (out ? high : null)), measured, modelled, residual], { x: (_, from, to) => [from, to], y: [low, high], cursor });
  const left = residual.filter((value) => value !== null);
  const rms = `residual ${figure(Math.sqrt(left.reduce((sum, value) => sum + value * value, 0) / left.length))} ${unit} rms`;
  title.replaceChildren(title.firstChild, el("small", {}, ` ${unit}; ${rms}`));
  plot.setAttribute("role", "img");
  plot.setAttribute("aria-label", `${title.firstChild.textContent}, measured and modelled: ${rms}`);
}

/** Errors on moves that no fit has seen: of these figures, of the robot's own, and of a constant power. */
function errors({ moves, fitted, own, constant, coverage, half_width }, robot) {
  const row = (name, unit, of) => [name, ...[fitted, own].map(of), "", unit];
  const torque = fitted.torque ? [
    ...robot.joints.map((name, j) => row(`torque, ${jointName(name)}`, "%", ({ torque: each }) => each.relative[j])),
    row("energy at the shafts", "%", ({ torque: each }) => each.shaft_energy), row("energy in copper", "%", ({ torque: each }) => each.copper_energy),
  ] : [];
  const names = { rmse: ["power, root mean square", "W"], energy_mean: ["energy of a move, mean", "%"], energy_p90: ["its 90th percentile", "%"], energy_max: ["its greatest", "%"] };
  const power = fitted.power ? Object.entries(names).map(([key, [name, unit]]) => [name, fitted.power[key], own.power[key], constant[key], unit]) : [];
  return el("article", {}, el("h2", {}, "Errors ", el("small", {}, `on ${moves} moves that the fit has not seen`)),
    table(["", "these figures", "robot's own", "constant", ""], [...torque, ...power]),
    coverage === null ? null : el("p", { class: "hint" }, `${percent(coverage, 2)} of the energies lie between their P5 and P95, which are ${figure(half_width, 2)} % below and above the middle.`));
}

/** What is odd in the logs or in what was found, and what would help most. */
function notes({ figures: id, result }, logs) {
  const { residuals: { white }, physical, advice, payload } = result;
  const all = [
    !id && "The figures are not stored: there was no room, or they were deleted.",
    payload && (payload.why || `The last log carried ${figure(payload.mass)} ± ${figure(payload.mass_sd, 2)} kg.`),
    physical && !physical.consistent && "Not all links are real bodies.",
    !white && "Neighbouring residuals are alike: something moves that the model does not have. Standard deviations are over motions, and hold.",
    ...logs.flatMap(({ id: log, name, warnings }) => warnings.map((text) => `${name ?? log.slice(0, 8)}: ${text}`)),
    advice && `Most of the energy's uncertainty (${percent(advice.share, 2)}) is from ${advice.figure.replaceAll("_", " ")}. ${advice.do}`,
  ].filter(Boolean);
  return el("article", {}, el("h2", {}, "Warnings and advice"), all.length ? el("ul", {}, all.map((text) => el("li", {}, text.replaceAll("`", "")))) : el("p", { class: "hint" }, "none"));
}

/** All figures that were sought, with what the robot's own documents say of those that the logs did not tell. */
function figures({ parameters, document: found }, robot) {
  const own = [robot.drives, robot.electronics, robot.friction.laws[0].coefficients];
  const these = [found.drives, found.electronics, found.friction_laws?.identified];
  const of = (places, name) => places.find((place) => place?.[name])?.[name];
  const rows = parameters.map(({ figure: name, joint, value, sd, previous, identified, why }) => [
    el("span", { title: why }, name.replaceAll("_", " "), why ? el("small", {}, ` ${why}`) : null),
    joint === null ? "" : jointName(robot.joints[joint]), value, identified ? sd : null,
    previous, of(identified ? these : own, name)?.trust ?? "–", (of(these, name) ?? of(own, name))?.unit ?? UNITS[name] ?? "",
  ]);
  return el("article", { class: "wide" }, el("h2", {}, "Figures ", el("small", {}, "trust: A maker's, B fitted to measured data, C second-hand, T of a sister robot, E default")),
    table(["figure", "joint", "value", "standard deviation", "robot's own", "trust", "unit"], rows));
}
