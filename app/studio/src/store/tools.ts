// Tools by name: a request that names one has its shape and its TCP.
import { effect, signal } from "@preact/signals";
import { get } from "./client";
import { request } from "./state";
import { said } from "./trouble";
import type { ApiRequest, Parameter } from "./types";

export interface ToolSummary {
  name: string;
  title: string;
}

export interface ToolDetail extends ToolSummary {
  trust: Record<string, string>;
  mass: Parameter;
  center_of_mass: Parameter;
  tcp: Parameter;
  capsules: Parameter;
}

const known = new Map<string, Promise<ToolDetail>>();

/** The tool that the request names, when its figures have come. */
export const toolNow = signal<ToolDetail | null>(null);

/** Why the figures of the tool have not come, in words; empty if nothing went wrong. */
export const toolWhy = signal("");

/** Throws Problem. */
export const toolList = async (): Promise<ToolSummary[]> =>
  (await get<{ tools: ToolSummary[] }>("tools")).tools;

/** Figures of a tool, asked for once. Throws Problem. */
function toolOf(name: string): Promise<ToolDetail> {
  let asked = known.get(name);
  if (!asked) {
    asked = get<ToolDetail>(`tools/${encodeURIComponent(name)}`);
    known.set(name, asked);
    asked.catch(() => known.delete(name));
  }
  return asked;
}

export const toolName = ({ tool }: ApiRequest): string | null =>
  typeof tool === "string" ? tool : null;

/** The request with the shape and the TCP of the tool that it names, as it is drawn. */
export function dressed(asked: ApiRequest, tool: ToolDetail | null): ApiRequest {
  if (toolName(asked) === null) return asked;
  if (tool?.name !== toolName(asked)) return { ...asked, tool: { capsules: [] } };
  const rows = tool.capsules.value as number[][];
  const capsules = rows.map((row) => ({
    start: row.slice(0, 3),
    end: row.slice(3, 6),
    radius: row[6]!,
  }));
  const own = tool.tcp.value as number[];
  return {
    ...asked,
    tool: { capsules },
    tcp: asked.tcp ?? { position: own.slice(0, 3), rpy: own.slice(3, 6) },
  };
}

/** Figures of the tool that a request names; null without one. Throws Problem. */
export async function namedTool(asked: ApiRequest): Promise<ToolDetail | null> {
  const name = toolName(asked);
  return name === null ? null : toolOf(name);
}

/** The request as `dressed`, with figures that are asked for. Throws Problem. */
export const dressedLater = async (asked: ApiRequest): Promise<ApiRequest> =>
  dressed(asked, await namedTool(asked));

/** Fetches the figures of the tool that the request names, from now on. */
export function followTool(): void {
  effect(() => {
    const name = toolName(request.value);
    toolWhy.value = "";
    if (name === toolNow.peek()?.name) return;
    if (name === null) {
      toolNow.value = null;
      return;
    }
    toolOf(name)
      .then((tool) => {
        if (toolName(request.peek()) === name) toolNow.value = tool;
      })
      .catch((error) => {
        if (toolName(request.peek()) === name)
          toolWhy.value = `The figures of this gripper could not be loaded. ${said(error)}`;
      });
  });
}
