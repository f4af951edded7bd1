import { signal } from "@preact/signals";

const scheme = matchMedia("(prefers-color-scheme: dark)");

/** Whether the page is dark. */
export const dark = signal(scheme.matches);
scheme.addEventListener("change", ({ matches }) => (dark.value = matches));
