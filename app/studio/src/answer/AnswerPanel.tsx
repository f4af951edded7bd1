import { alone } from "../store/alone";
import { answered, run, stale } from "../store/state";
import { Baselines } from "./Baselines";
import { Branches } from "./Branches";
import { Certificate } from "./Certificate";
import { CostTable } from "./CostTable";
import { Hero } from "./Hero";
import { Legs } from "./Legs";
import { Notes } from "./Notes";
import { Postures } from "./Postures";
import { StaleBanner } from "./StaleBanner";

/** The answer: the figure, what to do about it, what it costs, how it compares. */
export function AnswerPanel() {
  return (
    <aside
      class={`answer${stale.value ? " is-stale" : ""}`}
      id="answer"
      aria-label="Answer"
      tabIndex={0}
    >
      {answered.value ? (
        <>
          <StaleBanner />
          <Hero />
          <Notes />
          <CostTable />
          <Baselines />
          {!alone && <Postures />}
          <Legs />
          <Certificate />
          {!alone && <Branches />}
        </>
      ) : (
        <p class="empty">
          {run.value ? "Computing …" : "No answer yet: fill in the task, then optimise."}
        </p>
      )}
    </aside>
  );
}
