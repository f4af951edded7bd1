// The browser's back and forward buttons lead through the pages of the studio.
import { effect } from "@preact/signals";
import { page, type Page } from "../store/state";

/** Follows the pages from now on, in the history of the browser. */
export function followHistory(): void {
  // a page that is loaded again shows what it showed
  page.value = (history.state as { page?: Page } | null)?.page ?? page.value;
  let shown: Page = page.value;
  history.replaceState({ page: shown }, "");
  effect(() => {
    if (page.value === shown) return;
    shown = page.value;
    history.pushState({ page: shown }, "");
  });
  window.addEventListener("popstate", ({ state }: PopStateEvent) => {
    page.value = shown = (state as { page?: Page } | null)?.page ?? "cell";
  });
}
