import type { Group } from "three";

/** The groups of the picture, each shown or hidden as a whole. */
export const PARTS = [
  "arms",
  "ghosts",
  "obstacles",
  "margins",
  "path",
  "nearest",
  "axes",
  "places",
] as const;
/** Those that move with the base of the arm. */
export const ON_BASE = ["arms", "ghosts", "path", "nearest", "axes"] as const;
export type Parts = Record<(typeof PARTS)[number], Group>;
