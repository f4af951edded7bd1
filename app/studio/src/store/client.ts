// Requests to the service. All addresses are relative to the page, so that they hold behind a
// proxy's path.
import { signal } from "@preact/signals";
import type { ProblemDetails } from "./types";

const KEY = "joulepath key";

/** The API key: until the tab is closed, or the page is left where the browser stores nothing. */
let given: string | null = null;

function keyNow(): string | null {
  try {
    return sessionStorage.getItem(KEY);
  } catch {
    return given;
  }
}

function keepKey(key: string): void {
  given = key;
  try {
    sessionStorage.setItem(KEY, key);
  } catch {
    // the page remembers it
  }
}

/** A refusal by the service, with its problem document. */
export class Problem extends Error {
  constructor(readonly details: ProblemDetails) {
    super(details.detail ?? details.title ?? "The service did not answer.");
  }
}

/** The dialog that asks for an API key: called with the key, or null. */
export const keyAsked = signal<((key: string | null) => void) | null>(null);

export const get = <T>(path: string, signal?: AbortSignal): Promise<T> =>
  json<T>(send(path, { signal }));

export const post = <T>(path: string, body: unknown, signal?: AbortSignal): Promise<T> =>
  json<T>(send(path, posting(body, signal)));

export const patch = <T>(path: string, body: unknown): Promise<T> =>
  json<T>(send(path, { ...posting(body), method: "PATCH" }));

/** A page of a list, with the parameters that have a value. Throws Problem. */
export const listed = <T>(path: string, query: Record<string, string | undefined>): Promise<T> => {
  const given = Object.entries(query).filter(([, value]) => value);
  return get<T>(`${path}?${new URLSearchParams(given as [string, string][])}`);
};

export const remove = (path: string) => send(path, { method: "DELETE" });

const posting = (
  body: unknown,
  signal?: AbortSignal,
  headers: Record<string, string> = {},
): RequestInit => ({
  method: "POST",
  body: JSON.stringify(body),
  headers: { "Content-Type": "application/json", ...headers },
  signal,
});

/**
 * The response to a request that was accepted. It asks for the key where one is needed. Throws
 * Problem.
 */
export async function send(path: string, options: RequestInit): Promise<Response> {
  const key = keyNow();
  const headers = {
    ...(options.headers as Record<string, string>),
    ...(key ? { Authorization: `Bearer ${key}` } : {}),
  };
  let response: Response;
  try {
    response = await fetch(path.replace(/^\//, ""), { ...options, headers });
  } catch (error) {
    if (isAbort(error)) throw error;
    throw new Problem({
      title: "The service does not answer",
      detail: "The service cannot be reached: is it running? Your work is saved here.",
    });
  }
  if (response.ok) return response;
  if (response.status === 401 && (await askForKey())) return send(path, options);
  throw new Problem(await problemOf(response));
}

const isAbort = (error: unknown) => error instanceof DOMException && error.name === "AbortError";

/** What to throw where an answer ended too early, in an error of the connection or without one. */
export const brokenOff = (error?: unknown) =>
  isAbort(error)
    ? error
    : new Problem({
        title: "The answer was interrupted",
        detail:
          "The connection to the service ended before the answer was complete. Your work is saved " +
          "here: send the request again.",
      });

async function json<T>(response: Promise<Response>): Promise<T> {
  const arrived = await response;
  return arrived.json().catch((error: unknown) => {
    throw brokenOff(error);
  }) as Promise<T>;
}

async function problemOf(response: Response): Promise<ProblemDetails> {
  const title = `The service answered ${response.status}`; // a proxy's own page
  const details = (await response.json().catch(() => ({ title }))) as ProblemDetails;
  return {
    status: response.status,
    retry: Number(response.headers.get("Retry-After")) || null,
    ...details,
  };
}

/** Posts, and passes every event of the stream on. Where the answer is plain JSON, it is the only event: `answer`.
 * Throws Problem, or AbortError. */
export async function stream(
  path: string,
  body: unknown,
  event: (name: string, data: unknown) => void,
  signal: AbortSignal,
): Promise<void> {
  const accept = { Accept: "text/event-stream, application/json;q=0.9" };
  const response = await send(path, posting(body, signal, accept));
  if (!response.headers.get("Content-Type")?.startsWith("text/event-stream")) {
    event("answer", await json(Promise.resolve(response)));
    return;
  }
  await read(response, event);
}

/** Passes the events of a job on, from the first to the last. Throws Problem, or AbortError. */
export const follow = async (
  job: string,
  event: (name: string, data: unknown) => void,
): Promise<void> => read(await send(`jobs/${encodeURIComponent(job)}/events`, {}), event);

async function read(
  response: Response,
  event: (name: string, data: unknown) => void,
): Promise<void> {
  const reader = response.body!.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (;;) {
    const { value, done } = await reader.read().catch((error: unknown) => {
      throw brokenOff(error);
    });
    if (done) return;
    text += value.replaceAll("\r\n", "\n");
    const blocks = text.split("\n\n");
    text = blocks.pop() ?? "";
    for (const block of blocks) pass(block, event);
  }
}

function pass(block: string, event: (name: string, data: unknown) => void): void {
  const lines = block.split("\n");
  const of = (name: string) =>
    lines
      .filter((line) => line.startsWith(`${name}:`))
      .map((line) => line.slice(name.length + 1).replace(/^ /, ""));
  const data = of("data").join("\n");
  if (!data) return;
  const name = of("event")[0] ?? "message";
  const content = JSON.parse(data) as ProblemDetails;
  if (name === "problem") throw new Problem(content);
  event(name, content);
}

function askForKey(): Promise<boolean> {
  return new Promise((resolve) => {
    keyAsked.value = (key) => {
      keyAsked.value = null;
      if (key) keepKey(key);
      resolve(Boolean(key));
    };
  });
}
