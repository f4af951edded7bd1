// Take away: a link that holds the request, and downloads.
import { Problem, send } from "./api.js";
import { $, el, save } from "./dom.js";
import { openapi, parsed, problem } from "./request.js";
import { fromBase64 } from "./shapes.js";
import { base64, embedded, standalone } from "./standalone.js";
import { state } from "./store.js";

const WARNING = "Set payload, speed and safety limits on the controller before you run it. No format was run on hardware.";

export function createShare(view) {
  $("downloads").ontoggle = () => $("downloads").open && !$("exports") && !embedded() && offerExports().catch(problem);
  if ($("share")) $("share").onclick = () => share().catch(problem);
  const files = [
    ["Answer (JSON)", () => save("answer.json", JSON.stringify(state.cycle ? { ...state.cycle, loads: undefined } : state.answer), "application/json"), true],
    ["Samples (CSV)", () => save("motion.csv", csv(state.answer.trajectory), "text/csv"), true],
    ["Page that stands alone (HTML)", async () => save("motion.html", await standalone(), "text/html")],
    ["Request (JSON)", () => save("request.json", JSON.stringify(state.asked ?? state.request, null, 1), "application/json"), true],
    ["Robot (URDF)", async () => save(`${state.answer.robot}.urdf`, await (await send(`robots/${state.answer.robot}/urdf`, {})).blob())],
    ...(view ? [["Picture (PNG)", async () => save("motion.png", await view.picture()), true]] : []),
  ];
  const given = embedded() ? files.filter(([, , alone]) => alone) : files;
  $("download-list").replaceChildren(...given.map(([name, give]) =>
    el("button", { type: "button", onclick: async () => { $("downloads").open = false; if (state.answer) await Promise.resolve(give()).catch(problem); } }, name)));
}

/** Buttons for the formats that the service exports to. */
async function offerExports() {
  const { paths, components } = await openapi();
  const post = paths["/export/{format}"]?.post;
  if (!post) return;
  const { schema, ...parameter } = post.parameters.find(({ name }) => name === "format");
  const formats = schema.enum ?? components.schemas[schema.$ref.split("/").at(-1)].enum;
  const texts = { ...parameter, ...schema }["x-enum-descriptions"] ?? {};
  const button = (format) => el("button", { type: "button", title: texts[format] ?? "", onclick: () => exportAs(format).catch(problem) }, format);
  $("download-list").append(el("hr"), el("p", {}, "For the robot's controller"), el("div", { id: "exports" }, formats.map(button)), el("p", {}, WARNING));
}

async function exportAs(format) {
  $("downloads").open = false;
  problem(null);
  const { answer } = state;
  const body = { answer: answer.answer ?? answer };
  const response = await send(`export/${format}`, { method: "POST", body: JSON.stringify(body), headers: { "Content-Type": "application/json" } });
  const name = /filename="?([^";]+)/.exec(response.headers.get("Content-Disposition") ?? "")?.[1] ?? `motion.${format}`;
  save(name, await response.blob());
  $("status").textContent = [response.headers.get("Joulepath-Notes"), WARNING].filter(Boolean).join("; ");
}

/** The motion as a table that `POST /evaluate` reads again. */
export function csv({ t, q, v, a, tau, tau_motor, power }) {
  const joints = q[0].map((_, j) => j + 1);
  const columns = { q, v, a, tau, tau_motor };
  const head = ["t", ...Object.keys(columns).flatMap((name) => joints.map((j) => `${name}${j}`)), "power"];
  const lines = t.map((time, k) => [time, ...Object.values(columns).flatMap((rows) => rows[k]), power[k]].join(","));
  return [head.join(","), ...lines, ""].join("\n");
}

async function share() {
  const address = new URL(location.href);
  const asked = state.asked ?? state.request;
  address.hash = asked ? `r=${await packed(JSON.stringify(asked))}` : `answer=${state.answer.answer.split("/").at(-1)}`;
  history.replaceState(null, "", address);
  try {
    await navigator.clipboard.writeText(address.href);
    $("status").textContent = "The link is copied. It is the address of this page now.";
  } catch {
    $("status").textContent = "The address of this page is the link now: copy it.";
  }
}

/** What the address of the page asks for: {request} or {answer}, or nothing. Throws Problem. */
export async function shared() {
  const asked = new URLSearchParams(location.hash.slice(1));
  const broken = () => { throw new Problem({ title: "The link is broken", detail: "A part of it is missing: ask for it again. This is the example." }); };
  return { request: asked.get("r") && (await unpacked(asked.get("r")).then(parsed).catch(broken)), answer: asked.get("answer") };
}

async function packed(text) {
  const bytes = await through(new Blob([text]), new CompressionStream("deflate-raw"));
  return base64(bytes).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
}

async function unpacked(text) {
  const bytes = fromBase64(text.replaceAll("-", "+").replaceAll("_", "/"));
  return new TextDecoder().decode(await through(new Blob([bytes]), new DecompressionStream("deflate-raw")));
}

const through = async (blob, stream) => new Uint8Array(await new Response(blob.stream().pipeThrough(stream)).arrayBuffer());
