import { Button } from "../ui/Button";
import { Note } from "../ui/Note";
import { goTo } from "../picture/clock";
import { optimise } from "../store/run";
import { put } from "../store/pointer";
import {
  answered,
  edit,
  economics,
  request,
  show,
  stale,
  tab,
  typed,
  type Answered,
} from "../store/state";
import { tell } from "../store/trouble";
import { figure, percent } from "../store/units";
import { plain } from "../store/facts";
import { home } from "./home";
import { wait } from "./waits";

const MOST = 3;
const SPARE = 0.002; // clearance beyond the margins that is worth a note [m]

/** What to do about the figure: at most three notes, then the others. */
export function Notes() {
  const shown = answered.value;
  if (!shown || stale.value) return null;
  const notes = [
    <Waiting key="wait" />,
    <WayHome key="home" />,
    <Close key="close" shown={shown} />,
  ];
  const warnings = shown.solution.warnings.map(plain);
  const first = warnings.slice(0, MOST - 1);
  const rest = warnings.slice(MOST - 1);
  return (
    <div class="notes" id="notes">
      {notes}
      {first.map((text) => (
        <Note kind="warning" key={text}>
          {text}
        </Note>
      ))}
      {rest.length > 0 && (
        <details class="fold">
          <summary>{rest.length} more</summary>
          {rest.map((text) => (
            <Note kind="warning" key={text}>
              {text}
            </Note>
          ))}
        </details>
      )}
    </div>
  );
}

/** How much of a cycle is waiting, and what the whole cycle would take. */
function Waiting() {
  const now = wait.value;
  const shown = answered.value;
  if (!now || !shown) return null;
  const together = shown.solution.energy.electrical.total + now.waiting;
  const less = now.whole === null ? null : 1 - now.whole / together;
  const use = () => {
    const { duration: _, ...free } = request.value;
    const next = put(free, "/dwell", { time: economics.value.cycle });
    edit(next, typed.value);
    optimise(next).catch((error) => tell(error, next));
  };
  return (
    <Note
      kind="warning"
      action={
        less !== null &&
        less > 0.001 && (
          <Button small onClick={use}>
            Use whole cycle
          </Button>
        )
      }
    >
      <b>
        {figure(now.waiting)} of {figure(together)} J a cycle is waiting.
      </b>
      {less !== null &&
        (less > 0.001
          ? ` Over all ${figure(now.cycle)} s: ${figure(now.whole)} J, ${percent(less)} less.`
          : " No slower motion needs less over the whole cycle.")}
    </Note>
  );
}

/** How much of a round goes from the start and back to it, and the round without that. */
function WayHome() {
  const now = home.value;
  const shown = answered.value;
  if (!now || !shown) return null;
  const total = shown.solution.energy.electrical.total;
  const { without } = now;
  const less = without ? 1 - without.joules / total : 0;
  const leave = () => {
    edit(now.request, typed.value);
    optimise(now.request).catch((error) => tell(error, now.request));
  };
  return (
    <Note
      kind="warning"
      action={
        less > 0.001 && (
          <Button small onClick={leave}>
            Leave out
          </Button>
        )
      }
    >
      <b>
        The start and back take {figure(now.joules)} of {figure(total)} J.
      </b>
      {without &&
        less > 0.001 &&
        ` A round from the last stop: ${figure(without.joules)} J in ${figure(without.duration)} s, ${percent(less)} less.`}
    </Note>
  );
}

/** Where two bodies nearly touch. */
function Close({ shown }: { shown: Answered }) {
  const clearance = shown.solution.certificate.clearance;
  if (!clearance?.points || clearance.min_clearance > SPARE) return null;
  const [a = [], b = []] = clearance.points;
  const distance = Math.hypot(...a.map((value, axis) => value - (b[axis] ?? 0)));
  const see = () => {
    show.value = { ...show.value, nearest: true };
    goTo(clearance.time);
    tab.value = "picture";
  };
  return (
    <Note
      action={
        <Button small onClick={see}>
          Show
        </Button>
      }
    >
      {clearance.pair.join(" and ")} pass {figure(distance * 1000, 2)} mm apart,{" "}
      {figure(clearance.min_clearance * 1000, 2)} mm to spare.
    </Note>
  );
}
