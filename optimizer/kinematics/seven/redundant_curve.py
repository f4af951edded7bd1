"""Curves of configurations on which an arm of the form `SphericalShoulder` holds a pose.

A curve is one branch over one interval of the last angle. At an end of the interval two branches
meet, and the angles change with the root of the distance from it. With q7 = middle - half cos u
they change evenly with the parameter u.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.angles import nearest_turn, wrapped
from joulepath.optimizer.kinematics.seven.redundant_boxes import Cells, boxes_of
from joulepath.optimizer.kinematics.seven.redundant_pose import RedundantPose
from joulepath.optimizer.problem.branches import Label

# parts that a curve is cut into to find where it is within the limits, then parts of what is not
# decided, and again
PARTS = (40, 8)
# a configuration is sought along the tangent if it is farther than NEAREST from the member with its
# last angle [rad], and first among MEMBERS of each arc if it is farther than FAR; steps, and the
# difference of parameters for the tangent
NEAREST, FAR, MEMBERS, STEPS, STEP = 1e-9, 1e-2, 16, 3, 1e-6
# rounding of an angle on a limit [rad]
ROUNDING = 1e-9

Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class RedundantCurve:
    """`SelfMotion` on one sheet, signs (3,), over one interval [rad] of q7; a `whole` turn has q7
    itself as parameter.

    `arcs` are the intervals of the parameter: all of it, or what may be within limits.
    """

    pose: RedundantPose
    sheet: Array
    interval: tuple[float, float]
    label: Label
    arcs: list[tuple[float, float]]

    @classmethod
    def of(
        cls, pose: RedundantPose, sheet: Array, interval: tuple[float, float], label: Label
    ) -> RedundantCurve:
        """The whole curve."""
        full = interval == (-np.pi, np.pi)
        return cls(pose, sheet, interval, label, [(-np.pi, np.pi) if full else (0.0, np.pi)])

    @property
    def whole(self) -> bool:
        """Whether the curve is closed over q7."""
        return self.interval == (-np.pi, np.pi)

    @cached_property
    def free(self) -> tuple[int, ...]:
        """Indices of the joints that move: all but the fourth where the last axis meets the
        wrist."""
        square = self.pose.waves[0]
        still = np.hypot(square[1], square[2]) < 1e-12
        return tuple(j for j in range(7) if j != 3 or not still)

    def last_angle(self, parameter: Array) -> Array:
        """q7 (n,) [rad] at parameters (n,)."""
        return last_angle(
            np.asarray(parameter, dtype=float), np.array(self.interval), np.asarray(self.whole)
        )

    def parameter(self, q: Array) -> float:
        """The parameter of the member nearest to q (7,), nearly: that with its last angle, then on
        along the tangent.

        Next to a singularity, and where two sheets meet, the other angles change by far more than
        the last one. Of a configuration that is not on the curve, the nearest of some members comes
        first.
        """
        a, b = self.interval
        u = float(nearest_turn(np.asarray(q[6]), np.asarray((a + b) / 2)))
        if not self.whole:
            u = float(np.arccos(np.clip(((a + b) / 2 - u) / max((b - a) / 2, 1e-300), -1.0, 1.0)))
        u = self.clipped(u)
        gap = wrapped(q - self.at(np.array([u]))[0])
        if np.abs(gap).max() > FAR:
            tried = np.append(np.concatenate([np.linspace(*arc, MEMBERS) for arc in self.arcs]), u)
            away = wrapped(q - self.at(tried))
            nearest = int(np.abs(away).max(axis=1).argmin())
            u, gap = float(tried[nearest]), away[nearest]
        for _ in range(STEPS):
            if np.abs(gap).max() < NEAREST:
                break
            tangent = wrapped(np.diff(self.at(np.array([u - STEP, u + STEP])), axis=0)[0]) / (
                2 * STEP
            )
            near = self.clipped(u + float(tangent @ gap / max(float(tangent @ tangent), 1e-300)))
            fresh = wrapped(q - self.at(np.array([near]))[0])
            if np.abs(fresh).max() >= np.abs(gap).max():
                break
            u, gap = near, fresh
        return u

    def clipped(self, parameter: float) -> float:
        """The nearest parameter on an arc."""
        found = []
        for lower, upper in self.arcs:
            near = parameter
            if self.whole:
                near = float(nearest_turn(np.asarray(parameter), np.asarray((lower + upper) / 2)))
            on_arc = float(np.clip(near, lower, upper))
            found.append((abs(near - on_arc), on_arc))
        return min(found)[1]

    def at(self, parameter: Array) -> Array:
        """The configurations (n, 7) [rad] at parameters (n,) on the arcs."""
        q7 = self.last_angle(parameter)
        return self.pose.configurations(q7, np.tile(self.sheet, (len(q7), 1)))

    def boxes(self, parameter: Array, half: Array) -> tuple[Array, Array]:
        """See `SelfMotion` and `redundant_boxes`."""
        return CurveStack.of([self]).boxes(np.zeros(len(parameter), dtype=np.intp), parameter, half)


def members(curves: Sequence[RedundantCurve], parameters: Sequence[Array]) -> list[Array]:
    """The configurations (n, 7) [rad] of each of the curves of one pose at its parameters (n,) on
    its arcs.
    """
    counts, stack = [len(at) for at in parameters], CurveStack.of(curves)
    rows, last = np.repeat(np.arange(len(curves)), counts), np.cumsum(counts).tolist()
    q = stack.pose.configurations(
        stack.last_angle(np.concatenate(parameters), rows), stack.sheet[rows]
    )
    return [q[end - count : end] for count, end in zip(counts, last, strict=True)]


def within(
    curves: Sequence[RedundantCurve], q_min: Array, q_max: Array
) -> tuple[list[RedundantCurve], list[RedundantCurve]]:
    """The curves of one pose that may be within limits (7,) [rad], cut to arcs that hold every
    member that is; and those of the given curves with a member that may be, whose third axis may be
    in line with the first.

    Each is given with both shoulders. What is left out is proven to be outside by its box. The arcs
    reach beyond the limits by some hundredths [rad].
    """
    if not curves:
        return [], []
    owner = np.array(
        [[k for k, curve in enumerate(curves) if curve.sheet[0] * side > 0] for side in (1.0, -1.0)]
    )
    right = CurveStack.of([curves[k] for k in owner[0]])
    kept, passing = _kept(
        right, np.array([curves[k].arcs[0] for k in owner[0]]), _Room.of(q_min, q_max)
    )
    found: list[list[tuple[float, float]]] = [[] for _ in curves]
    for k, arc in zip(owner.ravel()[kept[0]].tolist(), kept[1], strict=True):
        found[k].append(arc)
    cut = [
        RedundantCurve(curve.pose, curve.sheet, curve.interval, curve.label, own)
        for curve, own in zip(curves, found, strict=True)
        if own
    ]
    return cut, [curves[k] for k in sorted(owner[passing].tolist())]


def _kept(
    curves: CurveStack, arcs: Array, room: _Room
) -> tuple[tuple[Rows, list[tuple[float, float]]], Mask]:
    """Where curves on the right shoulder, on their arcs (m, 2), and their counterparts with the
    left one may be within limits: rows (k,) of all the curves (2 m), and k arcs. And which (2, m)
    may have members there whose third axis is in line with the first."""
    m, (coarse, fine) = len(arcs), PARTS
    whole, ends = _cut(arcs, coarse), np.empty((m, coarse * fine + 1))
    ends[:, :-1] = _cut(np.stack([whole[:, :-1], whole[:, 1:]], axis=2).reshape(-1, 2), fine)[
        :, :-1
    ].reshape(m, -1)
    ends[:, -1] = arcs[:, 1]
    q7 = curves.last_angle(ends.T, np.arange(m)).T
    sheet = curves.sheet[np.arange(m).repeat(coarse)]
    cells = Cells(q7[:, :-fine:fine].ravel(), q7[:, fine::fine].ravel(), sheet)
    held, inside, aligned = _judged(curves.pose, cells, room)
    decided = held & inside
    passing: Mask = np.logical_or.reduce((decided & aligned).reshape(2, m, coarse), axis=2)
    # of each part, which of its own parts may be within the limits
    parts = np.empty((2, m * coarse, fine), dtype=bool)
    parts[:] = decided[:, :, None]
    open_ = held > inside
    (left,) = (open_[0] | open_[1]).nonzero()
    if len(left):
        low, high = q7[:, :-1].reshape(-1, fine)[left], q7[:, 1:].reshape(-1, fine)[left]
        held, _, aligned = _judged(
            curves.pose, Cells(low.ravel(), high.ravel(), sheet[left.repeat(fine)]), room
        )
        held = held.reshape(2, -1, fine) & open_[:, left, None]
        parts[:, left] |= held
        side, row = np.logical_or.reduce(held & aligned.reshape(-1, fine), axis=2).nonzero()
        passing[side, left[row] // coarse] = True
    # an arc starts where the parts change, and ends where they change again
    padded = np.zeros((2 * m, coarse * fine + 2), dtype=bool)
    padded[:, 1:-1] = parts.reshape(2 * m, -1)
    row, at = (padded[:, 1:] != padded[:, :-1]).nonzero()
    bounds = ends[row % m, at].tolist()
    return (row[::2], list(zip(bounds[::2], bounds[1::2], strict=True))), passing


def _cut(arcs: Array, count: int) -> Array:
    """The ends (m, count + 1) of equal parts of arcs (m, 2)."""
    ends = arcs[:, :1] + (arcs[:, 1:] - arcs[:, :1]) / count * np.arange(count + 1)
    ends[:, -1] = arcs[:, 1]
    return np.asarray(ends)


@dataclass(frozen=True, eq=False)
class CurveStack:
    """Curves of one pose: intervals (2, m) [rad] of q7, which are `whole` (m,), and sheets (m,
    3)."""

    pose: RedundantPose
    interval: Array
    whole: Mask
    sheet: Array

    @classmethod
    def of(cls, curves: Sequence[RedundantCurve]) -> CurveStack:
        """Those of curves of one pose."""
        return cls(
            curves[0].pose,
            np.array([curve.interval for curve in curves]).T,
            np.array([curve.whole for curve in curves]),
            np.array([curve.sheet for curve in curves]),
        )

    def last_angle(self, u: Array, rows: Rows) -> Array:
        """q7 (…, n) [rad] at parameters u (…, n) of curves (n,)."""
        return last_angle(u, self.interval[:, rows], self.whole[rows])

    def boxes(self, rows: Rows, parameter: Array, half: Array) -> tuple[Array, Array]:
        """Boxes as of `SelfMotion`, each of the curve whose row (n,) is given."""
        ends = np.array([parameter - half, parameter + half])
        ends = np.where(self.whole[rows], ends, np.clip(ends, 0.0, np.pi))
        low, high = self.last_angle(ends, rows)
        return boxes_of(self.pose, Cells(low, high, self.sheet[rows]))


@dataclass(frozen=True, eq=False)
class _Room:
    """Middles (10, 1) and half widths (10, 1) [rad] of what limits leave the seven joints, then the
    first three again. A joint that may turn all around has no width that its angle could exceed."""

    middle: Array
    width: Array

    @classmethod
    def of(cls, q_min: Array, q_max: Array) -> _Room:
        """Within limits (7,) [rad]."""
        joints = [*range(7), 0, 1, 2]
        middle, width = (
            (q_min + q_max)[joints, None] / 2,
            (q_max - q_min)[joints, None] / 2 + ROUNDING,
        )
        width[width >= np.pi] = np.inf
        return cls(middle, width)


def _judged(pose: RedundantPose, cells: Cells, room: _Room) -> tuple[Mask, Mask, Mask]:
    """Which cells (n,) with the right shoulder may have members within the limits, and which have
    no others; (2, n) each, the second row for their counterparts with the left shoulder. Then which
    (n,) may have a member whose third axis is in line with the first."""
    right, half = boxes_of(pose, cells)
    q, sides = np.empty((10, len(half))), np.empty((2, 10, len(half)))
    # with the other shoulder, the third axis leans to the other side; the last four joints are the
    # same
    q[:7], q[7:] = right.T, right.T[:3]
    q[7:10:2] += np.pi
    q[8] = -q[8] - 2 * pose.form.lean_at_zero
    sides[0, :7], sides[0, 7:] = half.T, half.T[:3]
    np.negative(sides[0], out=sides[1])
    beyond = np.abs(wrapped(q - room.middle)) - room.width
    within = beyond <= sides
    last = np.logical_and.reduce(within[:, 3:7], axis=1)
    first, mirrored = (last & np.logical_and.reduce(within[:, k : k + 3], axis=1) for k in (0, 7))
    return (
        np.array([first[0], mirrored[0]]),
        np.array([first[1], mirrored[1]]),
        np.asarray(half[:, 0] >= np.pi),
    )


def last_angle(u: Array, interval: Array, whole: Mask) -> Array:
    """q7 (…, n) [rad] at parameters u (…, n) of curves over intervals (2,) or (2, n) [rad]."""
    a, b = interval
    return np.where(whole, u, (a + b) / 2 - (b - a) / 2 * np.cos(u))
