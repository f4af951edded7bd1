import { useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { Section } from "../ui/Section";
import { answered, stale, type Answered } from "../store/state";
import type { Baseline } from "../store/types";
import { figure, percent } from "../store/units";
import { baselineName, energyOf, nounOf } from "../store/facts";
import { advised } from "./advice";

const FEW = 1; // baselines that exceed a limit, which are shown at once
const EQUAL = 0.0005; // greatest saving that is none
const WAITS = 1.01; // ratio of the longer time to the shorter above which the wait is worth a word
const differ = (one: number, two: number) => Math.max(one, two) > WAITS * Math.min(one, two);

/**
 * The baselines of the answer. A saving is claimed only against those that keep every limit.
 */
export function Baselines() {
  const shown = answered.value;
  const [all, setAll] = useState(false);
  if (!shown) return null;
  const { baselines, objective } = shown.solution;
  const kept = baselines.filter((each) => each.within_limits);
  const broken = baselines.filter((each) => !each.within_limits);
  const first = all ? broken : broken.slice(0, FEW);
  const nameOf = (name: string) => baselineName(name, Boolean(shown.asked?.path));
  const row = (each: Baseline) => (
    <tr key={each.name} class={each.within_limits ? undefined : "broken"}>
      <th scope="row">
        <i class={`swatch ${each.within_limits ? "other" : "hatched"}`} />
        {nameOf(each.name)}
      </th>
      <td>{figure(each.duration)} s</td>
      <td>{figure(each[objective])}</td>
      <td>{each.within_limits ? <Saving of={each} /> : "–"}</td>
    </tr>
  );
  return (
    <Section title="Comparison with baselines" id="baselines">
      <table class={stale.value ? "stale" : undefined}>
        <thead>
          <tr>
            <td />
            <th scope="col">time</th>
            <th scope="col">J per {nounOf(shown)}</th>
            <th scope="col">{advised.value?.waiting ? "saving per cycle" : "saving"}</th>
          </tr>
        </thead>
        <tbody>
          <Own shown={shown} />
          {kept.map(row)}
          {first.map(row)}
        </tbody>
      </table>
      {kept.some(({ duration }) => differ(duration, shown.solution.duration)) && (
        <p class="hint">
          If the durations differ, the faster motion waits with its motors on, and its energy
          includes the wait.
          {kept.some(({ saving }) => saving !== null && saving <= -EQUAL) &&
            " If a slower baseline needs less, request exactly its duration."}
        </p>
      )}
      {!kept.length && <p class="hint">No baseline keeps every limit, so no saving is claimed.</p>}
      {broken.length > 0 && (
        <p class="hint">
          Hatched baselines exceed a limit, so no saving is claimed.{" "}
          {first.filter(reasonOf).map((each) => (
            <span class="reason" key={each.name}>
              {nameOf(each.name)}: {reasonOf(each)}.{" "}
            </span>
          ))}
          {broken.length > FEW && (
            <Button kind="link" onClick={() => setAll(!all)}>
              {all ? "Fewer" : `${broken.length - FEW} more`}
            </Button>
          )}
        </p>
      )}
    </Section>
  );
}

/** The limits that a baseline exceeds; for a cycle, each limit once, with the moves that exceed it. */
export function reasonOf({ reason, broken = [] }: Baseline): string {
  if (reason) return reason;
  const moves = new Map<string, string[]>();
  for (const { start, goal, reason: all } of broken)
    for (const one of new Set(all.split("; ")))
      moves.set(one, [...(moves.get(one) ?? []), `${start} → ${goal}`]);
  return [...moves].map(([one, names]) => `${one} (${names.join(", ")})`).join("; ");
}

function Own({ shown }: { shown: Answered }) {
  return (
    <tr class="total">
      <th scope="row">
        <i class="swatch own" />
        This {nounOf(shown)}
      </th>
      <td>{figure(shown.solution.duration)} s</td>
      <td>{figure(energyOf(shown))}</td>
      <td />
    </tr>
  );
}

interface Way {
  duration: number;
  energy: number;
}

/** A saving as a share of the cycle: where one waits, both wait from then on. */
export function ofCycle(saving: number, ours: Way, theirs: Way, waiting: number): number {
  if (!waiting) return saving;
  const saved =
    theirs.duration > ours.duration
      ? saving * theirs.energy
      : (ours.energy * saving) / (1 - saving);
  return saved / (ours.energy + waiting + saved);
}

function Saving({ of: way }: { of: Baseline }) {
  const { saving: own, saving_interval: known } = way;
  if (own === null) return <>–</>;
  const waiting = advised.value?.waiting ?? 0;
  const { solution } = answered.value!;
  const ours = { duration: solution.duration, energy: energyOf(answered.value!) };
  const theirs = { duration: way.duration, energy: way[solution.objective] };
  const saving = ofCycle(own, ours, theirs, waiting);
  const interval = waiting ? null : known;
  const likely = interval
    ? `90 % interval ${percent(interval.p5)} to ${percent(interval.p95)}`
    : undefined;
  if (saving >= EQUAL)
    return (
      <b class="good" title={likely}>
        {percent(saving)}
      </b>
    );
  return <span title={likely}>{saving > -EQUAL ? "none" : percent(saving)}</span>;
}
