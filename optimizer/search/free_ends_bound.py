"""A lower bound on motions between two poses, of which the start, or both, leave the rotation about
an axis free.

The bound of a motion grows with the displacement of its joints and with its gain of potential
energy; it has no direction. So a motion from a free start has that of its way back under gravity
turned round: a motion to a free goal. Where both ends are free, the boxes of joint positions of
each end are halved until they are small: then the bound of a pair of them says something. Pairs
with the least bounds are halved further, the end that moves the TCP more first. See
`free_goal_bound`.
"""

from __future__ import annotations

from dataclasses import replace
from math import prod

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.box_search import NEARLY, ROUNDS, TIGHT_ROUNDS, Boxes, BoxSearch
from joulepath.optimizer.bounds.least_displacement import least_displacement
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.targets import Target
from joulepath.optimizer.search.ends import within_cone
from joulepath.optimizer.search.free_goal_bound import Family, halved, whole_turns

# boxes along each inner joint at first, of either end; how often they are halved before they are
# paired, as long as an end has not more boxes, nor both together more pairs
ALONG, HALVINGS, MOST_BOXES, MOST_PAIRS = 2, 21, 2000, 50_000


def backwards(problem: Problem, start: Target, goal: Target) -> Problem:
    """The problem of the way back, from `start` to `goal`, under gravity turned round: its motions
    have the bounds of those there."""
    arm = replace(problem.arm, gravity=-np.asarray(problem.arm.gravity))
    return replace(problem, arm=arm, start=start, goal=goal, tool_path=None)


def bound_between(
    prepared: PreparedProblem,
    start: ConeOrientedPose,
    goal: ConeOrientedPose,
    deadline: Deadline,
    enough: float,
) -> float:
    """Lower bound [J] on motions from any configuration of `start` to any of `goal`; the search for
    it ends once it reaches `enough` [J]."""
    search = _PairSearch(prepared, within_cone(prepared, start), within_cone(prepared, goal))
    tight = prepared.problem.bound == "tight"
    return search.run(TIGHT_ROUNDS if tight else ROUNDS, deadline, enough, 0.0 if tight else NEARLY)


class _PairSearch(BoxSearch[Boxes]):
    """Branch and bound over pairs of boxes: (b, 2, nq), at the start and the goal."""

    def __init__(
        self, prepared: PreparedProblem, start: ConeOrientedPose, goal: ConeOrientedPose
    ) -> None:
        problem = prepared.problem
        back = PreparedProblem.of(backwards(problem, problem.start, problem.goal))
        self.limits, self.bound = prepared.arm.active_limits, LeastBound(prepared)
        # the highest that the start can be is the lowest under gravity turned round
        self.families = Family(back, start, False), Family(prepared, goal, False)

    def settled(self, half: Array) -> bool:
        """Whether no box of a pair is worth splitting."""
        return all(family.settled(each) for family, each in zip(self.families, half, strict=True))

    def first(self) -> Boxes:
        """Pairs that cover every position of the joints at both ends: of the smallest boxes of
        which there are not too many."""
        nq = len(self.limits.q_min)
        sides = [_held(family, *whole_turns(nq, ALONG)) for family in self.families]
        chosen = sides
        for _ in range(HALVINGS):
            sides = [
                _held(family, *halved(family, *side))
                for family, side in zip(self.families, sides, strict=True)
            ]
            counts = [len(centre) for centre, _ in sides]
            if max(counts) > MOST_BOXES:
                break
            if prod(counts) <= MOST_PAIRS:
                chosen = sides
        a, b = (each.ravel() for each in np.indices([len(centre) for centre, _ in chosen]))
        centre, half = (np.stack([chosen[0][k][a], chosen[1][k][b]], axis=1) for k in (0, 1))
        return Boxes(centre, half, self._bounds(centre, half))

    def halved(self, pairs: Boxes) -> Boxes:
        """Both halves of every pair, split along the side of the box that moves the TCP most."""
        sizes = np.stack(
            [family.sizes(pairs.half[:, k]) for k, family in enumerate(self.families)], axis=1
        )
        end = sizes.max(axis=2).argmax(axis=1)
        centre, half = np.tile(pairs.centre, (2, 1, 1)), np.tile(pairs.half, (2, 1, 1))
        held, ends = np.ones(len(centre), dtype=bool), np.tile(end, 2)
        for k, family in enumerate(self.families):
            own = np.flatnonzero(ends == k)
            if len(own):
                parts = halved(family, pairs.centre[end == k, k], pairs.half[end == k, k])
                centre[own, k], half[own, k], held[own] = family.narrowed(*parts)
        # the bound of a part is at least that of the whole
        value = np.tile(pairs.value, 2)
        value[held] = np.maximum(value[held], self._bounds(centre[held], half[held]))
        return Boxes(centre, half, np.where(held, value, np.inf))

    def _bounds(self, centre: Array, half: Array) -> Array:
        """Bounds (b,) [J] on motions between boxes (b, 2, nq)."""
        displacement, possible = least_displacement(
            self.limits, centre[:, 0], half[:, 0], centre[:, 1], half[:, 1], given=False
        )
        lowest = [family.lowest(centre[:, k], half[:, k]) for k, family in enumerate(self.families)]
        return np.where(possible, self.bound.of(displacement, lowest[1] + lowest[0]), np.inf)


def _held(family: Family, centre: Array, half: Array) -> tuple[Array, Array]:
    """Those of boxes (b, nq) [rad] that may hold configurations of a family, narrowed."""
    centre, half, held = family.narrowed(centre, half)
    return centre[held], half[held]
