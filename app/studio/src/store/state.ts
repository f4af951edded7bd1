// What the page shows. The request in SI is the one truth; what was typed stands beside it.
import { batch, computed, signal } from "@preact/signals";
import type { Matrix } from "./chain";
import { diff, type Change } from "./diff";
import { DEFAULT_ECONOMICS, type Economics } from "./economics";
import { put, type Pointer } from "./pointer";
import { kindOf } from "./request";
import type { ApiRequest, Cycle, Payload, Robot, Solution } from "./types";

export interface Project {
  id: string;
  name: string;
}

/** An answer with the request that it belongs to. */
export interface Answered {
  /** Null for a kept answer whose request nobody knows. */
  asked: ApiRequest | null;
  /** What is drawn around the motion: tool, payload, scene. */
  cell: ApiRequest;
  solution: Solution;
  robot: Robot;
  cycle: CycleShown | null;
  /** Wall time from the click to the answer [s]. */
  took: number | null;
}

export interface CycleShown extends Cycle {
  /** What the arm carries from each leg on, and obstacles that do not count then. */
  loads: { t0: number; payload: Payload | null; ignored: string[] }[];
}

/** An arm that moves on the clock of the answer beside it. */
export interface Racer {
  name: string;
  solution: Solution;
  colour: number;
}

export interface Run {
  endpoint: string;
  began: number;
  /** Time after which it ends in any case [s]; null: unknown. */
  deadline: number | null;
  done: number;
  total: number;
  incumbents: {
    at: number;
    energy: number;
    bound: number;
    gap: number | null;
    duration: number;
    q_goal?: number[];
  }[];
}

/** A place of the base that is looked at. */
export interface Looked {
  asked: ApiRequest;
  robot: Robot;
  /** Pose of the base there, in the frame of the present one. */
  pose: Matrix;
  state: "moving" | "computing" | "shown" | "failed";
  energy: number | null;
  why: string;
  motion: Answered | null;
}

/** What went wrong, and the fields that caused it. */
export interface Trouble {
  title: string;
  text: string;
  link: string | null;
  fields: { pointer: Pointer; text: string }[];
}

export const project = signal<Project>({ id: "", name: "Untitled cell" });
export const saved = signal<"" | "saving" | "saved" | "elsewhere" | "failed">("");
export const request = signal<ApiRequest>({});
export const typed = signal<Record<Pointer, string>>({});
export const answered = signal<Answered | null>(null);
export const racers = signal<Racer[]>([]);
export const run = signal<Run | null>(null);
export const trouble = signal<Trouble | null>(null);
export const economics = signal<Economics>(DEFAULT_ECONOMICS);
export const toast = signal("");

export type Page = "cell" | "jobs" | "logs" | "library";
export type Tab = "task" | "picture" | "answer";

export const page = signal<Page>("cell");
export const tab = signal<Tab>("picture");
export const selected = signal<Pointer | null>(null);
export const asJson = signal(false);
/** Whether the JSON editor holds a text that is no request. */
export const jsonBroken = signal(false);
/** Labels of the cells that hold no number, by their pointers. */
export const unread = signal<Record<Pointer, string>>({});

export const time = signal(0);
export const playing = signal(false);
export const show = signal({
  ghosts: true,
  path: true,
  nearest: true,
  margins: false,
  capsules: false,
  axes: true,
  fade: true,
});
/** Ghosts of further configurations, by a colour. */
export const ghosts = signal<{ q: number[]; colour: number }[]>([]);

export const kind = computed(() => kindOf(request.value));
/** What differs from the request of the answer. */
export const changes = computed<Change[]>(() => {
  const asked = answered.value?.asked;
  return asked ? diff(asked, request.value) : [];
});
export const stale = computed(() => changes.value.length > 0);

/** Whether one looks for a place of the robot. */
export const placing = signal(false);
export const looking = signal<Looked | null>(null);
/** An edit of the task ends the look. */
export const looked = computed(() =>
  placing.value && looking.value?.asked === request.value ? looking.value : null,
);
/** The motion that is played: of the place that is looked at, else of an answer that is not stale. */
export const played = computed(() =>
  looked.value ? looked.value.motion : stale.value ? null : answered.value,
);
export const duration = computed(
  () =>
    looked.value?.motion?.solution.duration ??
    Math.max(
      answered.value?.solution.duration ?? 1,
      ...racers.value.map(({ solution }) => solution.duration),
    ),
);

interface Snapshot {
  request: ApiRequest;
  typed: Record<Pointer, string>;
  /** The answer to the request, if it was shown. */
  answer: Answered | null;
}

const MOST = 200;
const past = signal<Snapshot[]>([]);
const future = signal<Snapshot[]>([]);
let lastEdit = { name: "", at: 0 };

export const canUndo = computed(() => past.value.length > 0);
export const canRedo = computed(() => future.value.length > 0);

const present = (): Snapshot => ({
  request: request.value,
  typed: typed.value,
  answer: stale.value ? null : answered.value,
});

/** Shows an answer from its start, with nothing beside it. */
export function display(answer: Answered): void {
  batch(() => {
    answered.value = answer;
    racers.value = [];
    ghosts.value = [];
    time.value = 0;
  });
}

/** Changes the request. Edits of one `name` within half a second are one step of undo. */
export function edit(
  next: ApiRequest,
  text: Record<Pointer, string> = typed.value,
  name = "",
): void {
  const now = performance.now();
  const merged = name !== "" && name === lastEdit.name && now - lastEdit.at < 500;
  lastEdit = { name, at: now };
  batch(() => {
    if (!merged) past.value = [...past.value, present()].slice(-MOST);
    future.value = [];
    request.value = next;
    typed.value = text;
    if (trouble.value) trouble.value = null;
  });
}

/** Sets one field, and remembers how it was typed. */
export function write(pointer: Pointer, value: unknown, text?: string): void {
  edit(
    put(request.value, pointer, value),
    text === undefined ? typed.value : { ...typed.value, [pointer]: text },
    text === undefined ? pointer : "",
  );
}

function step(from: typeof past, to: typeof past): void {
  const snapshot = from.value.at(-1);
  if (!snapshot) return;
  batch(() => {
    from.value = from.value.slice(0, -1);
    to.value = [...to.value, present()];
    request.value = snapshot.request;
    typed.value = snapshot.typed;
    trouble.value = null;
    if (snapshot.answer && snapshot.answer !== answered.value) display(snapshot.answer);
  });
  lastEdit = { name: "", at: 0 };
}

export const undo = () => step(past, future);
export const redo = () => step(future, past);

/** Puts a whole cell in place of this one; there is nothing to undo in it yet. */
export function replaceCell(cell: {
  project: Project;
  request: ApiRequest;
  typed?: Record<Pointer, string>;
  economics?: Economics;
}): void {
  batch(() => {
    past.value = future.value = [];
    project.value = cell.project;
    request.value = cell.request;
    typed.value = cell.typed ?? {};
    // prices are those of the place, but how often a motion comes is of its cell
    economics.value = cell.economics ?? { ...economics.value, cycleTime: null };
    answered.value = null;
    racers.value = [];
    ghosts.value = [];
    trouble.value = null;
    selected.value = null;
    playing.value = false;
    time.value = 0;
  });
}

/** Takes the request back to that of the answer, as one step. */
export function revert(): void {
  const asked = answered.value?.asked;
  if (asked) edit(asked);
}
