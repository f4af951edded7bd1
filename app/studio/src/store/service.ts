// What the service knows: robots, their figures, the OpenAPI document. Each is asked for once.
import { get, listed, send } from "./client";
import type { ApiRequest, Robot } from "./types";

const robots = new Map<string, Promise<Robot>>();
const meshes = new Map<string, Promise<Uint8Array>>();

/** Figures of a robot. Throws Problem. */
export function robotOf(name: string): Promise<Robot> {
  return once(robots, name, () => get<Robot>(`robots/${encodeURIComponent(name)}`));
}

/** A robot that is known without the service. */
export const knowRobot = (robot: Robot) => robots.set(robot.name, Promise.resolve(robot));

export const forgetRobot = (name: string) => robots.delete(name);

/** The file (glTF) of a robot's meshes. Throws Problem. */
export function meshFileOf(name: string): Promise<Uint8Array> {
  return once(meshes, name, async () => {
    const file = await send(`robots/${encodeURIComponent(name)}/meshes.glb`, {});
    return new Uint8Array(await file.arrayBuffer());
  });
}

export const knowMeshes = (name: string, file: Uint8Array) =>
  meshes.set(name, Promise.resolve(file));

function once<T>(known: Map<string, Promise<T>>, name: string, ask: () => Promise<T>): Promise<T> {
  const found = known.get(name);
  if (found) return found;
  const asked = ask();
  known.set(name, asked);
  asked.catch(() => known.delete(name));
  return asked;
}

/** A kept answer by its path. Throws Problem. */
export const keptAnswer = async <T>(path: string): Promise<T> =>
  (await get<{ answer: T }>(path)).answer;

export interface RobotSummary {
  name: string;
  title: string;
  joints: string[];
  rated_payload: number;
  added: boolean;
  energy_trust: string;
}

export const robotList = async (search = ""): Promise<RobotSummary[]> =>
  (await listed<{ robots: RobotSummary[] }>("robots", { search })).robots;

interface Example {
  summary: string;
  value: ApiRequest;
}

export interface OpenApi {
  paths: Record<
    string,
    {
      post?: {
        parameters?: {
          name: string;
          in: string;
          description?: string;
          schema: Record<string, unknown>;
        }[];
        requestBody?: { content: Record<string, { examples?: Record<string, Example> }> };
      };
    }
  >;
  components: {
    schemas: Record<
      string,
      { enum?: string[]; properties?: Record<string, { description?: string }> }
    >;
  };
}

let document_: Promise<OpenApi> | null = null;

/** The OpenAPI document. Throws Problem. */
export function openapi(): Promise<OpenApi> {
  document_ ??= get<OpenApi>("openapi.json").catch((error) => {
    document_ = null;
    throw error;
  });
  return document_;
}

/** The examples of `POST /optimize` and `POST /cycle`, by what they show. Throws Problem. */
export async function examples(): Promise<Example[]> {
  const { paths } = await openapi();
  const of = (path: string, mark: string) => {
    const given = paths[path]?.post?.requestBody?.content["application/json"]?.examples ?? {};
    return Object.values(given).map(({ summary, value }) => ({ summary: mark + summary, value }));
  };
  return [...of("/optimize", ""), ...of("/cycle", "Cycle: ")];
}
