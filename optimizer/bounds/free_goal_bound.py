"""Lower bound on the motions to all configurations of a goal whose orientation is partly free.

Branch and bound over boxes of joint positions.

- A box is empty if its inner joints cannot bring the wrist to a distance of the goal at which the
  goal can be reached (`kinematics.covers.wrist_geometry`; the wrist may be anywhere else).
- `kinematics.covers.pose_boxes` narrows the other boxes, more the smaller they are: they shrink
  onto the configurations of the goal.
- The displacement of each joint is at least its distance from the box, and the potential energy at
  the goal at least the energy at the middle of the box less the greatest fall within the box.
  `lower_bounds` falls with neither, so that its value at both bounds every motion into the box.

The least value over all boxes bounds the family. It rises towards the least bound of any pair.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.end_curves import EndCurves
from joulepath.optimizer.bounds.least_displacement import least_displacement
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.bounds.pair import Pair
from joulepath.optimizer.bounds.subdivide import DEFAULT_LIMITS, Boxes, BoxSubdivision, SearchLimits
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.kinematics.covers.pose_boxes import PoseBoxes
from joulepath.optimizer.kinematics.covers.wrist_boxes import WristBoxes
from joulepath.optimizer.kinematics.covers.wrist_geometry import (
    WRIST_JOINTS,
    Shell,
    WristBody,
    WristGeometry,
    greatest_rates,
)
from joulepath.optimizer.kinematics.orientation_tolerance import within_cone
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.targets import AnyOf


@dataclass(frozen=True)
class PoseFamilySettings:
    """Settings of the subdivision of a pose's configurations."""

    boxes_per_joint: tuple[int, ...] = (4, 2, 1)
    """Numbers of first boxes along the range of each inner joint, the finest first."""
    most_first_boxes: int = 4096
    """Largest number of first boxes over all starts, by which the fineness is chosen."""
    smallest_side: float = 0.002
    """Half side [rad] of the widest side below which a box is not split."""
    length_per_radian: float = 0.3
    """Length [m/rad] that any joint counts beside the path of the TCP where a side is chosen."""
    wide_side: float = 0.3
    """Half side [rad] above which sides count as equally wide, so that inner joints come first."""
    narrowing_size: float = 2.0
    """Sum of half sides [rad] below which it pays to narrow a box in all joints."""


POSE_FAMILY = PoseFamilySettings()


def bound_of_free_goals(
    prepared: PreparedProblem, pairs: Sequence[Pair], deadline: Deadline, enough: float = np.inf
) -> float:
    """Lower bound on the motions to all goals of partly free orientation [J]; inf for none.

    The bound covers the whole cone of a tool. The samples of a goal leave out the rim of the cone,
    at which no motion could end.

    Args:
        prepared: problem of the motions.
        pairs: pairs of end configurations; a goal counts if one of them reaches it.
        deadline: deadline of the search, which then returns its bound so far.
        enough: sufficient bound, at which the search ends [J].
    """
    goal = prepared.problem.goal
    targets = goal.targets if isinstance(goal, AnyOf) else (goal,)
    reached = {pair.goal.target for pair in pairs if pair.goal.tolerance is not None}
    poses = [
        within_cone(prepared.arm, pose)
        for k, pose in enumerate(targets)
        if k in reached and isinstance(pose, ConeOrientedPose)
    ]
    if not poses:
        return np.inf
    curves = EndCurves.of([pair.start for pair in pairs])
    starts, half = curves.boxes(curves.first())
    limits = SearchLimits.of(prepared, deadline, enough, searches=len(poses))
    return min(family_bound(prepared, pose, starts, limits, half, curves.given) for pose in poses)


def family_bound(
    prepared: PreparedProblem,
    pose: ConeOrientedPose,
    starts: Array,
    limits: SearchLimits = DEFAULT_LIMITS,
    half: Array | None = None,
    given: bool = False,
) -> float:
    """Lower bound on the objective of motions from any start to any configuration of a pose [J].

    Args:
        prepared: problem of the motions.
        pose: pose at the goal.
        starts: start configurations, shape (s, nq) [rad].
        limits: limits on the effort; less effort gives a weaker bound.
        half: half sides of boxes around the starts, shape (s, nq) [rad]; None for points.
        given: whether the full turns of the starts are fixed.
    """
    return _GoalBoxes(PoseFamily(prepared, pose, given), starts, half, limits).least_bound()


def _greatest_potentials(prepared: PreparedProblem, centre: Array, half: Array | None) -> Array:
    """Greatest potential energies (s,) [J] in boxes around configurations (s, nq)."""
    potentials = np.array([prepared.potential(q) for q in centre])
    if half is None:
        return potentials
    return np.asarray(potentials + half @ greatest_rates(prepared.arm))


def one_turn_boxes(nq: int, boxes_per_joint: int) -> tuple[Array, Array]:
    """Boxes that cover one turn of every joint, several along each inner joint.

    Returns:
        Middles and half sides, shape (b, nq) [rad].
    """
    inner, side = max(nq - WRIST_JOINTS, 0), np.pi / boxes_per_joint
    along_joint = -np.pi + side * (2 * np.arange(boxes_per_joint) + 1)
    # two boxes for the two ways of bending the wrist
    bends = [(-np.pi / 2, np.pi / 2)] * (nq > WRIST_JOINTS)
    parts = np.array(list(product(*[along_joint] * inner, *bends)))
    centre, half = np.zeros((len(parts), nq)), np.full((len(parts), nq), np.pi)
    if nq > WRIST_JOINTS:
        centre[:, :inner], half[:, :inner] = parts[:, :inner], side
        centre[:, inner + 1], half[:, inner + 1] = parts[:, inner], np.pi / 2
    return centre, half


@dataclass(frozen=True)
class _StartBoxes(Boxes):
    """Boxes of goal configurations, each for one of the starts."""

    start: Indices
    """Index of the start, shape (b,)."""


class _GoalBoxes(BoxSubdivision[_StartBoxes]):
    """Boxes of the goal configurations of one pose, for every start."""

    def __init__(
        self, family: PoseFamily, starts: Array, half: Array | None, limits: SearchLimits
    ) -> None:
        self.family, self.starts, self.limits = family, starts, limits
        self.start_half = np.zeros_like(starts) if half is None else half
        self.potentials = _greatest_potentials(family.prepared, starts, half)

    def is_settled(self, half: Array) -> bool:
        """Whether a box with half sides (nq,) [rad] is too small to split."""
        return self.family.is_settled(half)

    def first(self) -> _StartBoxes:
        """Boxes over one turn of every joint, for every start."""
        nq, count = self.starts.shape[1], len(self.starts)
        inner, most = max(nq - WRIST_JOINTS, 0), POSE_FAMILY.most_first_boxes
        fineness = next(
            (n for n in POSE_FAMILY.boxes_per_joint if 2 * n**inner * count <= most),
            POSE_FAMILY.boxes_per_joint[-1],
        )
        centre, half = one_turn_boxes(nq, fineness)
        start = np.repeat(np.arange(count), len(centre))
        return self._bounded(start, np.tile(centre, (count, 1)), np.tile(half, (count, 1)))

    def divided(self, parts: _StartBoxes, rows: Indices) -> _StartBoxes:
        """Both halves of boxes."""
        boxes = parts[rows]
        halves = self._bounded(
            np.tile(boxes.start, 2), *halved(self.family, boxes.centre, boxes.half)
        )
        # the bound of the whole holds for its parts
        value = np.maximum(halves.value, np.concatenate([boxes.value, boxes.value]))
        return _StartBoxes(value, halves.centre, halves.half, halves.start)

    def _bounded(self, start: Indices, centre: Array, half: Array) -> _StartBoxes:
        """The boxes, narrowed, with their bounds."""
        centre, half, reached = self.family.narrowed(centre, half)
        value = np.full(len(centre), np.inf)
        rows = start[reached]
        value[reached] = self.family.bounds(
            self.starts[rows],
            self.start_half[rows],
            self.potentials[rows],
            centre[reached],
            half[reached],
        )
        return _StartBoxes(value, centre, half, start)


@dataclass(frozen=True)
class PoseFamily:
    """The configurations of a pose in all of its allowed orientations."""

    prepared: PreparedProblem
    pose: ConeOrientedPose
    given: bool
    """Whether the full turns of the starts are fixed."""

    @cached_property
    def _boxes(self) -> PoseBoxes:
        return PoseBoxes(self.prepared.arm, self.pose)

    @cached_property
    def _wrist(self) -> WristBoxes | None:
        return None if self._geometry is None else WristBoxes(self._geometry, self.pose)

    @cached_property
    def _geometry(self) -> WristGeometry | None:
        return WristGeometry.of(self.prepared.arm)

    @cached_property
    def _shells(self) -> list[Shell]:
        return [] if self._geometry is None else self._geometry.shells(self.pose)

    @cached_property
    def _bodies(self) -> list[WristBody]:
        return [] if self._geometry is None else self._geometry.bodies(self.pose)

    @cached_property
    def _bound(self) -> LeastBound:
        return LeastBound(self.prepared)

    @cached_property
    def weights(self) -> Array:
        """Approximate path of the TCP per joint, shape (nq,) [m/rad]; 0 for a free joint."""
        path = self._boxes.levers + POSE_FAMILY.length_per_radian
        return np.where(self._boxes.free, 0.0, path)

    def sizes(self, half: Array) -> Array:
        """Approximate path of the TCP along each side of boxes [m].

        Args:
            half: half sides, shape (b, nq) [rad].
        """
        return np.minimum(half, POSE_FAMILY.wide_side) * self.weights

    def is_settled(self, half: Array) -> bool:
        """Whether a box with half sides (nq,) [rad] is too small to split."""
        return bool(half[~self._boxes.free].max(initial=0.0) < POSE_FAMILY.smallest_side)

    def narrowed(self, centre: Array, half: Array) -> tuple[Array, Array, Mask]:
        """Smaller boxes with all configurations of the pose in given boxes (b, nq) [rad].

        Returns:
            Middles and half sides (b, nq) [rad], and whether a box may hold any configuration (b,).
        """
        reached = np.ones(len(centre), dtype=bool)
        if self._geometry is not None:
            inner = self._geometry.inner
            wrist, _ = self._geometry.placed(centre[:, :inner])
            blur = half[:, :inner] @ self._geometry.levers
            for shell in self._shells:
                distance = np.linalg.norm(wrist - shell.centre, axis=1)
                reached &= (distance - blur <= shell.most) & (distance + blur >= shell.least)
        centre, half = centre.copy(), half.copy()
        if reached.any() and self._wrist is not None:
            centre[reached], half[reached], reached[reached] = self._wrist.narrowed(
                centre[reached], half[reached]
            )
        size = half.sum(axis=1) - self._boxes.free[-1] * half[:, -1]
        small = np.flatnonzero(reached & (size < POSE_FAMILY.narrowing_size))
        if len(small):
            centre[small], half[small], reached[small] = self._boxes.narrowed(
                centre[small], half[small]
            )
        return centre, half, reached

    def bounds(
        self, starts: Array, start_halves: Array, potentials: Array, centres: Array, halves: Array
    ) -> Array:
        """Lower bounds on motions from boxes at the start into boxes at the goal, shape (b,) [J].

        Args:
            starts: middles of boxes at the start, shape (b, nq) [rad].
            start_halves: half sides of boxes at the start, shape (b, nq) [rad].
            potentials: greatest potential energies at the start, shape (b,) [J].
            centres: middles of boxes at the goal, shape (b, nq) [rad].
            halves: half sides of boxes at the goal, shape (b, nq) [rad].
        """
        limits = self.prepared.arm.active_limits
        displacement, possible = least_displacement(
            limits, starts, start_halves, centres, halves, self.given
        )
        gain = self.least_potential(centres, halves) - potentials
        return np.where(possible, self._bound.of(displacement, gain), np.inf)

    def least_potential(self, centres: Array, halves: Array) -> Array:
        """Lower bounds (b,) [J] on the potential energy of the pose's configurations in boxes."""
        return np.maximum(
            self._boxes.least_potential(centres, halves), self._wrist_potential(centres, halves)
        )

    def _wrist_potential(self, centres: Array, halves: Array) -> Array:
        """Lower bounds (b,) [J] on the potential energy in boxes, for any pose of the wrist.

        The bodies of the wrist hang from the inner joints on one side and from the goal on the
        other: neither lets them lower than their reach.
        """
        geometry = self._geometry
        if geometry is None:
            return np.full(len(centres), -np.inf)
        inner, strength = geometry.inner, float(np.linalg.norm(geometry.gravity))
        wrist, lowest = geometry.placed(centres[:, :inner])
        lowest = lowest - halves[:, :inner] @ geometry.potential_rates
        hanging = -wrist @ geometry.gravity - halves[:, :inner] @ geometry.levers * strength
        for body in self._bodies:
            lowest += body.mass * np.maximum(hanging - body.reach * strength, body.least_potential)
        return lowest


def halved(family: PoseFamily, centre: Array, half: Array) -> tuple[Array, Array]:
    """Halves of boxes (b, nq) [rad], split along the side that moves the TCP most.

    Returns:
        Middles and half sides (2 b, nq) [rad], the lower halves first.
    """
    widest, rows = family.sizes(half).argmax(axis=1), np.arange(len(half))
    step = np.zeros_like(half)
    step[rows, widest] = half[rows, widest] / 2
    return np.concatenate([centre - step, centre + step]), np.tile(half - step, (2, 1))
