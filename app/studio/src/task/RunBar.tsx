import { useEffect, useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { Note } from "../ui/Note";
import { cancel, optimise } from "../store/run";
import { lackOf } from "../store/request";
import { answered, changes, jsonBroken, page, request, run, trouble, unread } from "../store/state";
import { tell } from "../store/trouble";
import { atMost, figure } from "../store/units";

/** Why the request cannot be sent, or null. */
function obstacle(): string | null {
  if (jsonBroken.value) return "The JSON is no request.";
  const [cell] = Object.values(unread.value);
  if (cell !== undefined) return `Enter a number: ${cell}.`;
  return lackOf(request.value)?.text ?? null;
}

/** Sends the request, if nothing is missing. */
export function send(): void {
  if (run.value || obstacle() !== null) return;
  const asked = request.value;
  optimise(asked).catch((error) => tell(error, asked));
}

/** The button that computes, and how far it is. */
export function RunBar() {
  const why = obstacle();
  const fresh = answered.value && !changes.value.length;
  return (
    <div class="run-bar">
      <Wrong />
      {run.value ? (
        <Progress />
      ) : (
        <>
          <button
            type="button"
            id="optimise"
            class={`button big${fresh ? "" : " primary"}`}
            disabled={why !== null}
            onClick={send}
          >
            {changes.value.length ? "Optimise again" : "Optimise"} <kbd>Ctrl ↵</kbd>
          </button>
          <p class="hint" role="status" id="run-state">
            {why ?? stateText()}
          </p>
        </>
      )}
    </div>
  );
}

function stateText(): string {
  const count = changes.value.length;
  if (count) return `${count} ${count === 1 ? "change" : "changes"} since the last answer`;
  const took = answered.value?.took;
  if (answered.value)
    return `The answer belongs to this request${took ? ` · took ${figure(took, 2)} s` : ""}`;
  return "Not computed yet";
}

/** What went wrong; it also stands at its fields. */
function Wrong() {
  const now = trouble.value;
  if (!now || page.value !== "cell") return null;
  const elsewhere = now.fields.filter(({ text }) => text !== now.text);
  return (
    <div id="problem">
      <Note
        kind="error"
        action={
          <Button
            kind="quiet"
            icon="close"
            label="Dismiss"
            onClick={() => (trouble.value = null)}
          />
        }
      >
        <b>{now.title}.</b> {now.text}
        {elsewhere.length > 0 && (
          <ul>
            {elsewhere.map(({ pointer, text }) => (
              <li key={pointer}>
                <code>{pointer.slice(1).replaceAll("/", ".")}</code> {text}
              </li>
            ))}
          </ul>
        )}
        {now.link && (
          <>
            {" "}
            <a href={now.link}>What this means</a>
          </>
        )}
      </Note>
    </div>
  );
}

const EARLY = 0.05; // share of the search before which its speed tells nothing

/** How long it still takes, in words: from the share that is done, at most until the deadline. */
export function leftOf(passed: number, share: number, deadline: number | null): string {
  const most = deadline === null ? Infinity : Math.max(0, deadline - passed);
  const left = share > EARLY && share < 1 ? (passed * (1 - share)) / share : Infinity;
  if (left < most) return `, about ${figure(left, 1)} s left`;
  return most < Infinity ? `, at most ${Math.ceil(most)} s left` : "";
}

function Progress() {
  const [, again] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => again((count) => count + 1), 250);
    return () => clearInterval(timer);
  }, []);
  const now = run.value;
  if (!now) return null;
  const passed = (performance.now() - now.began) / 1000;
  const best = now.incumbents.at(-1);
  const share = now.total ? Math.min(1, now.done / now.total) : null;
  const left = leftOf(passed, share ?? 0, now.deadline);
  return (
    <div class="progress" id="progress">
      <progress max={1} value={share ?? undefined} aria-label="Progress" />
      <p class="hint" role="status" id="progress-text">
        {best
          ? `Best so far ${figure(best.energy)} J, ${best.bound > 0 ? `at least ${figure(best.bound)} J: at most ${atMost(best.energy / best.bound - 1)} above the least possible` : "no bound yet"}`
          : "Searching for a first motion"}
        {` · ${passed.toFixed(1)} s`}
        {left}
      </p>
      <Button id="cancel" onClick={cancel}>
        Cancel
      </Button>
    </div>
  );
}
