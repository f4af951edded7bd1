// The browser's back and forward buttons lead through the pages of the studio.
import { effect } from "@preact/signals";
import { canUndo, page, request, type Page } from "../store/state";
import { dialog } from "./dialog";

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
  // the cell of a link is another one after the first edit: loading the page again must not open it
  effect(() => {
    if (request.value && canUndo.peek() && location.hash)
      history.replaceState(history.state, "", location.pathname + location.search);
  });
  window.addEventListener("popstate", ({ state }: PopStateEvent) => {
    dialog.value = null;
    page.value = shown = (state as { page?: Page } | null)?.page ?? "cell";
  });
}
