// One answer as a single HTML file that needs no service: the page itself, with its scripts and the
// answer inside.
import { EMBEDDED, type Embedded } from "../store/alone";
import { send } from "../store/client";
import { meshFileOf } from "../store/service";
import { base64 } from "../store/share";
import type { Answered } from "../store/state";

const IMPORT = /(\bfrom\s*|\bimport\s*\(?\s*)(["'`])(\.{1,2}\/[^"'`\n]+)\2/g;
const ASSET = /url\(\.?\/?([\w.-]+\.woff2)\)/g;

const folder = () => new URL("studio/", location.href).href;
const nameOf = (url: string) => url.slice(folder().length);
const text = async (path: string) => (await send(path, {})).text();

/** The text of the file. Throws Problem. */
export async function standalone(shown: Answered): Promise<string> {
  const page = new DOMParser().parseFromString(await text("studio"), "text/html");
  const main = page.querySelector("script[type=module]")!.getAttribute("src")!;
  const modules = await gathered(new URL(main, location.href).href);
  const styles = await Promise.all(
    [...page.querySelectorAll("link[rel=stylesheet]")].map((link) =>
      styleOf(link.getAttribute("href")!),
    ),
  );
  for (const node of page.querySelectorAll(
    "link[rel=stylesheet], link[rel=modulepreload], head script, noscript",
  ))
    node.remove();
  const file = shown.robot.has_meshes ? await meshFileOf(shown.robot.name).catch(() => null) : null;
  const solution = { ...shown.solution, answer: null, candidates: [] };
  const data: Embedded = { answered: { ...shown, solution }, meshes: file && base64(file) };
  // as text: elements would be held to the policy of this page
  const inside = [
    `<style>${styles.join("\n")}</style>`,
    `<script type="importmap">${JSON.stringify({ imports: modules })}</script>`,
    `<script type="application/json" id="${EMBEDDED}">${JSON.stringify(data).replaceAll("<", "\\u003c")}</script>`,
    `<script type="module">import "${nameOf(new URL(main, location.href).href)}";</script>`,
  ].join("\n");
  return `<!doctype html>\n${page.documentElement.outerHTML.replace("</head>", () => `${inside}\n</head>`)}`;
}

/** A style sheet with its fonts inside. */
async function styleOf(path: string): Promise<string> {
  const source = await text(path);
  const fonts = new Map<string, string>();
  for (const [, name] of source.matchAll(ASSET)) {
    const bytes = new Uint8Array(await (await send(`studio/${name}`, {})).arrayBuffer());
    fonts.set(name!, `data:font/woff2;base64,${base64(bytes)}`);
  }
  return source.replace(ASSET, (_, name: string) => `url(${fonts.get(name)!})`);
}

/** All modules that one needs, as data URLs by name; in their texts, imports are by these names. */
async function gathered(first: string): Promise<Record<string, string>> {
  const found = new Map<string, string>();
  const waiting = [first];
  for (let url = waiting.pop(); url; url = waiting.pop()) {
    if (found.has(url)) continue;
    const own = url;
    found.set(own, "");
    const source = await text(`studio/${nameOf(own)}`);
    const named = source.replace(IMPORT, (_, before: string, quote: string, name: string) => {
      const target = new URL(name, own).href;
      waiting.push(target);
      return `${before}${quote}${nameOf(target)}${quote}`;
    });
    found.set(own, `data:text/javascript;base64,${base64(new TextEncoder().encode(named))}`);
  }
  return Object.fromEntries([...found].map(([url, data]) => [nameOf(url), data]));
}
