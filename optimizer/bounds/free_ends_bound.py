"""Lower bound on motions between two poses with a free rotation of the start, or of both ends.

The bound of a motion rises with the displacement of its joints and with its gain of potential
energy; it does not depend on the direction. So a motion from a free start has the bound of its
reverse under inverted gravity, a motion to a free goal (`free_goal_bound`).

If both ends are free, the boxes of joint positions at both ends are halved until a pair of boxes
has a useful bound. Then the pairs of least bound are halved, at the end with the larger motion of
the TCP over its box.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import prod

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.free_goal_bound import PoseFamily, halved, one_turn_boxes
from joulepath.optimizer.bounds.least_displacement import least_displacement
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.bounds.subdivide import Boxes, BoxSubdivision, SearchLimits
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.kinematics.orientation_tolerance import within_cone
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.targets import Target


@dataclass(frozen=True)
class PairingSettings:
    """Settings of the first pairs of boxes between two free ends."""

    boxes_per_joint: int = 2
    """Number of first boxes along the range of each inner joint, at either end."""
    halvings: int = 21
    """Largest number of times that the boxes of both ends are halved before they are paired."""
    most_boxes: int = 2000
    """Largest number of boxes of one end."""
    most_pairs: int = 50_000
    """Largest number of pairs."""


PAIRING = PairingSettings()

EndBoxes = tuple[Array, Array]
"""Middles and half sides of boxes at one end, shape (b, nq) [rad]."""


def reversed_problem(problem: Problem, start: Target, goal: Target) -> Problem:
    """The problem of motions from `start` to `goal` under inverted gravity.

    Its motions have the bounds of their reverses under the problem's own gravity.
    """
    arm = replace(problem.arm, gravity=-np.asarray(problem.arm.gravity))
    return replace(problem, arm=arm, start=start, goal=goal, tool_path=None)


def bound_between_free_ends(
    prepared: PreparedProblem,
    start: ConeOrientedPose,
    goal: ConeOrientedPose,
    deadline: Deadline,
    enough: float,
) -> float:
    """Lower bound on motions from any configuration of one pose to any of another [J].

    Args:
        prepared: problem of the motions.
        start: pose at the start.
        goal: pose at the goal.
        deadline: end of the search at the latest; the bound so far is returned.
        enough: sufficient bound; the search ends there [J].
    """
    arm = prepared.arm
    problem = prepared.problem
    inverted = PreparedProblem.of(reversed_problem(problem, problem.start, problem.goal))
    families = (
        PoseFamily(inverted, within_cone(arm, start), False),
        PoseFamily(prepared, within_cone(arm, goal), False),
    )
    limits = SearchLimits.of(prepared, deadline, enough)
    return _BoxPairs(prepared, families, _paired_boxes(families), limits).least_bound()


def bound_between_boxes(
    prepared: PreparedProblem,
    families: tuple[PoseFamily, PoseFamily],
    boxes: Sequence[EndBoxes],
    limits: SearchLimits,
) -> float:
    """Lower bound on motions from the configurations of one family to another family [J].

    Args:
        prepared: problem of the motions.
        families: configurations at start and goal. The family at the start uses inverted gravity:
            its least potential is minus the greatest one.
        boxes: cover of these configurations by boxes, for both ends.
        limits: limits on the effort; less effort gives a weaker bound.
    """
    return _BoxPairs(prepared, families, boxes, limits).least_bound()


class _BoxPairs(BoxSubdivision[Boxes]):
    """Pairs of boxes, one at the start and one at the goal: centre and half of shape (b, 2, nq)."""

    def __init__(
        self,
        prepared: PreparedProblem,
        families: tuple[PoseFamily, PoseFamily],
        boxes: Sequence[EndBoxes],
        limits: SearchLimits,
    ) -> None:
        self.families, self.boxes, self.limits = families, boxes, limits
        self.position_limits, self.bound = prepared.arm.active_limits, LeastBound(prepared)

    def is_settled(self, half: Array) -> bool:
        """Whether both boxes of a pair, half sides (2, nq) [rad], are too small to split."""
        return all(family.is_settled(box) for family, box in zip(self.families, half, strict=True))

    def first(self) -> Boxes:
        """Pairs of the boxes of both ends."""
        a, b = (rows.ravel() for rows in np.indices([len(centre) for centre, _ in self.boxes]))
        centre, half = (
            np.stack([self.boxes[0][k][a], self.boxes[1][k][b]], axis=1) for k in (0, 1)
        )
        return Boxes(self._bounds(centre, half), centre, half)

    def divided(self, parts: Boxes, rows: Indices) -> Boxes:
        """Both halves of pairs, split along the side with the largest motion of the TCP."""
        pairs = parts[rows]
        sizes = np.stack(
            [family.sizes(pairs.half[:, k]) for k, family in enumerate(self.families)], axis=1
        )
        end = sizes.max(axis=2).argmax(axis=1)
        centre, half = np.tile(pairs.centre, (2, 1, 1)), np.tile(pairs.half, (2, 1, 1))
        reached, ends = np.ones(len(centre), dtype=bool), np.tile(end, 2)
        for k, family in enumerate(self.families):
            own = np.flatnonzero(ends == k)
            if len(own):
                halves = halved(family, pairs.centre[end == k, k], pairs.half[end == k, k])
                centre[own, k], half[own, k], reached[own] = family.narrowed(*halves)
        # the bound of the whole holds for its parts
        value = np.tile(pairs.value, 2)
        value[reached] = np.maximum(value[reached], self._bounds(centre[reached], half[reached]))
        return Boxes(np.where(reached, value, np.inf), centre, half)

    def _bounds(self, centre: Array, half: Array) -> Array:
        """Bounds (b,) [J] on motions between boxes (b, 2, nq) [rad]."""
        displacement, possible = least_displacement(
            self.position_limits, centre[:, 0], half[:, 0], centre[:, 1], half[:, 1], given=False
        )
        start, goal = (
            family.least_potential(centre[:, k], half[:, k])
            for k, family in enumerate(self.families)
        )
        return np.where(possible, self.bound.of(displacement, goal + start), np.inf)


def _paired_boxes(families: Sequence[PoseFamily]) -> Sequence[EndBoxes]:
    """The smallest boxes of both ends with an acceptable number of pairs."""
    sides = [
        _reaching(family, *one_turn_boxes(family.prepared.arm.robot.nq, PAIRING.boxes_per_joint))
        for family in families
    ]
    chosen = sides
    for _ in range(PAIRING.halvings):
        sides = [
            _reaching(family, *halved(family, *side))
            for family, side in zip(families, sides, strict=True)
        ]
        counts = [len(centre) for centre, _ in sides]
        if max(counts) > PAIRING.most_boxes:
            break
        if prod(counts) <= PAIRING.most_pairs:
            chosen = sides
    return chosen


def _reaching(family: PoseFamily, centre: Array, half: Array) -> tuple[Array, Array]:
    """Narrow boxes (b, nq) [rad], and drop boxes without configurations of a family."""
    centre, half, reached = family.narrowed(centre, half)
    return centre[reached], half[reached]
