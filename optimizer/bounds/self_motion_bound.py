"""Lower bound on the motions from or to a pose that the arm holds on a self-motion.

The bound covers all members of the self-motion. Its arcs are cut into cells, and `SelfMotion.boxes`
gives a box of joint positions around all members of a cell. Between two boxes,

- the displacement of each joint is at least their distance,
- the gain of potential energy is at least the gain between their middles less the greatest change
  within them (`greatest_rates`).

`lower_bounds` falls with neither, so its value at both bounds every motion between the boxes. Pairs
of cells of least bound are halved until their boxes are small. The least value over all pairs
bounds the self-motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.end_curves import Cells, EndCurves
from joulepath.optimizer.bounds.least_displacement import least_displacement
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.bounds.pair import Pair
from joulepath.optimizer.bounds.subdivide import Bounded, SearchLimits, Subdivision
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.deadline import NEVER, Deadline
from joulepath.optimizer.kinematics.covers.wrist_geometry import greatest_rates
from joulepath.optimizer.prepared_problem import PreparedProblem


@dataclass(frozen=True)
class CellSettings:
    """Settings of the subdivision of self-motions into cells."""

    smallest_half_width: float = 1e-4
    """Half width [rad] below which a cell is not halved."""
    pairs_per_round: int = 256
    """Largest number of pairs that are halved in a round."""
    rounds: int = 60
    """Largest number of rounds."""
    member_tolerance: float = 1e-3
    """Relative distance to the least bound of a member at which halving ends.

    The bound of a self-motion cannot exceed the bound of any single member.
    """
    members_per_round: int = 4
    """Number of pairs of least bound whose middles are bounded as members in each round."""


CELLS = CellSettings()


def self_motion_bound(
    prepared: PreparedProblem, candidates: Sequence[Pair], deadline: Deadline = NEVER
) -> float:
    """Lower bound on motions between targets, one of them held on a self-motion [J]; inf for none.

    Ends of partly free orientation are left to `free_goal_bound` and `free_ends_bound`.

    Args:
        prepared: problem of the motions.
        candidates: pairs of end configurations; only pairs with a sampled end count.
        deadline: deadline of the search, which then returns its bound so far.
    """
    pairs = [
        pair
        for pair in candidates
        if pair.sampled and not (pair.start.tolerance or pair.goal.tolerance)
    ]
    if not pairs:
        return np.inf
    return bound_between_curves(
        prepared,
        EndCurves.of([pair.start for pair in pairs]),
        EndCurves.of([pair.goal for pair in pairs]),
        deadline,
    )


def bound_between_curves(
    prepared: PreparedProblem, starts: EndCurves, goals: EndCurves, deadline: Deadline = NEVER
) -> float:
    """Lower bound on motions between curves, one of them more than an isolated configuration [J].

    The arguments are those of `self_motion_bound`.
    """
    pairs = _CellPairs(prepared, starts, goals).run(SearchLimits(CELLS.rounds, deadline))
    return float(pairs.value.min(initial=np.inf))


@dataclass(frozen=True)
class _Pairs(Bounded):
    """Pairs of a cell at the start and a cell at the goal."""

    start: Cells
    goal: Cells


class _CellPairs(Subdivision[_Pairs]):
    """Pairs of cells with at least one cell of a self-motion."""

    def __init__(self, prepared: PreparedProblem, start: EndCurves, goal: EndCurves) -> None:
        self.prepared, self.start, self.goal = prepared, start, goal
        self.bound = LeastBound(prepared)
        self.rates = greatest_rates(prepared.arm)
        self.limits = prepared.arm.active_limits
        self.least_member = np.inf
        """Least bound of any pair of members seen [J]."""

    def first(self) -> _Pairs:
        """Pairs of the first cells."""
        starts, goals = self.start.first(), self.goal.first()
        counts = len(starts.curve), len(goals.curve)
        s, g = (rows.ravel() for rows in np.indices(counts))
        extended = np.flatnonzero((starts.half[s] > 0) | (goals.half[g] > 0))
        start, goal = starts[s[extended]], goals[g[extended]]
        value = self.bounds(start, goal) if len(extended) else np.zeros(0)
        return _Pairs(value, start, goal)

    def chosen(self, parts: _Pairs, number: int) -> Indices:
        """Pairs of least bound with a wide cell; none if the first pair is narrow or tight."""
        wide = np.maximum(parts.start.half, parts.goal.half) >= CELLS.smallest_half_width
        due = np.ones(len(wide), dtype=bool)
        if np.isfinite(self.least_member):
            limit = self.least_member - CELLS.member_tolerance * abs(self.least_member)
            due = parts.value < limit
        if not (due & wide)[:1].any():
            return np.zeros(0, dtype=np.intp)
        return np.flatnonzero(due & wide)[: CELLS.pairs_per_round]

    def divided(self, parts: _Pairs, rows: Indices) -> _Pairs:
        """Halves of the wider cell of pairs; bounds pairs of members on the way."""
        pairs, few = parts[rows], parts[: CELLS.members_per_round]
        at_start = pairs.start.half > pairs.goal.half
        (s0, s1), (g0, g1) = pairs.start.halved(at_start), pairs.goal.halved(~at_start)
        starts, goals = s0.joined(s1), g0.joined(g1)
        # one call for both: it is vectorised
        value, members = np.split(
            self.bounds(starts.joined(few.start.middles()), goals.joined(few.goal.middles())),
            [2 * len(rows)],
        )
        self.least_member = min(self.least_member, float(members.min()))
        # the bound of the whole holds for its parts
        return _Pairs(np.maximum(value, np.tile(pairs.value, 2)), starts, goals)

    def bounds(self, starts: Cells, goals: Cells) -> Array:
        """Bounds (n,) [J] on motions from cells at the start to cells at the goal."""
        (q_start, start_half), (q_goal, goal_half) = (
            self.start.boxes(starts),
            self.goal.boxes(goals),
        )
        # a full turn of a joint changes neither the pose nor the potential energy
        displacement, possible = least_displacement(
            self.limits, q_start, start_half, q_goal, goal_half, self.start.given
        )
        gain = self.goal.potentials(self.prepared, goals, q_goal)
        gain -= self.start.potentials(self.prepared, starts, q_start)
        gain -= (start_half + goal_half) @ self.rates
        return np.where(possible, self.bound.of(displacement, gain), np.inf)
