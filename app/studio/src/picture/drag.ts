// Handles in the picture: targets and obstacles are dragged; boxes are drawn on the floor. `/ik`
// says what is reached.
import { effect, signal } from "@preact/signals";
import * as THREE from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";
import {
  frameOf,
  inverse,
  multiply,
  obstaclesOf,
  ofPose,
  poseOfMatrix,
  type Matrix,
} from "../store/chain";
import { BASE, look, moveBase } from "../store/placement";
import { at, put } from "../store/pointer";
import { solutionsOf } from "../store/reach";
import { freshName, isObject, listOf, poseAt, rowsOf, targetAt, targetOf } from "../store/request";
import { edit, placing, request, selected, typed } from "../store/state";
import { dressed, toolNow } from "../store/tools";
import type { ApiRequest, Obstacle, Pose } from "../store/types";
import { configurationOf, pictured, robotNow, standing } from "./pictured";
import { reachedGhost } from "./reachedGhost";
import type { View } from "./view";

const HEIGHT = 0.2; // of a box that is drawn [m]
const ROUND = 1e4; // a tenth of a millimetre

export type Tool = "look" | "move" | "turn" | "box";

export const tool = signal<Tool>("look");
/** What the drag says. */
export const dragNote = signal("");

export class Drag {
  readonly handle = new THREE.Object3D();
  private readonly gizmo: TransformControls;
  private asking = false;
  private waiting: Pose | null = null;
  private dragging = false;

  constructor(private readonly view: View) {
    this.gizmo = new TransformControls(view.camera, view.renderer.domElement);
    this.gizmo.size = 0.75;
    view.scene.add(this.handle, this.gizmo.getHelper());
    this.gizmo.addEventListener("change", () => view.draw());
    this.gizmo.addEventListener("objectChange", () => {
      if (selected.value === BASE) void moveBase(this.matrixOfHandle());
      else if (this.rowNow()) void this.reach(this.poseOfHandle());
    });
    this.gizmo.addEventListener("dragging-changed", ({ value }) => {
      view.controls.enabled = !value;
      this.dragging = Boolean(value);
      if (!value) this.release();
    });
    effect(() => this.attach());
  }

  private rowNow() {
    return rowsOf(request.value).find(({ pointer }) => pointer === selected.value);
  }

  /** Puts the handle on what is selected. */
  private attach(): void {
    const [chosen, mode, robot] = [selected.value, tool.value, robotNow.value];
    const pose =
      chosen && robot && (mode === "move" || mode === "turn") ? this.poseOf(chosen) : null;
    if (this.dragging) return;
    if (mode !== "move" && mode !== "turn") dragNote.value = "";
    if (mode === "box") this.drawBox();
    if (!pose) {
      reachedGhost.value = null;
      this.gizmo.detach();
      this.view.draw();
      return;
    }
    this.gizmo.setMode(mode === "turn" ? "rotate" : "translate");
    this.gizmo.showX = this.gizmo.showY = mode !== "turn" || chosen !== BASE;
    new THREE.Matrix4()
      .fromArray(pose)
      .transpose()
      .decompose(this.handle.position, this.handle.quaternion, this.handle.scale);
    this.gizmo.attach(this.handle);
    this.view.draw();
  }

  /** The pose of what is selected, in the base frame. */
  private poseOf(chosen: string): Matrix | null {
    if (chosen === BASE) return placing.value ? standing.value : null;
    const robot = robotNow.value!;
    const row = this.rowNow();
    try {
      if (!row) {
        const index = /^\/scene\/obstacles\/(\d+)$/.exec(chosen)?.[1];
        return index === undefined
          ? null
          : ofPose(obstaclesOf(request.value, robot)[Number(index)]!.pose);
      }
      const target = targetAt(request.value, row);
      if (target.kind === "pose")
        return multiply(frameOf(robot, target.pose.frame), ofPose(target.pose));
      const q = configurationOf(row, null) ?? pictured.value?.start;
      return q && this.view.content.chain
        ? this.view.content.chain.tcp(q, dressed(request.value, toolNow.value).tcp)
        : null;
    } catch {
      return null;
    }
  }

  private matrixOfHandle(): Matrix {
    this.handle.updateMatrix();
    return this.handle.matrix.clone().transpose().toArray();
  }

  private poseOfHandle(): Pose {
    const rounded = (value: number) => Math.round(value * ROUND) / ROUND;
    const pose = poseOfMatrix(this.matrixOfHandle());
    return { position: pose.position.map(rounded), rotvec: pose.rotvec };
  }

  /**
   * Says whether a pose is reached, and draws how. While an answer is awaited, only the last pose
   * waits.
   */
  private async reach(pose: Pose): Promise<void> {
    this.waiting = pose;
    if (this.asking) return;
    this.asking = true;
    while (this.waiting) {
      const asked: Pose = this.waiting;
      this.waiting = null;
      try {
        const solutions = await solutionsOf(request.value, asked, true);
        const free = solutions.filter(({ collides }) => !collides);
        const near = pictured.value?.goal ?? pictured.value?.start ?? [];
        const far = (q: number[]) => Math.hypot(...q.map((x, j) => x - (near[j] ?? 0)));
        const [first] = (free.length ? free : [...solutions]).sort((a, b) => far(a.q) - far(b.q));
        reachedGhost.value = first?.q ?? null;
        const collisions = free.length
          ? `${free.length} of them without collision`
          : "all of them in collision";
        dragNote.value = first
          ? `Reached by ${solutions.length} configurations, ${collisions}.`
          : "No configuration reaches this pose.";
      } catch (error) {
        reachedGhost.value = null;
        dragNote.value = (error as Error).message;
      }
    }
    this.asking = false;
  }

  /**
   * Writes the new pose into the request. What was not turned keeps its orientation as it was
   * given.
   */
  private release(): void {
    const chosen = selected.value;
    const robot = robotNow.value;
    if (!chosen || !robot) return;
    if (chosen === BASE) return void look(ofPose(this.poseOfHandle()));
    const row = this.rowNow();
    const given = row ? at(request.value, poseAt(row)) : at(request.value, `${chosen}/pose`);
    const before = isObject(given) ? (given as unknown as Pose) : null;
    const frame = row ? before?.frame : request.value.scene?.frame;
    const inFrame = poseOfMatrix(
      multiply(inverse(frameOf(robot, frame)), ofPose(this.poseOfHandle())),
    );
    const position = inFrame.position.map((value) => Math.round(value * ROUND) / ROUND);
    const moved =
      before && tool.value === "move"
        ? { ...before, position }
        : { position, rotvec: inFrame.rotvec, ...(row && frame ? { frame: before!.frame } : {}) };
    const pointer = row ? row.pointer : `${chosen}/pose`;
    edit(put(request.value, pointer, row ? targetOf(row, moved) : moved), untyped(pointer));
  }

  /** The next drag over the floor draws the ground of a box. */
  private drawBox(): void {
    dragNote.value = "Drag over the floor to draw the ground of a box.";
    this.view.controls.enabled = false;
    const before = request.peek();
    const over = new AbortController();
    const canvas = this.view.renderer.domElement;
    let first: number[] | null = null;
    canvas.addEventListener("pointerdown", (event) => (first = this.onFloor(event)), {
      signal: over.signal,
    });
    canvas.addEventListener(
      "pointermove",
      (event) => {
        const last = first && this.onFloor(event);
        if (first && last)
          edit(
            withBox(before, frameOf(robotNow.value!, before.scene?.frame), first, last),
            typed.value,
            "draw a box",
          );
      },
      { signal: over.signal },
    );
    const end = () => {
      over.abort();
      this.view.controls.enabled = true;
      if (tool.value === "box") tool.value = "look";
    };
    canvas.addEventListener("pointerup", end, { signal: over.signal });
  }

  /** The point [x, y] of the plane z = 0 under the pointer; null beside it. */
  private onFloor(event: PointerEvent): number[] | null {
    const floor = new THREE.Plane(new THREE.Vector3(0, 0, 1), 0);
    const hit = this.view.eye.aim(event).ray.intersectPlane(floor, new THREE.Vector3());
    return hit && hit.length() < 5 ? [hit.x, hit.y] : null;
  }
}

/** What was typed, without what stands below a pointer. */
export function untyped(pointer: string): Record<string, string> {
  return Object.fromEntries(
    Object.entries(typed.value).filter(([each]) => !each.startsWith(`${pointer}/`)),
  );
}

/**
 * The request with one more box, on the floor between two of its corners [x, y]; `frame`: that of
 * the scene.
 */
function withBox(asked: ApiRequest, frame: Matrix, first: number[], last: number[]): ApiRequest {
  const rounded = (value: number) => Math.round(value * 1000) / 1000;
  const size = first.map((value, axis) => Math.max(0.01, rounded(Math.abs(last[axis]! - value))));
  const position = first.map((value, axis) => rounded((value + last[axis]!) / 2));
  const obstacles = listOf<Obstacle>(asked.scene?.obstacles);
  const name = freshName(
    "box 1",
    obstacles.map((each) => each.name),
  );
  const pose = { position: [...position, HEIGHT / 2], rotvec: [0, 0, 0] };
  const inFrame =
    asked.scene?.frame === "base_link"
      ? poseOfMatrix(multiply(inverse(frame), ofPose(pose)))
      : pose;
  const box: Obstacle = { name, shape: "box", size: [...size, HEIGHT], pose: inFrame };
  return { ...asked, scene: { ...asked.scene, obstacles: [...obstacles, box] } };
}
