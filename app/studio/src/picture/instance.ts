import { signal } from "@preact/signals";
import type { View } from "./view";

/** The picture of this page, once it is there; null without WebGL. */
export const picture = signal<View | null>(null);
