// Requests to the service. All addresses are relative to the page, so that they hold behind a proxy's path.
import { $ } from "./dom.js";

const KEY = "joulepath key";

/** A refusal by the service: `details` is its problem document (RFC 9457). */
export class Problem extends Error {
  constructor(details) {
    super(details.detail || details.title || "The service did not answer.");
    this.details = details;
  }
}

/** JSON of a GET. Throws Problem. */
export const get = async (path) => (await send(path, {})).json();

/** JSON of the answer to a POST. Throws Problem. */
export const post = async (path, body) => (await send(path, posting(body))).json();

const posting = (body, headers = {}) => ({ method: "POST", body: JSON.stringify(body), headers: { "Content-Type": "application/json", ...headers } });

/** The response to a request that was accepted. It asks for the key where one is needed. Throws Problem. */
export async function send(path, options) {
  const key = sessionStorage.getItem(KEY);
  const headers = { ...options.headers, ...(key ? { Authorization: `Bearer ${key}` } : {}) };
  let response;
  try {
    response = await fetch(path.replace(/^\//, ""), { ...options, headers });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Problem({ title: "The service cannot be reached", detail: "The service cannot be reached: is it running?" });
  }
  if (response.ok) return response;
  if (response.status === 401 && (await askForKey())) return send(path, options);
  const details = await response.json().catch(() => ({ title: `The service answered ${response.status}` })); // a proxy's own page
  throw new Problem({ status: response.status, retry: Number(response.headers.get("Retry-After")) || null, ...details });
}

/** Posts, and passes every event of the stream to `event(name, data)`. Where the answer is plain JSON, it is the only
 * event: `answer`. Throws Problem, or AbortError. */
export async function stream(path, body, event, signal) {
  const accept = { Accept: "text/event-stream, application/json;q=0.9" };
  const response = await send(path, { ...posting(body, accept), signal });
  if (!response.headers.get("Content-Type")?.startsWith("text/event-stream")) {
    event("answer", await response.json());
    return;
  }
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    text += value.replaceAll("\r\n", "\n");
    const blocks = text.split("\n\n");
    text = blocks.pop();
    for (const fields of blocks.map((block) => block.split("\n"))) {
      const of = (name) => fields.filter((line) => line.startsWith(`${name}:`)).map((line) => line.slice(name.length + 1).replace(/^ /, ""));
      const data = of("data").join("\n");
      if (!data) continue;
      const [name = "message"] = of("event");
      if (name === "problem") throw new Problem(JSON.parse(data));
      event(name, JSON.parse(data));
    }
  }
}

function askForKey() {
  const dialog = $("key-dialog");
  $("key").value = "";
  dialog.returnValue = "";
  if (!dialog.open) dialog.showModal();
  return new Promise((resolve) => {
    dialog.addEventListener("close", () => {
      const key = $("key").value.trim();
      if (dialog.returnValue !== "ok" || !key) return resolve(false);
      sessionStorage.setItem(KEY, key);
      resolve(true);
    }, { once: true });
  });
}
