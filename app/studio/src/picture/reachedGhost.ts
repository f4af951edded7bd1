// The configuration that reaches what is dragged, while it is dragged.
import { signal } from "@preact/signals";

export const reachedGhost = signal<number[] | null>(null);
