"""Best-first search over candidates: solve in order of lower bound until no bound is below the incumbent."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from optimizer.methods.method import Attempt
from optimizer.prepared_problem import Task
from optimizer.search.candidates import Entry

PRUNED = "its lower bound is not below the best energy found"


def explore(
    task: Task,
    entries: Sequence[Entry],
    attempt: Callable[[Entry], Attempt],
    deadline: float,
    clock: Callable[[], float] = time.perf_counter,
    most_solved: int | None = None,
) -> Entry | None:
    """Solve candidates in order of bound until no bound is below the best found; returns the best, None if none.

    With `most_solved`, candidates beyond so many solved ones are left unless a bound rules them out.
    """
    best = min((e for e in entries if e.energy is not None), key=lambda e: e.energy or 0.0, default=None)
    for entry in sorted(entries, key=lambda e: (e.lower_bound, e.shortest)):
        if entry.status != "unvisited" or entry.held_back:
            continue
        if best is not None and best.energy is not None and entry.lower_bound >= best.energy:
            entry.status, entry.reason = "pruned", PRUNED
            continue
        if most_solved is not None and sum(e.status == "solved" for e in entries) >= most_solved:
            entry.reason = f"the method solves no more than {most_solved} candidates"
            continue
        if clock() > deadline:
            break
        entry.attempt = outcome = attempt(entry)
        if outcome.status == "out of time":
            break
        entry.status, entry.reason = outcome.status, outcome.reason
        if outcome.spline is not None:
            entry.energy = task.objective_of(task.energy(outcome.spline))
            if best is None or best.energy is None or entry.energy < best.energy:
                best = entry
    return best
