"""A lower bound on the motions to a goal whose orientation is free in part: to all of its configurations at once.

The wrist decides the orientation; the bound leaves it free and looks at the inner joints alone (`kinematics.
wrist_geometry`). Branch and bound over boxes of inner joint positions. A box that cannot bring the wrist near enough to
the goal, or not far enough from it, holds no configuration. For any other box, the joint displacement is at least that
to the box, and the potential energy at least that in its middle less what the links can still sink. `lower_bounds` of
the least displacement and the least gain of potential energy bounds every motion into the box, since it falls with
neither. The least value over all boxes bounds the family.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from models.robot import Array
from optimizer.collision.bodies import Indices
from optimizer.deadline import NEVER, Deadline
from optimizer.kinematics.wrist_geometry import Shell, WristBody, WristGeometry, least_potential, potential_rates
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.cone_oriented_pose import ConeOrientedPose
from optimizer.search.candidates import Candidate
from optimizer.search.lower_bound import LeastBound
from optimizer.search.self_motion_bound import EndCurves

# boxes along each joint at first, boxes split in a round, rounds
FIRST_BOXES, SPLIT, ROUNDS = 4, 160, 20
# a box is not split once its widest side is below this [rad]
SMALLEST = 0.01


def family_bound_of(prepared: PreparedProblem, candidates: Sequence[Candidate], deadline: Deadline) -> float:
    """Bound [J] on the motions to those goals whose orientation is free in part; inf if there are none."""
    poses = {each.goal.target: each.goal.tolerance for each in candidates if each.goal.tolerance is not None}
    if not poses:
        return np.inf
    curves = EndCurves.of([each.start for each in candidates])
    starts, half = curves.boxes(curves.first())
    rounds = ROUNDS // len(poses)
    return min(family_bound(prepared, pose, starts, rounds, deadline, half) for pose in poses.values())


def family_bound(
    prepared: PreparedProblem,
    pose: ConeOrientedPose,
    starts: Array,
    rounds: int = ROUNDS,
    deadline: Deadline = NEVER,
    half: Array | None = None,
) -> float:
    """Lower bound [J] on the objective of motions from any of `starts` (s, nq) to any configuration of `pose`.

    With `half` (s, nq) [rad] the starts are boxes, `starts` their middles and `half` their half sides. Fewer rounds, or
    a deadline, give a weaker bound. For a chain without inner joints the bound is that of motions to anywhere.
    """
    geometry = WristGeometry.of(prepared.arm)
    if geometry is None:
        gain = least_potential(prepared.arm) - _greatest_potentials(prepared, starts, half)
        return float(LeastBound(prepared).of(np.zeros_like(starts), gain).min())
    return _BoxSearch(_Family(prepared, pose, geometry), starts, half).run(rounds, deadline)


def _greatest_potentials(prepared: PreparedProblem, centre: Array, half: Array | None) -> Array:
    """The greatest potential energy (s,) [J] in boxes around configurations (s, nq)."""
    potentials = np.array([prepared.potential(q) for q in centre])
    if half is None:
        return potentials
    return np.asarray(potentials + half @ potential_rates(prepared.model, prepared.arm.gravity))


@dataclass(frozen=True)
class _Boxes:
    """Boxes of inner joint positions: `start` (b,) the index of each one's start, middle and half sides (b, inner)
    [rad], and the bound (b,) [J], inf for a box without configurations."""

    start: Indices
    centre: Array
    half: Array
    value: Array

    def __getitem__(self, chosen: Indices) -> _Boxes:
        return _Boxes(self.start[chosen], self.centre[chosen], self.half[chosen], self.value[chosen])

    def joined(self, other: _Boxes) -> _Boxes:
        """These boxes, then the others."""
        return _Boxes(
            np.concatenate([self.start, other.start]),
            np.concatenate([self.centre, other.centre]),
            np.concatenate([self.half, other.half]),
            np.concatenate([self.value, other.value]),
        )


class _BoxSearch:
    """Branch and bound over boxes for one family of goal configurations."""

    def __init__(self, family: _Family, starts: Array, half: Array | None) -> None:
        self.family, self.starts = family, starts
        self.start_half = np.zeros_like(starts) if half is None else half
        self.potentials = _greatest_potentials(family.prepared, starts, half)

    def run(self, rounds: int, deadline: Deadline) -> float:
        """The least bound [J] of any box after at most so many rounds of splitting."""
        boxes = self.first()
        for _ in range(rounds):
            boxes = boxes[np.flatnonzero(np.isfinite(boxes.value))]
            order = np.argsort(boxes.value, kind="stable")
            if not len(order) or boxes.half[order[0]].max() < SMALLEST or deadline.passed:
                break
            boxes = boxes[order[SPLIT:]].joined(self.halved(boxes[order[:SPLIT]]))
        return float(boxes.value.min(initial=np.inf))

    def first(self) -> _Boxes:
        """Boxes that cover every position of the inner joints, for every start."""
        side, count = np.pi / FIRST_BOXES, len(self.starts)
        one_side = -np.pi + side * (2 * np.arange(FIRST_BOXES) + 1)
        centres = np.array(list(product(one_side, repeat=self.family.geometry.inner)))
        start = np.repeat(np.arange(count), len(centres))
        return self.bounded(start, np.tile(centres, (count, 1)), np.full((len(start), centres.shape[1]), side))

    def halved(self, boxes: _Boxes) -> _Boxes:
        """Both halves of every box, split along the side that moves the wrist most."""
        widest = (boxes.half * self.family.geometry.levers).argmax(axis=1)
        rows = np.arange(len(widest))
        step = np.zeros_like(boxes.half)
        step[rows, widest] = boxes.half[rows, widest] / 2
        start = np.concatenate([boxes.start, boxes.start])
        centre = np.concatenate([boxes.centre - step, boxes.centre + step])
        halves = self.bounded(start, centre, np.concatenate([boxes.half - step, boxes.half - step]))
        # the bound of a part is at least that of the whole
        value = np.maximum(halves.value, np.concatenate([boxes.value, boxes.value]))
        return _Boxes(halves.start, halves.centre, halves.half, value)

    def bounded(self, start: Indices, centre: Array, half: Array) -> _Boxes:
        """The boxes with their bounds."""
        starts, start_half, potentials = self.starts[start], self.start_half[start], self.potentials[start]
        return _Boxes(start, centre, half, self.family.bounds(starts, start_half, potentials, centre, half))


@dataclass(frozen=True)
class _Family:
    """The configurations that reach a pose with any orientation that it allows."""

    prepared: PreparedProblem
    pose: ConeOrientedPose
    geometry: WristGeometry

    @cached_property
    def _shells(self) -> list[Shell]:
        return self.geometry.shells(self.pose)

    @cached_property
    def _bodies(self) -> list[WristBody]:
        return self.geometry.bodies(self.pose)

    @cached_property
    def _bound(self) -> LeastBound:
        return LeastBound(self.prepared)

    def bounds(self, starts: Array, start_halves: Array, potentials: Array, centres: Array, halves: Array) -> Array:
        """Bounds (b,) [J] on motions from boxes around starts (b, nq), of potential energy at most (b,) [J], into boxes
        (b, inner).

        inf for a box that holds no configuration.
        """
        wrist, lowest = self.geometry.placed(centres)
        blur = halves @ self.geometry.levers
        value = np.full(len(centres), np.inf)
        inside = np.ones(len(centres), dtype=bool)
        for shell in self._shells:
            distance = np.linalg.norm(wrist - shell.centre, axis=1)
            inside &= (distance - blur <= shell.most) & (distance + blur >= shell.least)
        if not inside.any():
            return value
        inner, strength = self.geometry.inner, float(np.linalg.norm(self.geometry.gravity))
        away = starts[inside, :inner] - centres[inside]
        away = np.abs(away - 2 * np.pi * np.round(away / (2 * np.pi)))
        displacement = np.zeros((int(inside.sum()), starts.shape[1]))
        displacement[:, :inner] = np.maximum(away - halves[inside] - start_halves[inside, :inner], 0.0)
        lowest = lowest[inside] - halves[inside] @ self.geometry.potential_rates
        hanging = -wrist[inside] @ self.geometry.gravity - blur[inside] * strength
        for body in self._bodies:
            # as low as it can hang from the wrist, and as low as it can be about the goal
            lowest += body.mass * np.maximum(hanging - body.reach * strength, body.least_potential)
        value[inside] = self._bound.of(displacement, lowest - potentials[inside])
        return value
