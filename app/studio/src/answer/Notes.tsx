import type { ComponentChildren, JSX } from "preact";
import { Button } from "../ui/Button";
import { Note } from "../ui/Note";
import { goTo } from "../picture/clock";
import { optimise } from "../store/run";
import { answered, edit, show, stale, tab, typed, type Answered } from "../store/state";
import { tell } from "../store/trouble";
import { figure } from "../store/units";
import { plain } from "../store/facts";
import { advised, CHANGES, wordsOf, type Change } from "./advice";

const LEAST = 0.05; // share of a cycle below which its moves from and to the start do not matter
const MOST = 3;
const SPARE = 0.002; // clearance beyond the margins that is worth a note [m]

/** What to do about the figure: at most three notes, then the others. */
export function Notes() {
  const shown = answered.value;
  if (!shown || stale.value) return null;
  const advice = adviceNotes();
  const warnings = shown.solution.warnings.map((text) => (
    <Note kind="warning" key={text}>
      {plain(text)}
    </Note>
  ));
  const rest = [...advice.slice(MOST), ...warnings.slice(MOST - 1)];
  return (
    <div class="notes" id="notes">
      {advice.slice(0, MOST)}
      <Close shown={shown} />
      {warnings.slice(0, MOST - 1)}
      {rest.length > 0 && (
        <details class="fold">
          <summary>{rest.length} more</summary>
          {rest}
        </details>
      )}
    </div>
  );
}

/** The wait, the moves from and to the start, and changes of the task: the largest first. */
function adviceNotes(): JSX.Element[] {
  const now = advised.value;
  const shown = answered.value;
  if (!now || !shown) return [];
  const of = (name: Change["name"]) => now.advice.find((each) => each.name === name);
  const whole = of("whole_cycle");
  const without = of("without_home");
  const notes = now.advice
    .filter((each) => each !== whole && each !== without)
    .map((each) => <Advice key={each.name} change={each} />);
  if (without || (now.home ?? 0) > LEAST * now.energy)
    notes.unshift(
      <Advice key="home" change={without}>
        The moves from and to the start need {figure(now.home)} of{" "}
        {figure(shown.solution.energy.electrical.total)} J.
      </Advice>,
    );
  if (now.waiting)
    notes.unshift(
      <Advice key="wait" change={whole}>
        Waiting needs {figure(now.waiting)} of {figure(now.energy)} J per cycle.
      </Advice>,
    );
  return notes;
}

/** A fact, and what a change would need, with the button that makes it. */
function Advice({ change, children }: { change?: Change; children?: ComponentChildren }) {
  const next = change?.request;
  const use = () => {
    if (!next) return;
    edit(next, typed.value);
    optimise(next).catch((error) => tell(error, next));
  };
  const button = next && (
    <Button small onClick={use}>
      {CHANGES[change.name].button}
    </Button>
  );
  return (
    <Note kind={children ? "warning" : "advice"} action={button}>
      {children && <b>{children}</b>} {change && wordsOf(change)}
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
      {clearance.pair.join(" and ")} pass at a distance of {figure(distance * 1000, 2)} mm. Proven:
      at least {figure(clearance.min_clearance * 1000, 2)} mm more than the margin, at every
      instant.
    </Note>
  );
}
