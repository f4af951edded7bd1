"""Self-motions of an arm of the form `SphericalShoulder` over the last angle.

A curve is one branch over one interval of the last angle. At an end of the interval two branches
meet, and the angles change with the square root of the distance from the end. With q7 = middle -
half cos u, they change evenly with the parameter u.
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


@dataclass(frozen=True)
class RedundantCurveSettings:
    """Settings of cutting curves to limits and of finding members."""

    coarse_parts: int = 40
    """Number of parts of a curve that are tested against the limits."""
    fine_parts: int = 8
    """Number of parts of each undecided part."""
    near: float = 1e-9
    """Joint distance from a member below which its parameter is accepted [rad]."""
    far: float = 1e-2
    """Joint distance above which the nearest of a sample of members is the start instead [rad]."""
    sampled_members: int = 16
    """Number of sampled members of each arc."""
    tangent_steps: int = 3
    """Largest number of steps along the tangent."""
    difference: float = 1e-6
    """Difference of parameters for the tangent."""
    rounding: float = 1e-9
    """Angle beyond a limit that is due to rounding [rad]."""


SETTINGS = RedundantCurveSettings()

Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class RedundantCurve:
    """`SelfMotion` on one branch over one interval [rad] of q7.

    `signs` (3,) are those of the branch, see `RedundantPose`. The parameter of a curve over a whole
    turn is q7 itself. `arcs` are the intervals of the parameter: all of it, or the parts that may
    be within limits.
    """

    pose: RedundantPose
    signs: Array
    interval: tuple[float, float]
    label: Label
    arcs: list[tuple[float, float]]

    @classmethod
    def of(
        cls, pose: RedundantPose, signs: Array, interval: tuple[float, float], label: Label
    ) -> RedundantCurve:
        """The whole curve."""
        full = interval == (-np.pi, np.pi)
        return cls(pose, signs, interval, label, [(-np.pi, np.pi) if full else (0.0, np.pi)])

    @property
    def whole(self) -> bool:
        """Whether the curve is closed over a whole turn of q7."""
        return self.interval == (-np.pi, np.pi)

    @cached_property
    def free(self) -> tuple[int, ...]:
        """Indices of the moving joints: all but the fourth if the last axis meets the wrist."""
        square = self.pose.coefficients[0]
        still = np.hypot(square[1], square[2]) < 1e-12
        return tuple(j for j in range(7) if j != 3 or not still)

    def last_angle(self, parameter: Array) -> Array:
        """Last angles q7 (n,) [rad] at parameters (n,)."""
        return last_angle(
            np.asarray(parameter, dtype=float), np.array(self.interval), np.asarray(self.whole)
        )

    def parameter(self, q: Array) -> float:
        """Parameter of the member nearest to q (7,) [rad], approximately.

        The search starts at the member with the same last angle, or at the nearest of a sample if q
        is far from this member, and goes on along the tangent. Next to a singularity, and where two
        branches meet, the other angles change by far more than the last one.
        """
        a, b = self.interval
        u = float(nearest_turn(np.asarray(q[6]), np.asarray((a + b) / 2)))
        if not self.whole:
            u = float(np.arccos(np.clip(((a + b) / 2 - u) / max((b - a) / 2, 1e-300), -1.0, 1.0)))
        u = self.clipped(u)
        gap = wrapped(q - self.at(np.array([u]))[0])
        if np.abs(gap).max() > SETTINGS.far:
            tried = np.append(
                np.concatenate([np.linspace(*arc, SETTINGS.sampled_members) for arc in self.arcs]),
                u,
            )
            away = wrapped(q - self.at(tried))
            nearest = int(np.abs(away).max(axis=1).argmin())
            u, gap = float(tried[nearest]), away[nearest]
        for _ in range(SETTINGS.tangent_steps):
            if np.abs(gap).max() < SETTINGS.near:
                break
            tangent = wrapped(
                np.diff(
                    self.at(np.array([u - SETTINGS.difference, u + SETTINGS.difference])), axis=0
                )[0]
            ) / (2 * SETTINGS.difference)
            near = self.clipped(u + float(tangent @ gap / max(float(tangent @ tangent), 1e-300)))
            fresh = wrapped(q - self.at(np.array([near]))[0])
            if np.abs(fresh).max() >= np.abs(gap).max():
                break
            u, gap = near, fresh
        return u

    def clipped(self, parameter: float) -> float:
        """Nearest parameter on an arc."""
        found = []
        for lower, upper in self.arcs:
            near = parameter
            if self.whole:
                near = float(nearest_turn(np.asarray(parameter), np.asarray((lower + upper) / 2)))
            on_arc = float(np.clip(near, lower, upper))
            found.append((abs(near - on_arc), on_arc))
        return min(found)[1]

    def at(self, parameter: Array) -> Array:
        """Configurations (n, 7) [rad] at parameters (n,) on the arcs."""
        q7 = self.last_angle(parameter)
        return self.pose.configurations(q7, np.tile(self.signs, (len(q7), 1)))

    def boxes(self, parameter: Array, half: Array) -> tuple[Array, Array]:
        """Boxes that cover the curve, see `SelfMotion.boxes` and `redundant_boxes`."""
        return CurveStack.of([self]).boxes(np.zeros(len(parameter), dtype=np.intp), parameter, half)


def members(curves: Sequence[RedundantCurve], parameters: Sequence[Array]) -> list[Array]:
    """Configurations (n, 7) [rad] of each curve of one pose at its parameters (n,)."""
    counts, stack = [len(at) for at in parameters], CurveStack.of(curves)
    rows, last = np.repeat(np.arange(len(curves)), counts), np.cumsum(counts).tolist()
    q = stack.pose.configurations(
        stack.last_angle(np.concatenate(parameters), rows), stack.signs[rows]
    )
    return [q[end - count : end] for count, end in zip(counts, last, strict=True)]


def cut_to_limits(
    curves: Sequence[RedundantCurve], q_min: Array, q_max: Array
) -> tuple[list[RedundantCurve], list[RedundantCurve]]:
    """Curves of one pose, cut to the limits.

    Each curve must be given with both shoulders. Parts that are left out are proven by their boxes
    to be outside. The arcs extend beyond the limits by some hundredths of a radian.

    Args:
        curves: curves of one pose.
        q_min: lower limits, shape (7,) [rad].
        q_max: upper limits, shape (7,) [rad].

    Returns:
        The curves that may be within the limits, cut to arcs that hold every member inside; and the
        given curves that may pass the shoulder's singularity within the limits.
    """
    if not curves:
        return [], []
    owner = np.array(
        [[k for k, curve in enumerate(curves) if curve.signs[0] * side > 0] for side in (1.0, -1.0)]
    )
    right = CurveStack.of([curves[k] for k in owner[0]])
    kept, passing = _kept(
        right, np.array([curves[k].arcs[0] for k in owner[0]]), _LimitRanges.of(q_min, q_max)
    )
    found: list[list[tuple[float, float]]] = [[] for _ in curves]
    for k, arc in zip(owner.ravel()[kept[0]].tolist(), kept[1], strict=True):
        found[k].append(arc)
    cut = [
        RedundantCurve(curve.pose, curve.signs, curve.interval, curve.label, own)
        for curve, own in zip(curves, found, strict=True)
        if own
    ]
    return cut, [curves[k] for k in sorted(owner[passing].tolist())]


def _kept(
    curves: CurveStack, arcs: Array, limits: _LimitRanges
) -> tuple[tuple[Rows, list[tuple[float, float]]], Mask]:
    """Parts of curves on the right shoulder, and of their counterparts on the left one, that may be
    within limits.

    Args:
        curves: m curves on the right shoulder.
        arcs: arc of each, shape (m, 2).
        limits: position limits.

    Returns:
        Rows (k,) of the 2 m curves and k arcs; and a mask (2, m) of the curves that may pass the
        shoulder's singularity within the limits.
    """
    m, (coarse, fine) = len(arcs), (SETTINGS.coarse_parts, SETTINGS.fine_parts)
    whole, ends = _cut(arcs, coarse), np.empty((m, coarse * fine + 1))
    ends[:, :-1] = _cut(np.stack([whole[:, :-1], whole[:, 1:]], axis=2).reshape(-1, 2), fine)[
        :, :-1
    ].reshape(m, -1)
    ends[:, -1] = arcs[:, 1]
    q7 = curves.last_angle(ends.T, np.arange(m)).T
    signs = curves.signs[np.arange(m).repeat(coarse)]
    cells = Cells(q7[:, :-fine:fine].ravel(), q7[:, fine::fine].ravel(), signs)
    held, inside, aligned = _judged(curves.pose, cells, limits)
    decided = held & inside
    passing: Mask = np.logical_or.reduce((decided & aligned).reshape(2, m, coarse), axis=2)
    # Fine parts of each coarse part that may be within the limits.
    parts = np.empty((2, m * coarse, fine), dtype=bool)
    parts[:] = decided[:, :, None]
    open_ = held > inside
    (left,) = (open_[0] | open_[1]).nonzero()
    if len(left):
        low, high = q7[:, :-1].reshape(-1, fine)[left], q7[:, 1:].reshape(-1, fine)[left]
        held, _, aligned = _judged(
            curves.pose, Cells(low.ravel(), high.ravel(), signs[left.repeat(fine)]), limits
        )
        held = held.reshape(2, -1, fine) & open_[:, left, None]
        parts[:, left] |= held
        side, row = np.logical_or.reduce(held & aligned.reshape(-1, fine), axis=2).nonzero()
        passing[side, left[row] // coarse] = True
    # An arc starts at a change of the mask, and ends at the next one.
    padded = np.zeros((2 * m, coarse * fine + 2), dtype=bool)
    padded[:, 1:-1] = parts.reshape(2 * m, -1)
    row, at = (padded[:, 1:] != padded[:, :-1]).nonzero()
    bounds = ends[row % m, at].tolist()
    return (row[::2], list(zip(bounds[::2], bounds[1::2], strict=True))), passing


def _cut(arcs: Array, count: int) -> Array:
    """Ends (m, count + 1) of equal parts of arcs (m, 2)."""
    ends = arcs[:, :1] + (arcs[:, 1:] - arcs[:, :1]) / count * np.arange(count + 1)
    ends[:, -1] = arcs[:, 1]
    return np.asarray(ends)


@dataclass(frozen=True, eq=False)
class CurveStack:
    """Curves of one pose, stacked for evaluation together.

    `interval` (2, m) [rad] are the intervals of q7, `whole` (m,) marks whole turns, `signs` (m, 3)
    are those of the branches.
    """

    pose: RedundantPose
    interval: Array
    whole: Mask
    signs: Array

    @classmethod
    def of(cls, curves: Sequence[RedundantCurve]) -> CurveStack:
        """Stack of curves of one pose."""
        return cls(
            curves[0].pose,
            np.array([curve.interval for curve in curves]).T,
            np.array([curve.whole for curve in curves]),
            np.array([curve.signs for curve in curves]),
        )

    def last_angle(self, u: Array, rows: Rows) -> Array:
        """Last angles q7 (…, n) [rad] at parameters u (…, n) of the curves in rows (n,)."""
        return last_angle(u, self.interval[:, rows], self.whole[rows])

    def boxes(self, rows: Rows, parameter: Array, half: Array) -> tuple[Array, Array]:
        """Boxes as of `SelfMotion.boxes`, each of the curve in its row (n,)."""
        ends = np.array([parameter - half, parameter + half])
        ends = np.where(self.whole[rows], ends, np.clip(ends, 0.0, np.pi))
        low, high = self.last_angle(ends, rows)
        return boxes_of(self.pose, Cells(low, high, self.signs[rows]))


@dataclass(frozen=True, eq=False)
class _LimitRanges:
    """Middles (10, 1) and half widths (10, 1) [rad] of the limits of the seven joints, then again
    of the first three.

    A joint that may turn all around has an infinite half width.
    """

    middle: Array
    width: Array

    @classmethod
    def of(cls, q_min: Array, q_max: Array) -> _LimitRanges:
        """Ranges of limits (7,) [rad]."""
        joints = [*range(7), 0, 1, 2]
        middle = (q_min + q_max)[joints, None] / 2
        width = (q_max - q_min)[joints, None] / 2 + SETTINGS.rounding
        width[width >= np.pi] = np.inf
        return cls(middle, width)


def _judged(pose: RedundantPose, cells: Cells, limits: _LimitRanges) -> tuple[Mask, Mask, Mask]:
    """Decides which cells with the right shoulder, and their counterparts with the left one, are
    within limits.

    Returns:
        Masks (2, n), right shoulder first, of the cells that may have members within the limits,
        and of the cells with all members inside; and a mask (n,) of the cells that may pass the
        shoulder's singularity.
    """
    right, half = boxes_of(pose, cells)
    q, sides = np.empty((10, len(half))), np.empty((2, 10, len(half)))
    # With the other shoulder the third axis leans to the other side, and the last four joints are
    # the same.
    q[:7], q[7:] = right.T, right.T[:3]
    q[7:10:2] += np.pi
    q[8] = -q[8] - 2 * pose.form.lean_at_zero
    sides[0, :7], sides[0, 7:] = half.T, half.T[:3]
    np.negative(sides[0], out=sides[1])
    beyond = np.abs(wrapped(q - limits.middle)) - limits.width
    within = beyond <= sides
    last = np.logical_and.reduce(within[:, 3:7], axis=1)
    first, mirrored = (last & np.logical_and.reduce(within[:, k : k + 3], axis=1) for k in (0, 7))
    return (
        np.array([first[0], mirrored[0]]),
        np.array([first[1], mirrored[1]]),
        np.asarray(half[:, 0] >= np.pi),
    )


def last_angle(u: Array, interval: Array, whole: Mask) -> Array:
    """Last angles q7 (…, n) [rad] at parameters u (…, n) of curves over intervals (2,) or (2, n)
    [rad].
    """
    a, b = interval
    return np.where(whole, u, (a + b) / 2 - (b - a) / 2 * np.cos(u))
