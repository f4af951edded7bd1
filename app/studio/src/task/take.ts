// A target from the picture: where the arm stands now.
import { configurationOf, pictured } from "../picture/pictured";
import { Chain, poseOfMatrix, sampleAt } from "../store/chain";
import { withStop } from "../store/edits";
import { put } from "../store/pointer";
import { rowsOf, targetAt, type Row } from "../store/request";
import { edit, request, selected, time } from "../store/state";
import { dressed, toolNow } from "../store/tools";
import type { Pose } from "../store/types";

/** Joint positions of the arm in the picture. */
export function presentJoints(): number[] | null {
  const now = pictured.value;
  if (!now) return null;
  const trajectory = now.motion?.solution.trajectory;
  return trajectory ? sampleAt(trajectory.t, trajectory.q, time.value) : now.start;
}

const rounded = (value: number) => Math.round(value * 1e6) / 1e6;

/** The pose of the TCP at joint positions, as the request has it. */
export function poseAtJoints(q: number[]): Pose | null {
  const now = pictured.value;
  if (!now) return null;
  const pose = poseOfMatrix(new Chain(now.robot).tcp(q, dressed(request.value, toolNow.value).tcp));
  return { position: pose.position.map(rounded), rotvec: pose.rotvec!.map(rounded) };
}

/** Where the arm stands, as a target. */
export function presentTarget(kind: "pose" | "joints"): { q: number[] } | { pose: Pose } | null {
  const q = presentJoints();
  if (!q) return null;
  if (kind === "joints") return { q: q.map(rounded) };
  const pose = poseAtJoints(q);
  return pose && { pose };
}

/**
 * The joint positions that stand for a row: its own, or one of those that reach it; for an empty
 * one, those of the arm.
 */
export const jointsOf = (row: Row): number[] | null =>
  configurationOf(row, pictured.value?.start ?? null) ??
  (targetAt(request.value, row).kind === "empty" ? presentJoints() : null);

/**
 * Puts the pose of the arm in the picture into the target that is chosen; without one, into a new
 * stop.
 */
export function takePose(): void {
  const present = presentTarget("pose");
  if (!present) return;
  const row = rowsOf(request.value).find(({ pointer }) => pointer === selected.value);
  if (!row) edit(withStop(request.value, present));
  else
    edit(
      put(request.value, row.pointer, row.bare && "pose" in present ? present.pose : present),
      {},
    );
}
