"""A lower bound on the motions to a goal whose orientation is free in part: to all of its
configurations at once.

Branch and bound over boxes of joint positions. A box holds no configuration of the goal if its
inner joints cannot bring the wrist near enough to the goal, or not far enough from it
(`kinematics.wrist_geometry`, which tells while the wrist may still be anywhere).
`kinematics.pose_boxes` narrows the others, the more the smaller they are, so that they shrink onto
the goal's configurations. For every box, the joint displacement is at least that to the box, and
the potential energy at least that in its middle less what it can fall. `lower_bounds` of the least
displacement and the least gain of potential energy bounds every motion into the box, since it falls
with neither. The least value over all boxes bounds the family; it grows towards the least bound of
any pair.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.box_search import NEARLY, ROUNDS, TIGHT_ROUNDS, Boxes, BoxSearch
from joulepath.optimizer.bounds.least_displacement import least_displacement
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.deadline import NEVER, Deadline
from joulepath.optimizer.kinematics.covers.pose_boxes import PoseBoxes
from joulepath.optimizer.kinematics.covers.wrist_boxes import WristBoxes
from joulepath.optimizer.kinematics.covers.wrist_geometry import (
    WRIST_JOINTS,
    Shell,
    WristBody,
    WristGeometry,
    potential_rates,
)
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.targets import AnyOf
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.ends import within_cone
from joulepath.optimizer.search.self_motion_bound import EndCurves

# boxes along each inner joint at first, but for so many starts that there would be more than
# MOST_FIRST in all
FIRST_BOXES, MOST_FIRST = (4, 2, 1), 4096
# a box is not split once its widest side is below this [rad]
SMALLEST = 0.002
# where a side is chosen to split: what a radian of any joint counts as [m] beside the path that it
# moves the TCP by, and the half side [rad] from which on a box is as wide as can be, so that inner
# joints come first
RADIAN, WIDE = 0.3, 0.3
# sum of half sides [rad] below which narrowing in all joints pays
SMALL = 2.0


def family_bound_of(
    prepared: PreparedProblem,
    candidates: Sequence[Candidate],
    deadline: Deadline,
    enough: float = np.inf,
) -> float:
    """Bound [J] on the motions to those goals whose orientation is free in part; inf if there are
    none.

    The search ends once the bound reaches `enough` [J]. The bound covers the whole of a tool's
    cone; samples leave out its rim, at which no motion could end.
    """
    goal = prepared.problem.goal
    targets = goal.targets if isinstance(goal, AnyOf) else (goal,)
    reached = {each.goal.target for each in candidates if each.goal.tolerance is not None}
    poses = [
        within_cone(prepared, pose)
        for k, pose in enumerate(targets)
        if k in reached and isinstance(pose, ConeOrientedPose)
    ]
    if not poses:
        return np.inf
    curves = EndCurves.of([each.start for each in candidates])
    starts, half = curves.boxes(curves.first())
    tight = prepared.problem.bound == "tight"
    rounds, nearly = (TIGHT_ROUNDS if tight else ROUNDS) // len(poses), 0.0 if tight else NEARLY
    return min(
        family_bound(prepared, pose, starts, rounds, deadline, half, enough, curves.given, nearly)
        for pose in poses
    )


def family_bound(
    prepared: PreparedProblem,
    pose: ConeOrientedPose,
    starts: Array,
    rounds: int = ROUNDS,
    deadline: Deadline = NEVER,
    half: Array | None = None,
    enough: float = np.inf,
    given: bool = False,
    nearly: float = 0.0,
) -> float:
    """Lower bound [J] on the objective of motions from any of `starts` (s, nq) to any configuration
    of `pose`.

    Starts that are `given` stand as they are, others with any full turn that the limits allow. With
    `half` (s, nq) [rad] the starts are boxes, `starts` their middles and `half` their half sides.
    Fewer rounds, or a deadline, give a weaker bound; the search ends once it reaches `enough` [J],
    after FEW rounds once it is within the share `nearly` of that.
    """
    return _BoxSearch(Family(prepared, pose, given), starts, half).run(
        rounds, deadline, enough, nearly
    )


def _greatest_potentials(prepared: PreparedProblem, centre: Array, half: Array | None) -> Array:
    """The greatest potential energy (s,) [J] in boxes around configurations (s, nq)."""
    potentials = np.array([prepared.potential(q) for q in centre])
    if half is None:
        return potentials
    return np.asarray(potentials + half @ potential_rates(prepared.model, prepared.arm.gravity))


def whole_turns(nq: int, along: int) -> tuple[Array, Array]:
    """Middles and half sides (b, nq) [rad] of boxes that cover one turn of every joint, so many
    along each inner one."""
    inner, side = max(nq - WRIST_JOINTS, 0), np.pi / along
    one_side = -np.pi + side * (2 * np.arange(along) + 1)
    # both ways of bending the wrist
    parts = np.array(
        list(product(*[one_side] * inner, *[(-np.pi / 2, np.pi / 2)] * (nq > WRIST_JOINTS)))
    )
    centre, half = np.zeros((len(parts), nq)), np.full((len(parts), nq), np.pi)
    if nq > WRIST_JOINTS:
        centre[:, :inner], half[:, :inner] = parts[:, :inner], side
        centre[:, inner + 1], half[:, inner + 1] = parts[:, inner], np.pi / 2
    return centre, half


@dataclass(frozen=True)
class _Boxes(Boxes):
    """Boxes (b, nq), and `start` (b,), the index of each one's start."""

    start: Indices


class _BoxSearch(BoxSearch[_Boxes]):
    """Branch and bound over boxes for one family of goal configurations."""

    def __init__(self, family: Family, starts: Array, half: Array | None) -> None:
        self.family, self.starts = family, starts
        self.start_half = np.zeros_like(starts) if half is None else half
        self.potentials = _greatest_potentials(family.prepared, starts, half)

    def settled(self, half: Array) -> bool:
        """Whether a box is not worth splitting."""
        return self.family.settled(half)

    def first(self) -> _Boxes:
        """Boxes that cover every position of the joints, for every start: the inner joints' range
        in parts.
        """
        nq, count = self.starts.shape[1], len(self.starts)
        inner = max(nq - WRIST_JOINTS, 0)
        along = next(
            (n for n in FIRST_BOXES if 2 * n**inner * count <= MOST_FIRST), FIRST_BOXES[-1]
        )
        centre, half = whole_turns(nq, along)
        start = np.repeat(np.arange(count), len(centre))
        return self.bounded(start, np.tile(centre, (count, 1)), np.tile(half, (count, 1)))

    def halved(self, boxes: _Boxes) -> _Boxes:
        """Both halves of every box, with their bounds."""
        halves = self.bounded(
            np.tile(boxes.start, 2), *halved(self.family, boxes.centre, boxes.half)
        )
        # the bound of a part is at least that of the whole
        value = np.maximum(halves.value, np.concatenate([boxes.value, boxes.value]))
        return _Boxes(halves.centre, halves.half, value, halves.start)

    def bounded(self, start: Indices, centre: Array, half: Array) -> _Boxes:
        """The boxes, narrowed, with their bounds."""
        centre, half, held = self.family.narrowed(centre, half)
        value = np.full(len(centre), np.inf)
        starts, start_half, potentials = (
            each[start[held]] for each in (self.starts, self.start_half, self.potentials)
        )
        value[held] = self.family.bounds(starts, start_half, potentials, centre[held], half[held])
        return _Boxes(centre, half, value, start)


@dataclass(frozen=True)
class Family:
    """The configurations that reach a pose with any orientation that it allows. `given`: see
    `EndCurves`.
    """

    prepared: PreparedProblem
    pose: ConeOrientedPose
    given: bool

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
        """Path of the TCP [m/rad] per joint (nq,), nearly; 0 for a joint that the pose leaves
        free."""
        return np.where(self._boxes.free, 0.0, self._boxes.levers + RADIAN)

    def sizes(self, half: Array) -> Array:
        """How much the sides of boxes, by their halves (b, nq) [rad], move the TCP (b, nq) [m],
        nearly.
        """
        return np.minimum(half, WIDE) * self.weights

    def settled(self, half: Array) -> bool:
        """Whether a box of half sides (nq,) [rad] is not worth splitting."""
        return bool(half[~self._boxes.free].max(initial=0.0) < SMALLEST)

    def narrowed(self, centre: Array, half: Array) -> tuple[Array, Array, Mask]:
        """Boxes (b, nq) that hold what of the given ones reaches the pose, and which of them (b,)
        may hold anything.
        """
        held = np.ones(len(centre), dtype=bool)
        if self._geometry is not None:
            inner = self._geometry.inner
            wrist, _ = self._geometry.placed(centre[:, :inner])
            blur = half[:, :inner] @ self._geometry.levers
            for shell in self._shells:
                distance = np.linalg.norm(wrist - shell.centre, axis=1)
                held &= (distance - blur <= shell.most) & (distance + blur >= shell.least)
        centre, half = centre.copy(), half.copy()
        if held.any() and self._wrist is not None:
            centre[held], half[held], held[held] = self._wrist.narrowed(centre[held], half[held])
        small = np.flatnonzero(
            held & (half.sum(axis=1) - self._boxes.free[-1] * half[:, -1] < SMALL)
        )
        if len(small):
            centre[small], half[small], held[small] = self._boxes.narrowed(
                centre[small], half[small]
            )
        return centre, half, held

    def bounds(
        self, starts: Array, start_halves: Array, potentials: Array, centres: Array, halves: Array
    ) -> Array:
        """Bounds (b,) [J] on motions from boxes around starts (b, nq), of potential energy at most
        (b,) [J], into boxes (b, nq)."""
        limits = self.prepared.arm.active_limits
        displacement, possible = least_displacement(
            limits, starts, start_halves, centres, halves, self.given
        )
        return np.where(
            possible,
            self._bound.of(displacement, self.lowest(centres, halves) - potentials),
            np.inf,
        )

    def lowest(self, centres: Array, halves: Array) -> Array:
        """Least potential energy (b,) [J] of configurations of the pose in boxes (b, nq), or
        less."""
        return np.maximum(
            self._boxes.least_potential(centres, halves), self._hanging(centres, halves)
        )

    def _hanging(self, centres: Array, halves: Array) -> Array:
        """Bound (b,) [J] on the potential energy in boxes, whatever the wrist does: it hangs from
        the inner joints, and from the goal."""
        geometry = self._geometry
        if geometry is None:
            return np.full(len(centres), -np.inf)
        inner, strength = geometry.inner, float(np.linalg.norm(geometry.gravity))
        wrist, lowest = geometry.placed(centres[:, :inner])
        lowest = lowest - halves[:, :inner] @ geometry.potential_rates
        hanging = -wrist @ geometry.gravity - halves[:, :inner] @ geometry.levers * strength
        for body in self._bodies:
            # as low as it can hang from the wrist, and as low as it can be about the goal
            lowest += body.mass * np.maximum(hanging - body.reach * strength, body.least_potential)
        return lowest


def halved(family: Family, centre: Array, half: Array) -> tuple[Array, Array]:
    """Both halves (2 b, nq) of boxes (b, nq), split along the side that moves the TCP most: the
    lower ones first.
    """
    widest, rows = family.sizes(half).argmax(axis=1), np.arange(len(half))
    step = np.zeros_like(half)
    step[rows, widest] = half[rows, widest] / 2
    return np.concatenate([centre - step, centre + step]), np.tile(half - step, (2, 1))
