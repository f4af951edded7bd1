import { useEffect, useState } from "preact/hooks";
import { Button } from "./Button";
import { cancel } from "../store/run";
import { run, type Run } from "../store/state";
import { atMost, figure } from "../store/units";

const EARLY = 0.05; // share of the search before which its speed tells nothing

/** How long it still takes, in words: from the share that is done, at most until the deadline. */
export function leftOf(passed: number, share: number, deadline: number | null): string {
  const most = deadline === null ? Infinity : Math.max(0, deadline - passed);
  const left = share > EARLY && share < 1 ? (passed * (1 - share)) / share : Infinity;
  if (left < most) return `, about ${figure(left, 1)} s left`;
  return most < Infinity ? `, at most ${Math.ceil(most)} s left` : "";
}

/** How good the best is: of places, a bound tells less than how many of them are done. */
function than(
  { endpoint, done, total }: Run,
  { energy, bound }: Run["incumbents"][number],
): string {
  if (endpoint === "placement") return `${done} of ${total} places`;
  return bound > 0
    ? `at most ${atMost(energy / bound - 1)} above the lower bound of ${figure(bound)} J`
    : "no lower bound yet";
}

/** How far what is computed now is, and the button that ends it. */
export function Progress() {
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
          ? `Best so far ${figure(best.energy)} J, ${than(now, best)}`
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
