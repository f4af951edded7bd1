// Links that hold a whole cell, and project files.
import { Problem } from "./client";
import { economicsOf, type Economics } from "./economics";
import type { Pointer } from "./pointer";
import { isObject } from "./request";
import { economics, project, request, typed } from "./state";
import type { ApiRequest } from "./types";

export interface Cell {
  name?: string;
  request: ApiRequest;
  typed?: Record<Pointer, string>;
  economics?: Economics;
}

export const presentCell = (): Cell => ({
  name: project.value.name,
  request: request.value,
  typed: typed.value,
  economics: economics.value,
});

/** The request that a text holds. Throws SyntaxError. */
export function parsed(text: string): ApiRequest {
  const value: unknown = JSON.parse(text);
  if (isObject(value)) return value;
  throw new SyntaxError("Give a JSON object: names and values in braces.");
}

// of which every request of a cell has one
const TASK = ["robot", "start", "goal", "stops", "path", "tool", "payload", "scene"];

/** A cell from the text of a project file, or of a request alone. Throws SyntaxError. */
export function cellOf(text: string): Cell {
  const value = parsed(text);
  const cell = isObject(value.request) ? cellFrom(value) : { request: value };
  if (["trajectory", "legs", "map"].some((name) => name in cell.request))
    throw new SyntaxError("This is an answer: open its request instead.");
  if (!TASK.some((name) => name in cell.request))
    throw new SyntaxError("Neither targets nor a robot were found.");
  return cell;
}

/** A cell as another program or version wrote it: what has not the type of its field is left out. */
export function cellFrom({ name, request, typed, economics }: Record<string, unknown>): Cell {
  const texts = isObject(typed) ? Object.entries(typed) : [];
  return {
    ...(typeof name === "string" && name.trim() ? { name: name.trim() } : {}),
    request: isObject(request) ? request : {},
    typed: Object.fromEntries(
      texts.filter(([, text]) => typeof text === "string"),
    ) as Cell["typed"],
    ...(isObject(economics) ? { economics: economicsOf(economics) } : {}),
  };
}

/** The address of this page with the cell in it. */
export async function link(cell: Cell, address: string): Promise<string> {
  const url = new URL(address);
  url.hash = `r=${await packed(JSON.stringify(cell))}`;
  return url.href;
}

/** What an address asks for: a cell, a kept answer, or nothing. Throws Problem. */
export async function shared(hash: string): Promise<{ cell?: Cell; answer?: string }> {
  const asked = new URLSearchParams(hash.slice(1));
  const text = asked.get("r");
  const answer = asked.get("answer");
  if (answer) return { answer };
  if (!text) return {};
  try {
    return { cell: cellOf(await unpacked(text)) };
  } catch {
    throw new Problem({
      title: "The link is broken",
      detail: "A part of the link is missing: ask for it again. The example is shown instead.",
    });
  }
}

export const base64 = (bytes: Uint8Array): string =>
  btoa(bytes.reduce((text, byte) => text + String.fromCharCode(byte), ""));

export const fromBase64 = (text: string): Uint8Array =>
  Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

async function packed(text: string): Promise<string> {
  const bytes = await through(new Blob([text]), new CompressionStream("deflate-raw"));
  return base64(bytes).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
}

async function unpacked(text: string): Promise<string> {
  const bytes = fromBase64(text.replaceAll("-", "+").replaceAll("_", "/"));
  return new TextDecoder().decode(
    await through(new Blob([bytes as BlobPart]), new DecompressionStream("deflate-raw")),
  );
}

const through = async (blob: Blob, stream: GenericTransformStream) =>
  new Uint8Array(
    await new Response(
      blob
        .stream()
        .pipeThrough(
          stream as ReadableWritablePair<Uint8Array<ArrayBuffer>, Uint8Array<ArrayBuffer>>,
        ),
    ).arrayBuffer(),
  );

/** The motion as a table that `POST /evaluate` reads again. */
export function csvOf({ t, q, v, a, tau, tau_motor, power }: import("./types").Trajectory): string {
  const joints = (q[0] ?? []).map((_, j) => j + 1);
  const columns = { q, v, a, tau, tau_motor };
  const head = [
    "t",
    ...Object.keys(columns).flatMap((name) => joints.map((j) => `${name}${j}`)),
    "power",
  ];
  const lines = t.map((time, k) =>
    [time, ...Object.values(columns).flatMap((rows) => rows[k]!), power[k]].join(","),
  );
  return [head.join(","), ...lines, ""].join("\n");
}

/** A name of a file in small letters of any language, from what people call its content. */
export function fileName(title: string, otherwise: string, ending: string): string {
  const name = title.toLowerCase().replace(/[^\p{L}\p{M}\p{N}_.]+/gu, "-");
  return `${name.replace(/^[-.]+|[-.]+$/g, "") || otherwise}.${ending}`;
}

/** Offers a text or blob as a file. */
export function save(
  name: string,
  content: BlobPart | Blob,
  type = "application/octet-stream",
): void {
  const url = URL.createObjectURL(
    content instanceof Blob ? content : new Blob([content], { type }),
  );
  const anchor = Object.assign(document.createElement("a"), { href: url, download: name });
  document.body.append(anchor);
  anchor.click();
  anchor.remove();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}
