// What a person reads when the connection to the service fails.
import { expect, it, vi } from "vitest";
import { get, keyAsked, Problem } from "../src/store/client";
import { optimise } from "../src/store/run";
import { MOVE } from "./cells";

const answers = (body: BodyInit, type: string) =>
  vi.stubGlobal("fetch", () =>
    Promise.resolve(new Response(body, { headers: { "Content-Type": type } })),
  );
const broken = (first: string) =>
  new ReadableStream({
    start: (controller) => controller.enqueue(new TextEncoder().encode(first)),
    pull: (controller) => controller.error(new TypeError("network error")),
  });
const EVENTS = "text/event-stream";
const listen = () => optimise(MOVE);

it.each([
  [
    "events that break off",
    () => (answers(broken("event: progress\ndata: {}\n\n"), EVENTS), listen()),
  ],
  ["events without an answer", () => (answers("event: progress\ndata: {}\n\n", EVENTS), listen())],
  [
    "an answer that breaks off",
    () => (answers(broken('{"id": "'), "application/json"), get("robots")),
  ],
  ["an answer that is cut off", () => (answers('{"id": "', "application/json"), get("robots"))],
])("%s are told as an answer that broke off", async (_, asked) => {
  const problem = await (asked() as Promise<unknown>).catch((error: unknown) => error);
  expect(problem).toBeInstanceOf(Problem);
  expect((problem as Problem).message).toContain("ended before the answer was complete");
});

it("a browser that stores nothing remembers the key until the page is left", async () => {
  const refuse = () => {
    throw new DOMException("Access is denied.", "SecurityError");
  };
  vi.stubGlobal("sessionStorage", { getItem: refuse, setItem: refuse });
  vi.stubGlobal("fetch", (_: string, { headers }: { headers: Record<string, string> }) => {
    const known = headers.Authorization === "Bearer key";
    return Promise.resolve(new Response("{}", { status: known ? 200 : 401 }));
  });
  const first = get("robots");
  await vi.waitFor(() => expect(keyAsked.value).not.toBeNull());
  keyAsked.value!("key");
  expect(await first).toEqual({});
  expect(await get("robots")).toEqual({});
});
