"""Lower bound on the motions from or to a pose that the arm holds on a self-motion.

The bound covers all members of the self-motion. Its arcs are cut into cells, and `SelfMotion.boxes`
gives a box of joint positions around all members of a cell. Between two boxes,

- the displacement of each joint is at least their distance,
- the gain of potential energy is at least the gain between their middles less the greatest change
  within them (`greatest_rates`).

`lower_bounds` falls with neither, so its value at both bounds every motion between the boxes. Pairs
of cells of least bound are halved until their boxes are small. The least value over all pairs
bounds the self-motion.

From given joint positions, the pairs of least bound then get the copper loss of holding
(`holding_cells`) too, and are halved further.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.end_curves import Cells, EndCurves
from joulepath.optimizer.bounds.holding_cells import HoldingCells
from joulepath.optimizer.bounds.least_displacement import least_displacement
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.bounds.pair import Pair
from joulepath.optimizer.bounds.subdivide import (
    SUBDIVISION,
    Bounded,
    SearchLimits,
    Subdivision,
)
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


@dataclass(frozen=True)
class HoldingStageSettings:
    """Settings of the stage that adds the copper loss of holding to bounds of pairs of cells."""

    rounds: int = 8
    """Largest number of rounds."""
    pairs_per_round: int = 1024
    """Largest number of pairs that get the loss in a round."""
    group_half_width: float = 0.0025
    """Half width [rad] of the groups of cells that share one computation."""
    bound_range: float = 0.1
    """Relative range above the least bound within which pairs get the loss."""
    repeated_pairs: int = 256
    """Number of pairs that get the loss again with multipliers chosen for the lowest pair."""
    least_rise: float = 1e-9
    """Relative rise of the lowest bound below which the repetition ends the stage."""


CELLS = CellSettings()
HOLDING_STAGE = HoldingStageSettings()


def self_motion_bound(
    prepared: PreparedProblem,
    candidates: Sequence[Pair],
    deadline: Deadline = NEVER,
    enough: float = np.inf,
) -> float:
    """Lower bound on motions between targets, one of them held on a self-motion [J]; inf for none.

    Ends of partly free orientation are left to `free_goal_bound` and `free_ends_bound`.

    Args:
        prepared: problem of the motions.
        candidates: pairs of end configurations; only pairs with a sampled end count.
        deadline: deadline of the search, which then returns its bound so far.
        enough: sufficient bound [J]. The copper loss of holding is added only to bounds far below
            it, unless the problem asks for a tight bound.
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
        enough,
    )


def bound_between_curves(
    prepared: PreparedProblem,
    starts: EndCurves,
    goals: EndCurves,
    deadline: Deadline = NEVER,
    enough: float = np.inf,
) -> float:
    """Lower bound on motions between curves, one of them more than an isolated configuration [J].

    The arguments are those of `self_motion_bound`.
    """
    search = _CellPairs(prepared, starts, goals)
    pairs = search.run(SearchLimits(CELLS.rounds, deadline))
    if not len(pairs.value):
        return np.inf
    if np.isfinite(enough) and prepared.problem.bound != "tight":
        enough -= SUBDIVISION.tolerance * abs(enough)
    return _with_holding(search, pairs, deadline, enough)


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
        return self.bounded(starts[s[extended]], goals[g[extended]])

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

    def bounded(self, starts: Cells, goals: Cells) -> _Pairs:
        """Pairs with their bounds."""
        value = self.bounds(starts, goals) if len(starts.curve) else np.zeros(0)
        return _Pairs(value, starts, goals)

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
        gain = self.gains(starts, q_start, goals, q_goal) - (start_half + goal_half) @ self.rates
        return np.where(possible, self.bound.of(displacement, gain), np.inf)

    def gains(self, starts: Cells, q_start: Array, goals: Cells, q_goal: Array) -> Array:
        """Gains of potential energy (n,) [J] between the middles (n, nq) [rad] of boxes."""
        return self.goal.potentials(self.prepared, goals, q_goal) - self.start.potentials(
            self.prepared, starts, q_start
        )


def _with_holding(search: _CellPairs, pairs: _Pairs, deadline: Deadline, enough: float) -> float:
    """Least bound [J] of pairs of cells after pairs of least bound got the copper loss of holding.

    In each round, pairs near the least bound get the loss, and pairs with the loss are halved. If
    the lowest pair has the loss and cannot be halved, its multipliers were chosen for the pair that
    was lowest before. Then pairs near it get the loss again, with multipliers chosen for the lowest
    pair.
    """
    cells = HoldingCells.of(search.prepared) if search.start.given else None
    if cells is None:
        return float(pairs.value.min())
    raised_before = np.zeros(len(pairs.value), dtype=bool)
    for _ in range(HOLDING_STAGE.rounds):
        order = np.argsort(pairs.value, kind="stable")[: HOLDING_STAGE.pairs_per_round]
        least = float(pairs.value[order[0]])
        if deadline.passed or not np.isfinite(least) or least >= enough:
            break
        order = order[pairs.value[order] <= least + HOLDING_STAGE.bound_range * abs(least)]
        done = raised_before[order]
        wide = pairs.goal.half[order] >= CELLS.smallest_half_width
        new, split = order[~done], order[done & wide][: CELLS.pairs_per_round]
        if done[0] and order[0] not in split:
            lowest = order[: HOLDING_STAGE.repeated_pairs]
            raised = _raised(search, cells, pairs[lowest])
            if raised.value[0] <= least + HOLDING_STAGE.least_rise * abs(least):
                break
            value = pairs.value.copy()
            value[lowest] = raised.value
            pairs = replace(pairs, value=value)
            continue
        (s0, s1), (g0, g1) = (
            pairs.start[split].halved(np.zeros(len(split), dtype=bool)),
            pairs.goal[split].halved(np.ones(len(split), dtype=bool)),
        )
        parts = search.bounded(s0.joined(s1), g0.joined(g1))
        parts = replace(parts, value=np.maximum(parts.value, np.tile(pairs.value[split], 2)))
        rest = np.setdiff1d(np.arange(len(pairs.value)), np.concatenate([split, new]))
        raised = _raised(search, cells, pairs[new].joined(parts))
        pairs = pairs[rest].joined(raised)
        raised_before = np.concatenate(
            [raised_before[rest], np.ones(len(raised.value), dtype=bool)]
        )
    return float(pairs.value.min())


def _raised(search: _CellPairs, cells: HoldingCells, pairs: _Pairs) -> _Pairs:
    """The pairs, raised by the copper loss of holding if the start has no extent."""
    possible = np.flatnonzero(
        np.isfinite(pairs.value)
        & (pairs.start.half == 0)
        & (pairs.goal.half <= HOLDING_STAGE.group_half_width)
    )
    if not len(possible):
        return pairs
    starts, goals = pairs.start[possible], pairs.goal[possible]
    (q_start, _), (q_goal, half) = search.start.boxes(starts), search.goal.boxes(goals)
    gain = search.gains(starts, q_start, goals, q_goal) - half @ search.rates
    interval = np.floor(goals.parameter / (2 * HOLDING_STAGE.group_half_width))
    groups = np.stack([starts.curve, goals.curve, interval], axis=1)
    first, row = np.unique(groups, axis=0, return_index=True, return_inverse=True)[1:]
    row = row.ravel()
    # full turns change neither pose nor energy; without full turns between its cells, the box of a
    # group is small
    q_goal = q_goal - 2 * np.pi * np.round((q_goal - q_goal[first[row]]) / (2 * np.pi))
    shape = (len(first), q_goal.shape[1])
    low, high = np.full(shape, np.inf), np.full(shape, -np.inf)
    least_gain, plain = np.full(len(first), np.inf), np.full(len(first), np.inf)
    np.minimum.at(low, row, q_goal - half)
    np.maximum.at(high, row, q_goal + half)
    np.minimum.at(least_gain, row, gain)
    np.minimum.at(plain, row, pairs.value[possible])
    # the group of least bound first: the multipliers chosen for it serve all groups
    order = np.argsort(plain, kind="stable")
    rank = np.argsort(order)[row]
    found = cells.group(
        q_start[first[order]], low[order], high[order], least_gain[order], plain[order]
    )
    value = pairs.value.copy()
    value[possible] = np.maximum(value[possible], found.at(rank, q_goal, half, gain))
    return replace(pairs, value=value)
