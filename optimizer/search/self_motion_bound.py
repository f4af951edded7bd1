"""A lower bound on the motions from or to a pose that the arm holds on a self-motion: over all of
its members at once.

The arcs of a self-motion are cut into cells, and `SelfMotion.boxes` holds every member of a cell in
a box of joint positions. The joint displacement between two boxes is at least the distance between
them, and the gain of potential energy at least that between their middles less what it can change
within them (`potential_rates`). `lower_bounds` falls with neither, so that its value there bounds
every motion between the boxes. The pairs of least bound are halved until their boxes are small. The
least value over all pairs bounds the family.

From given joint positions, the lowest pairs then get the copper loss of holding (`holding_cells`),
and are halved on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.box_search import NEARLY
from joulepath.optimizer.bounds.holding_cells import HoldingCells
from joulepath.optimizer.bounds.least_displacement import least_displacement
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.deadline import NEVER, Deadline
from joulepath.optimizer.kinematics.covers.branch_covers import BranchCover, boxes_on
from joulepath.optimizer.kinematics.covers.wrist_geometry import potential_rates
from joulepath.optimizer.kinematics.self_motion import SelfMotion
from joulepath.optimizer.kinematics.seven.redundant_curve import CurveStack, RedundantCurve
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.ends import EndConfiguration

# half side of the first cells, and of cells that are not halved again [rad]; most pairs halved in a
# round, rounds
FIRST_HALF, LAST_HALF, SPLIT, ROUNDS = np.pi / 24, 1e-4, 256, 60
# no bound of a family exceeds that of a single member: halving ends once it is so near to the least
# of those seen, at the middles of so many pairs in each round
CLOSE, MIDDLES = 1e-3, 4

# rounds in which pairs get the copper loss of holding, and the most that do in one; half side [rad]
# of the groups of cells for which it is found, and how near to the least pair's bound those of the
# others are that get it
HOLDING_ROUNDS, HELD, GROUP_HALF, NEAR = 8, 1024, 0.0025, 0.1
# pairs that get it again with the multipliers of the lowest, and by how much that must raise its
# bound, relative
LED, SAME = 256, 1e-9

# finds boxes from rows in a group of curves (n,), parameters and half sides (n,) [rad]
_Boxes = Callable[[NDArray[np.intp], Array, Array], tuple[Array, Array]]


def self_motion_bound(
    prepared: PreparedProblem,
    candidates: Sequence[Candidate],
    deadline: Deadline = NEVER,
    enough: float = np.inf,
) -> float:
    """Bound [J] on motions between targets of which at least one is held on a self-motion; inf if
    there are none.

    It has the copper loss of holding where it would be far below `enough` [J], or is to be tight.
    Ends of free orientation are left to `free_goal_bound` and `free_ends_bound`.
    """
    pairs = [
        each
        for each in candidates
        if each.sampled and not (each.start.tolerance or each.goal.tolerance)
    ]
    if not pairs:
        return np.inf
    return bound_between(
        prepared,
        EndCurves.of([each.start for each in pairs]),
        EndCurves.of([each.goal for each in pairs]),
        deadline,
        enough,
    )


def bound_between(
    prepared: PreparedProblem,
    starts: EndCurves,
    goals: EndCurves,
    deadline: Deadline = NEVER,
    enough: float = np.inf,
) -> float:
    """Bound [J] on motions from any of the starts to any of the goals, of which at least one is no
    isolated configuration."""
    return _CellSearch(prepared, starts, goals, enough).run(deadline)


@dataclass(frozen=True)
class Cells:
    """Cells of the curves of one end: `curve` (n,) the index of each one's, its middle and half
    side (n,) [rad].
    """

    curve: NDArray[np.intp]
    parameter: Array
    half: Array

    def __getitem__(self, chosen: NDArray[np.intp]) -> Cells:
        return Cells(self.curve[chosen], self.parameter[chosen], self.half[chosen])

    def halved(self, which: Mask) -> tuple[Cells, Cells]:
        """Both halves of the cells where `which` (n,) is true; the others twice."""
        half = np.where(which, self.half / 2, self.half)
        step = np.where(which, half, 0.0)
        return Cells(self.curve, self.parameter - step, half), Cells(
            self.curve, self.parameter + step, half
        )

    def shrunk(self) -> Cells:
        """The middles of the cells."""
        return Cells(self.curve, self.parameter, np.zeros_like(self.half))

    def joined(self, other: Cells) -> Cells:
        """These cells, then the others."""
        return Cells(
            np.concatenate([self.curve, other.curve]),
            np.concatenate([self.parameter, other.parameter]),
            np.concatenate([self.half, other.half]),
        )


@dataclass(frozen=True)
class EndCurves:
    """What reaches the targets at one end: isolated configurations of so many `joints`, and
    self-motions, or sheets that hold whatever reaches a pose.

    `given`: all are joint positions that a target gives, without other full turns.
    """

    joints: int
    curves: Sequence[Array | SelfMotion | BranchCover]
    given: bool

    @staticmethod
    def of(ends: Sequence[EndConfiguration]) -> EndCurves:
        """The curves of configurations at one end, each once."""
        curves: dict[int, Array | SelfMotion] = {}
        for end in ends:
            curve = end.q if end.self_motion is None else end.self_motion
            curves[id(curve)] = curve
        return EndCurves(len(ends[0].q), list(curves.values()), all(end.fixed for end in ends))

    def first(self) -> Cells:
        """Cells that cover every curve; one without extent for an isolated configuration."""
        curve, parameter, half = list[int](), list[float](), list[float]()
        for k, each in enumerate(self.curves):
            for lower, upper in [(0.0, 0.0)] if isinstance(each, np.ndarray) else each.arcs:
                count = max(1, int(np.ceil((upper - lower) / 2 / FIRST_HALF)))
                side = (upper - lower) / 2 / count
                curve += [k] * count
                parameter += [lower + side * (2 * n + 1) for n in range(count)]
                half += [side] * count
        return Cells(np.array(curve, dtype=np.intp), np.array(parameter), np.array(half))

    def boxes(self, cells: Cells) -> tuple[Array, Array]:
        """Middle and half sides (n, nq) [rad] of a box around every cell."""
        shape = (len(cells.curve), self.joints)
        centre, half = np.zeros(shape), np.zeros(shape)
        for owners, boxes in self._groups:
            row = np.full(len(self.curves), -1)
            row[owners] = np.arange(len(owners))
            rows = row[cells.curve]
            own = np.flatnonzero(rows >= 0)
            if len(own):
                centre[own], half[own] = boxes(rows[own], cells.parameter[own], cells.half[own])
        return centre, half

    @cached_property
    def _groups(self) -> list[tuple[list[int], _Boxes]]:
        """Curves by index whose boxes are found at once, and how. Those of one pose and form
        are."""
        found: dict[tuple[type, int], list[int]] = {}
        for k, each in enumerate(self.curves):
            if isinstance(each, RedundantCurve | BranchCover):
                key = id(each.pose)
            else:
                key = 0 if isinstance(each, np.ndarray) else id(each)
            found.setdefault((type(each), key), []).append(k)
        return [(owners, _boxes_of([self.curves[k] for k in owners])) for owners in found.values()]


def _boxes_of(curves: Sequence[Array | SelfMotion | BranchCover]) -> _Boxes:
    """How the boxes of a group of `EndCurves` are found."""
    one = curves[0]
    if isinstance(one, RedundantCurve):
        return CurveStack.of([each for each in curves if isinstance(each, RedundantCurve)]).boxes
    if isinstance(one, BranchCover):
        return partial(boxes_on, [each for each in curves if isinstance(each, BranchCover)])
    if isinstance(one, np.ndarray):
        q = np.array(curves)
        return lambda rows, _, half: (q[rows], np.zeros((len(half), q.shape[1])))
    return lambda _, parameter, half: one.boxes(parameter, half)


class _CellSearch:
    """Branch and bound over pairs of cells."""

    def __init__(
        self, prepared: PreparedProblem, start: EndCurves, goal: EndCurves, enough: float
    ) -> None:
        self.prepared, self.start, self.goal = prepared, start, goal
        self.bound = LeastBound(prepared)
        self.rates = potential_rates(prepared.model, prepared.arm.gravity)
        self.limits = prepared.arm.active_limits
        self.holding = HoldingCells.of(prepared) if start.given else None
        self.will_do = enough - (0.0 if prepared.problem.bound == "tight" else NEARLY) * abs(enough)

    def run(self, deadline: Deadline) -> float:
        """The least bound [J] of any pair after at most ROUNDS rounds of halving; inf if there is
        none.
        """
        starts, goals = self.first()
        if not len(starts.curve):
            return np.inf
        value, least = self.bounds(starts, goals), np.inf
        for _ in range(ROUNDS):
            order = np.argsort(value, kind="stable")
            wide = np.maximum(starts.half[order], goals.half[order]) >= LAST_HALF
            due = np.isfinite(value[order]) & (~(value[order] >= least - CLOSE * abs(least)))
            if deadline.passed or not due[0] or not wide[0]:
                break
            split = np.zeros(len(order), dtype=bool)
            split[np.flatnonzero(due & wide)[:SPLIT]] = True
            lowest, rest = order[split], order[~split]
            at_start = starts.half[lowest] > goals.half[lowest]
            (s0, s1), (g0, g1) = starts[lowest].halved(at_start), goals[lowest].halved(~at_start)
            fresh_starts, fresh_goals, few = s0.joined(s1), g0.joined(g1), order[:MIDDLES]
            middles = starts[few].shrunk(), goals[few].shrunk()
            fresh, reached = np.split(
                self.bounds(fresh_starts.joined(middles[0]), fresh_goals.joined(middles[1])),
                [2 * len(lowest)],
            )
            least = min(least, float(reached.min()))
            # the bound of a part is at least that of the whole
            fresh = np.maximum(fresh, np.tile(value[lowest], 2))
            starts, goals = starts[rest].joined(fresh_starts), goals[rest].joined(fresh_goals)
            value = np.concatenate([value[rest], fresh])
        return self._held(starts, goals, value, deadline)

    def _held(self, starts: Cells, goals: Cells, value: Array, deadline: Deadline) -> float:
        """The least bound [J] of pairs with bounds (n,), of which the lowest get the copper loss of
        holding.
        """
        done = np.zeros(len(value), dtype=bool)
        for _ in range(0 if self.holding is None else HOLDING_ROUNDS):
            order = np.argsort(value, kind="stable")[:HELD]
            least = float(value[order[0]])
            if deadline.passed or not np.isfinite(least) or least >= self.will_do:
                break
            order = order[value[order] <= least + NEAR * abs(least)]
            held, parts = (
                order[~done[order]],
                order[done[order] & (goals.half[order] >= LAST_HALF)][:SPLIT],
            )
            if done[order[0]] and order[0] not in parts:
                # its multipliers were chosen for another pair, the lowest one then
                lowest = order[:LED]
                raised = self._with_holding(starts[lowest], goals[lowest], value[lowest])
                if raised[0] <= least + SAME * abs(least):
                    break
                value[lowest] = raised
                continue
            (s0, s1), (g0, g1) = (
                starts[parts].halved(np.zeros(len(parts), dtype=bool)),
                goals[parts].halved(np.ones(len(parts), dtype=bool)),
            )
            fresh_starts, fresh_goals = s0.joined(s1), g0.joined(g1)
            fresh = np.maximum(self.bounds(fresh_starts, fresh_goals), np.tile(value[parts], 2))
            rest = np.setdiff1d(np.arange(len(value)), np.concatenate([parts, held]))
            raised_starts, raised_goals = (
                starts[held].joined(fresh_starts),
                goals[held].joined(fresh_goals),
            )
            raised = self._with_holding(
                raised_starts, raised_goals, np.concatenate([value[held], fresh])
            )
            starts, goals = starts[rest].joined(raised_starts), goals[rest].joined(raised_goals)
            value = np.concatenate([value[rest], raised])
            done = np.concatenate([done[rest], np.ones(len(raised), dtype=bool)])
        return float(value.min())

    def _with_holding(self, starts: Cells, goals: Cells, value: Array) -> Array:
        """Bounds (n,) [J] raised by the copper loss of holding, on motions from cells without
        extent.
        """
        possible = np.flatnonzero(
            np.isfinite(value) & (starts.half == 0) & (goals.half <= GROUP_HALF)
        )
        if self.holding is None or not len(possible):
            return value
        starts, goals = starts[possible], goals[possible]
        (q_start, _), (q_goal, half) = self.start.boxes(starts), self.goal.boxes(goals)
        potentials = (
            self._potentials(self.start, starts, q_start),
            self._potentials(self.goal, goals, q_goal),
        )
        gain = potentials[1] - potentials[0] - half @ self.rates
        groups = np.stack(
            [starts.curve, goals.curve, np.floor(goals.parameter / (2 * GROUP_HALF))], axis=1
        )
        first, row = np.unique(groups, axis=0, return_index=True, return_inverse=True)[1:]
        row = row.ravel()
        # full turns change neither pose nor energy: without those between its cells, the box of a
        # group is small
        q_goal = q_goal - 2 * np.pi * np.round((q_goal - q_goal[first[row]]) / (2 * np.pi))
        shape = (len(first), q_goal.shape[1])
        low, high, least, plain = (
            np.full(shape, np.inf),
            np.full(shape, -np.inf),
            np.full(len(first), np.inf),
            np.full(len(first), np.inf),
        )
        np.minimum.at(low, row, q_goal - half)
        np.maximum.at(high, row, q_goal + half)
        np.minimum.at(least, row, gain)
        np.minimum.at(plain, row, value[possible])
        # the lowest first: its choices are those of all
        order = np.argsort(plain, kind="stable")
        rank = np.argsort(order)[row]
        found = self.holding.group(
            q_start[first[order]], low[order], high[order], least[order], plain[order]
        )
        value = value.copy()
        value[possible] = np.maximum(value[possible], found.at(rank, q_goal, half, gain))
        return value

    def first(self) -> tuple[Cells, Cells]:
        """Every pair of cells of which at least one is of a self-motion."""
        starts, goals = self.start.first(), self.goal.first()
        s, g = (
            each.ravel()
            for each in np.meshgrid(
                *(np.arange(len(c.curve)) for c in (starts, goals)), indexing="ij"
            )
        )
        moving = np.flatnonzero((starts.half[s] > 0) | (goals.half[g] > 0))
        return starts[s[moving]], goals[g[moving]]

    def bounds(self, starts: Cells, goals: Cells) -> Array:
        """Bounds (n,) [J] on motions from the cells of one end to those of the other."""
        (q_start, start_half), (q_goal, goal_half) = (
            self.start.boxes(starts),
            self.goal.boxes(goals),
        )
        # a full turn of a joint changes neither the pose nor the potential energy
        away, possible = least_displacement(
            self.limits, q_start, start_half, q_goal, goal_half, self.start.given
        )
        potentials = (
            self._potentials(self.start, starts, q_start),
            self._potentials(self.goal, goals, q_goal),
        )
        gain = potentials[1] - potentials[0] - (start_half + goal_half) @ self.rates
        return np.where(possible, self.bound.of(away, gain), np.inf)

    def _potentials(self, end: EndCurves, cells: Cells, q: Array) -> Array:
        """Potential energies (n,) [J] at the middles q (n, nq) of the boxes of cells."""
        isolated = [each for each in end.curves if isinstance(each, np.ndarray)]
        if len(isolated) == len(end.curves):
            return np.array([self.prepared.potential(each) for each in isolated])[cells.curve]
        return np.array([self.prepared.potential(each) for each in q])
