import { signal } from "@preact/signals";
import { Button } from "../ui/Button";
import { Table } from "../ui/Table";
import { compute, optimise } from "../store/run";
import { answered, ghosts } from "../store/state";
import { tell, trying } from "../store/trouble";
import type { Candidate, Solution } from "../store/types";
import { postureWords } from "../store/facts";
import { race } from "./Postures";

const MOST_ROWS = 200;
const STATUSES = ["solved", "pruned", "infeasible", "failed", "unvisited"];

const filter = signal("");

/** All candidates that the answer lists: what was ruled out, and why. */
export function Branches() {
  const shown = answered.value;
  if (!shown || shown.cycle || !shown.solution.candidates.length) return null;
  const { candidates, candidate_counts: given } = shown.solution;
  const counts = Object.entries(given).filter(([, count]) => count);
  const total = counts.reduce((sum, [, count]) => sum + count, 0);
  const rows = candidates
    .filter(({ status }) => !filter.value || status === filter.value)
    .sort((a, b) => (a.lower_bound ?? Infinity) - (b.lower_bound ?? Infinity));
  return (
    <details class="section fold" id="branches">
      <summary>
        <b>Candidates of the search</b>{" "}
        <small>{counts.map(([status, count]) => `${count} ${status}`).join(", ")}</small>
      </summary>
      <p class="hint">
        A candidate is a pair of start and goal configurations; full-turn alternatives of a joint
        are separate candidates. Pruned: ruled out without a solution.
      </p>
      <div class="row">
        <select
          aria-label="Candidates shown"
          value={filter.value}
          onChange={(event) => (filter.value = event.currentTarget.value)}
        >
          <option value="">all statuses</option>
          {STATUSES.map((status) => (
            <option key={status}>{status}</option>
          ))}
        </select>
        {candidates.length < total && shown.asked && (
          <Button small onClick={trying(() => optimise({ ...shown.asked, candidates: "all" }))}>
            Compute again to list all {total}
          </Button>
        )}
      </div>
      <Table
        label="Candidates"
        head={["goal", "status", "bound J", "energy J", "time s", ""]}
        rows={rows.slice(0, MOST_ROWS).map((each, k) => ({
          key: k,
          title: each.reason,
          class: each.status,
          cells: cellsOf(each, shown.solution),
        }))}
      />
      {rows.length > MOST_ROWS && (
        <p class="hint">
          {MOST_ROWS} of {rows.length} are listed.
        </p>
      )}
    </details>
  );
}

function cellsOf(each: Candidate, { branch }: Solution) {
  const same = (a: number[], b: number[]) => a.every((x, j) => Math.abs(x - b[j]!) < 1e-6);
  const best = same(each.q_goal, branch.goal.q) && same(each.q_start, branch.start.q);
  const name =
    each.start === each.goal
      ? postureWords(each.goal)
      : `${postureWords(each.goal)} from ${postureWords(each.start)}`;
  const seen = ghosts.value.some(({ q }) => q === each.q_goal);
  const look = () =>
    (ghosts.value = seen
      ? ghosts.value.filter(({ q }) => q !== each.q_goal)
      : [...ghosts.value, { q: each.q_goal, colour: 0x4477aa }].slice(-4));
  const status = best
    ? "this motion"
    : each.refined === false
      ? "solved, not refined"
      : each.status;
  const acts = best ? (
    ""
  ) : (
    <>
      <Button small kind="link" pressed={seen} onClick={look}>
        ghost
      </Button>{" "}
      <Button small kind="link" onClick={() => beside(each, name).catch((error) => tell(error))}>
        compute
      </Button>
    </>
  );
  return [name, status, each.lower_bound, each.energy, each.duration, acts];
}

/** Computes one branch, and lets its arm move beside the answer's. Throws Problem. */
async function beside({ q_start, q_goal }: Candidate, name: string): Promise<void> {
  const { asked } = answered.value!;
  const solution = (await compute("optimize", {
    ...asked,
    start: { q: q_start },
    goal: { q: q_goal },
    branch: null,
    windings: false,
  })) as Solution | null;
  if (solution) race({ name, solution, colour: 0 });
}
