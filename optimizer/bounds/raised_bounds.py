"""Lower bounds of pairs, raised by the copper loss of holding against gravity and of acceleration.

The plain bound leaves most of this loss out, and the loss is most of the gap to the energy found.
`duration_cells` computes a bound with the loss in some milliseconds. So only pairs that would
determine the answer's bound are raised: the lowest pair first, and again with more effort while its
gap is wide. With `"bound": "tight"`, every pair below the best energy is raised as far as possible.
No bound falls. Pairs without a dual bound keep the plain bound.

A raised bound is at most the plain bound of full turns without a candidate (`omitted_turns`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import Protocol

import numpy as np

from joulepath.optimizer.bounds.duration_cells import DurationCells
from joulepath.optimizer.bounds.grid_cells import Spacing
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.bounds.pair import Pair
from joulepath.optimizer.bounds.pair_bounds import Effort, PairBounds
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.dynamics.dwell import LinearDwell, linear_dwells
from joulepath.optimizer.kinematics.end_configuration import EQUAL_DISPLACEMENT, joint_options
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS


@dataclass(frozen=True)
class RaisingSettings:
    """Settings of the raising of bounds."""

    most_pairs: int = 16
    """Largest number of pairs that a stage raises, unless the bound is to be tight."""
    least_gap: float = 0.03
    """Relative gap that is left below the energy, unless the bound is to be tight."""
    wide_gap: float = 0.05
    """Relative gap below the energy above which a stage raises a pair."""
    quick: Effort = field(
        default_factory=lambda: Effort(
            steps=12,
            cell_ratio=1.04,
            cells_per_group=12,
            spacing=Spacing(0.18, 1.35),
            loaded_joints=(2,),
            weight_rounds=0,
            time=0.1,
        )
    )
    """Effort of the first stage."""
    thorough: Effort = field(
        default_factory=lambda: Effort(
            steps=24,
            cell_ratio=1.03,
            cells_per_group=8,
            spacing=Spacing(0.12, 1.25),
            loaded_joints=(2,),
            weight_rounds=1,
            time=0.1,
        )
    )
    """Effort of the second stage."""
    tight: Effort = field(
        default_factory=lambda: Effort(
            steps=64,
            cell_ratio=1.01,
            cells_per_group=4,
            spacing=Spacing(0.08, 1.2),
            loaded_joints=(3, 2, 1),
            weight_rounds=2,
            time=0.4,
        )
    )
    """Effort for every pair if the bound is to be tight, after the effort of the first stage."""


RAISING = RaisingSettings()


class BoundedPair(Pair, Protocol):
    """A pair of end configurations with its plain bound."""

    @property
    def lower_bound(self) -> float:
        """Proven bound of the motions of the pair [J]."""
        ...

    @property
    def shortest(self) -> float:
        """Proven least duration [s]."""
        ...

    @property
    def motion(self) -> Spline | None:
        """A motion of the pair around which a bound may be built."""
        ...


def raised_bounds(
    prepared: PreparedProblem, candidates: Sequence[BoundedPair], energy: float, deadline: Deadline
) -> list[float]:
    """Bounds of pairs after raising all bounds below an energy [J].

    Args:
        prepared: problem of the motions.
        candidates: pairs with their bounds so far.
        energy: objective of a known motion [J].
        deadline: instant at which the raising ends.

    Returns:
        A bound for each pair, never below the bound so far.
    """
    bounds = [each.lower_bound for each in candidates]
    if prepared.problem.bound == "plain":
        return bounds
    below = [
        k for k, each in enumerate(candidates) if bounds[k] < energy and each.goal.tolerance is None
    ]
    shared = PairBounds.of(prepared) if below else None
    if shared is None:
        return bounds
    target = energy - RAISING.least_gap * abs(energy)
    pairs = {
        k: _RaisedPair(shared, candidates[k], target, bounds[k])
        for k in below
        if not candidates[k].sampled and bounds[k] < target
    }
    for effort in (RAISING.quick, RAISING.thorough):
        for pair in _lowest_pairs(list(pairs.values())):
            if pair.bound >= energy - RAISING.wide_gap * abs(energy):
                break
            pair.raise_bound(effort, deadline)
    for k, pair in pairs.items():
        bounds[k] = pair.bound
    if prepared.problem.bound == "tight":
        pairs = {k: _RaisedPair(shared, candidates[k], energy, bounds[k]) for k in below}
        for effort in (RAISING.quick, RAISING.tight):
            for pair in sorted(pairs.values(), key=lambda each: each.bound):
                pair.raise_bound(effort, deadline)
        for k, pair in pairs.items():
            bounds[k] = pair.bound
    return bounds


def _lowest_pairs(pairs: Sequence[_RaisedPair]) -> Iterator[_RaisedPair]:
    """The pair of least bound, again and again, until the same pair stays the lowest."""
    yielded = set[int]()
    while pairs and len(yielded) < RAISING.most_pairs:
        lowest = min(range(len(pairs)), key=lambda k: pairs[k].bound)
        if lowest in yielded:
            return
        yielded.add(lowest)
        yield pairs[lowest]


class _RaisedPair:
    """A pair whose `bound` [J] may be raised up to a target [J]."""

    def __init__(self, shared: PairBounds, pair: BoundedPair, target: float, bound: float) -> None:
        self.shared, self.pair, self.target, self.bound = shared, pair, target, bound

    @cached_property
    def _bound_of_omitted_turns(self) -> float:
        return bound_of_omitted_turns(self.shared.prepared, self.pair)

    @cached_property
    def _pieces(self) -> list[DurationCells]:
        """Cells of durations, one table for each linear piece of the dwell's energy."""
        prepared, pair = self.shared.prepared, self.pair
        problem, dwell = prepared.problem, prepared.problem.dwell
        dwells = [LinearDwell.none()]
        if dwell is not None:
            dwells = linear_dwells(dwell, prepared.arm, prepared.holding_power(pair.q_goal[None]))
        shortest = max(pair.shortest, DURATIONS.least, problem.duration_min or 0.0)
        longest = problem.duration_max or DURATIONS.longest
        return [
            DurationCells(self.shared, pair, pair.motion, dwell, (low, high), self.target)
            for dwell in dwells
            if (low := max(shortest, dwell.t_min)) <= (high := min(longest, dwell.t_max))
        ]

    def raise_bound(self, effort: Effort, deadline: Deadline) -> None:
        """Raise the bound with some effort, unless time is short or the target is reached."""
        if deadline.left < effort.time_for(self.shared.chain.nq) or self.bound >= self.target:
            return
        for cells in self._pieces:
            cells.raise_bounds(effort, deadline)
        least = min((cells.least for cells in self._pieces), default=self.target)
        self.bound = max(self.bound, min(least, self._bound_of_omitted_turns))


def bound_of_omitted_turns(prepared: PreparedProblem, pair: Pair) -> float:
    """Least plain bound of motions between a pair's branches with omitted full turns [J].

    Without `windings`, the candidates exclude longer motions by full turns and, between two poses,
    displacements beyond one turn (`search.candidates.pairs`). The plain bound rises with the
    displacement of every joint, so that of a candidate also holds for the omitted turns; a bound
    raised by other means does not necessarily. The bound is inf if no full turn is omitted.
    """
    start, goal, windings = pair.start, pair.goal, prepared.problem.windings
    fixed = start.fixed or goal.fixed
    nearest, omitted = list[float](), list[float]()
    for starts, goals in zip(start.choices, goal.choices, strict=True):
        kept = [g - s for s, g in joint_options(starts, goals, fixed, windings)]
        every = [g - s for s, g in product(starts, goals)]
        others = [abs(d) for d in every if all(abs(d - k) > EQUAL_DISPLACEMENT for k in kept)]
        nearest.append(min(map(abs, every)))
        omitted.append(min(others, default=np.inf))
    gain = prepared.potential(pair.q_goal) - prepared.potential(pair.q_start)
    bound = LeastBound(prepared).of_other_turns(
        np.array([nearest]), np.array([omitted]), np.array([gain])
    )
    return float(bound[0])
