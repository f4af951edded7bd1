"""Lower bounds of pairs, raised by the copper loss of holding against gravity and of acceleration:
`dual_cells`.

The plain bound leaves most of that loss out, which is most of the gap. A pair takes some
milliseconds, so that only those are raised whose bounds would be the answer's, the lowest first,
and with more effort where the gap stays wide. With `"bound": "tight"` every pair below the best
energy is then raised as far as it goes, and may be ruled out: no bound falls by that. Where the
dual bound does not apply the plain one stays.

A raised bound is no higher than the plain one of full turns that no candidate has
(`turns_left_out`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from joulepath.optimizer.bounds.grid_cells import Spacing
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.dynamics.dwell import LinearDwell, linear_dwells
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.dual_cells import DurationCells, Effort, PairBounds
from joulepath.optimizer.search.turns_left_out import bound_of_turns_left_out

# pairs that a stage raises at most without "tight", and the gap that a bound is raised to at most
MOST_RAISED, LEAST_GAP = 16, 0.03


@dataclass(frozen=True)
class Stage:
    """An effort, for pairs whose bounds leave a greater gap than this."""

    effort: Effort
    gap: float


QUICK = Stage(Effort(12, 1.04, 12, Spacing(0.18, 1.35), heavy=(2,), rounds=0, time=0.1), 0.05)
FURTHER = Stage(Effort(24, 1.03, 8, Spacing(0.12, 1.25), heavy=(2,), rounds=1, time=0.1), 0.08)
# for "tight": of every pair
EVERY = QUICK.effort, Effort(64, 1.01, 4, Spacing(0.08, 1.2), heavy=(3, 2, 1), rounds=2, time=0.4)


def raise_bounds(
    prepared: PreparedProblem, candidates: Sequence[Candidate], energy: float, deadline: Deadline
) -> None:
    """Raise the lower bounds of candidates that lie below `energy` [J], that of a motion, in
    time."""
    below = [
        each for each in candidates if each.lower_bound < energy and each.goal.tolerance is None
    ]
    shared = PairBounds.of(prepared) if below else None
    if shared is None:
        return
    target = energy - LEAST_GAP * abs(energy)
    pairs = [
        _Pair(shared, each, target)
        for each in below
        if not each.sampled and each.lower_bound < target
    ]
    for stage in (QUICK, FURTHER):
        for pair in _least_ones(pairs):
            if _bound_of(pair) >= energy - stage.gap * abs(energy):
                break
            pair.raise_bound(stage.effort, deadline)
    if prepared.problem.bound == "tight":
        pairs = [_Pair(shared, each, energy) for each in below]
        for effort in EVERY:
            for pair in sorted(pairs, key=_bound_of):
                pair.raise_bound(effort, deadline)


def _least_ones(pairs: Sequence[_Pair]) -> Iterator[_Pair]:
    """The pair of the lowest bound, again and again, until that is one that was raised."""
    done = set[int]()
    while pairs and len(done) < MOST_RAISED:
        lowest = min(pairs, key=_bound_of)
        if id(lowest) in done:
            return
        done.add(id(lowest))
        yield lowest


class _Pair:
    """A candidate whose bound may be raised up to a target [J]; what that takes is prepared when it
    is wanted first.
    """

    def __init__(self, shared: PairBounds, candidate: Candidate, target: float) -> None:
        self.shared, self.candidate, self.target = shared, candidate, target

    @cached_property
    def _most(self) -> float:
        return bound_of_turns_left_out(self.shared.prepared, self.candidate)

    @cached_property
    def _cells(self) -> list[DurationCells]:
        """Cells of durations, by how waiting for the dwell's end changes with them."""
        prepared, candidate = self.shared.prepared, self.candidate
        problem, dwell = prepared.problem, prepared.problem.dwell
        dwells = [LinearDwell.none()]
        if dwell is not None:
            dwells = linear_dwells(
                dwell, prepared.arm, prepared.holding_power(candidate.q_goal[None])
            )
        shortest = max(candidate.shortest, DURATIONS.least, problem.duration_min or 0.0)
        longest = problem.duration_max or DURATIONS.longest
        return [
            DurationCells(self.shared, candidate, dwell, (low, high), self.target)
            for dwell in dwells
            if (low := max(shortest, dwell.t_min)) <= (high := min(longest, dwell.t_max))
        ]

    def raise_bound(self, effort: Effort, deadline: Deadline) -> None:
        """Raise the candidate's bound with some effort, in time."""
        if (
            deadline.left < effort.takes(self.shared.chain.nq)
            or self.candidate.lower_bound >= self.target
        ):
            return
        for cells in self._cells:
            cells.raise_bounds(effort, deadline)
        least = min((cells.least for cells in self._cells), default=self.target)
        self.candidate.lower_bound = max(self.candidate.lower_bound, min(least, self._most))


def _bound_of(pair: _Pair) -> float:
    return pair.candidate.lower_bound
