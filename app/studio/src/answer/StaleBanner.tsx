import { Button } from "../ui/Button";
import { Icon } from "../ui/icons";
import { optimise } from "../store/run";
import { lackOf } from "../store/request";
import { changes, request, revert, run } from "../store/state";
import { trying } from "../store/trouble";

const MOST = 5;

/** What was changed since the figures below were computed. */
export function StaleBanner() {
  const all = changes.value;
  if (!all.length) return null;
  return (
    <div class="stale-banner" id="stale" role="status">
      <p>
        <Icon name="alert" /> <b>These results do not include your changes</b>
      </p>
      <ul>
        {all.slice(0, MOST).map(({ pointer, name, before, after }) => (
          <li key={pointer}>
            {name} {before} → <b>{after}</b>
          </li>
        ))}
        {all.length > MOST && <li>and {all.length - MOST} more</li>}
      </ul>
      <div class="row">
        <Button
          kind="primary"
          icon="refresh"
          disabled={Boolean(run.value) || Boolean(lackOf(request.value))}
          onClick={trying(() => optimise())}
        >
          Optimise again
        </Button>
        <Button onClick={revert}>{all.length === 1 ? "Undo change" : "Undo all changes"}</Button>
      </div>
    </div>
  );
}
