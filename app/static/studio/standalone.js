// One answer as a single HTML file that needs no service: the page itself, with its scripts and the answer inside.
import { send } from "./api.js";
import { meshFileOf } from "./meshes.js";
import { state } from "./store.js";

const IMPORT = /(\bfrom\s*|\bimport\s*\(?\s*)(["'])([^"'\n]+)\2/g;
const EMBEDDED = "embedded";

/** What is inside of a page that stands alone: {answer, request, robot}; null in the page of a service. */
export function embedded() {
  const data = document.getElementById(EMBEDDED);
  return data && JSON.parse(data.textContent);
}

/** The text of the file. Throws Problem. */
export async function standalone() {
  const page = new DOMParser().parseFromString(await text("studio"), "text/html");
  const map = JSON.parse(page.querySelector("script[type=importmap]").textContent).imports;
  const modules = await gathered(new URL("studio/main.js", location.href).href, map);
  const styles = await Promise.all([...page.querySelectorAll("link[rel=stylesheet]")].map((link) => text(link.getAttribute("href"))));
  for (const node of page.querySelectorAll("link[rel=stylesheet], link[rel=modulepreload], head script, #ask, #share, noscript, header a.button")) node.remove();
  page.querySelector("#compute-front").closest("article").remove();
  page.body.classList.add("alone");
  const { answer, robot, cycle } = state;
  const file = robot.has_meshes ? await meshFileOf(robot).catch(() => null) : null;
  const data = { answer: { ...answer, answer: null }, request: state.cell, robot, cycle, meshes: file && base64(file) };
  const main = nameOf(new URL("studio/main.js", location.href).href);
  // as text: elements would be held to the policy of this page
  const inside = [
    `<style>${styles.join("\n")}</style>`,
    `<script type="importmap">${JSON.stringify({ imports: modules })}</script>`,
    `<script type="application/json" id="${EMBEDDED}">${JSON.stringify(data).replaceAll("<", "\\u003c")}</script>`,
    `<script type="module">import "${main}";</script>`,
  ].join("\n");
  return `<!doctype html>\n${page.documentElement.outerHTML.replace("</head>", () => `${inside}\n</head>`)}`;
}

const text = async (path) => (await send(path, {})).text();

const nameOf = (url) => url.slice(new URL("studio/", location.href).href.length);

/** All modules that one needs, as data URLs by name; in their texts, imports are by these names. */
async function gathered(first, map) {
  const found = new Map();
  const waiting = [first];
  while (waiting.length) {
    const url = waiting.pop();
    if (found.has(url)) continue;
    found.set(url, null);
    const source = await text(`studio/${nameOf(url)}`);
    const named = source.replace(IMPORT, (whole, before, quote, name) => {
      const target = resolved(name, url, map);
      if (!target) return whole;
      waiting.push(target);
      return `${before}${quote}${nameOf(target)}${quote}`;
    });
    found.set(url, `data:text/javascript;base64,${base64(new TextEncoder().encode(named))}`);
  }
  return Object.fromEntries([...found].map(([url, data]) => [nameOf(url), data]));
}

function resolved(name, from, map) {
  if (/^\.{1,2}\//.test(name)) return new URL(name, from).href;
  const key = Object.keys(map).find((each) => name === each || (each.endsWith("/") && name.startsWith(each)));
  return key ? new URL(map[key] + name.slice(key.length), location.href).href : null;
}

export const base64 = (bytes) => btoa(bytes.reduce((text, byte) => text + String.fromCharCode(byte), ""));
