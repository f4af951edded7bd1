import { Button } from "../ui/Button";
import { Note } from "../ui/Note";
import { Progress } from "../ui/Progress";
import { optimise } from "../store/run";
import { lackOf } from "../store/request";
import { answered, changes, jsonBroken, page, request, run, trouble, unread } from "../store/state";
import { tell } from "../store/trouble";
import { figure } from "../store/units";

/** Why the request cannot be sent, or null. */
function obstacle(): string | null {
  if (jsonBroken.value) return "The JSON is not a request.";
  const [cell] = Object.values(unread.value);
  if (cell !== undefined) return `Enter a number for ${cell}.`;
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
      {run.value && run.value.endpoint !== "placement" ? (
        <Progress />
      ) : (
        <>
          <button
            type="button"
            id="optimise"
            class={`button big${fresh ? "" : " primary"}`}
            disabled={why !== null || Boolean(run.value)}
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
    return `The answer is up to date${took ? ` · took ${figure(took, 2)} s` : ""}`;
  return "Not computed yet";
}

/** What went wrong; it is also shown at its fields. */
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
            {elsewhere.map(({ pointer, text }) => {
              const field = pointer.slice(1).replaceAll("/", ".");
              return (
                <li key={pointer}>
                  {!text.startsWith(field) && <code>{field} </code>}
                  {text}
                </li>
              );
            })}
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
