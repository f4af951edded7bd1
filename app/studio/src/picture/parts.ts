import type { Group } from "three";

/** The groups of the picture, each shown or hidden as a whole. */
export const PARTS = ["arms", "ghosts", "obstacles", "margins", "path", "nearest", "axes"] as const;
export type Parts = Record<(typeof PARTS)[number], Group>;
