"""Self-motions of an arm of the form `SphericalShoulder` over the last angle.

A curve is one branch over one interval of the last angle. At an end of the interval two branches
meet, and the angles change with the square root of the distance from the end. With q7 = middle -
half cos u, they change evenly with the parameter u.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.angles import nearest_turn, wrapped
from joulepath.optimizer.kinematics.self_motion import nearest_on_arcs
from joulepath.optimizer.kinematics.seven.redundant_boxes import Cells, boxes_of
from joulepath.optimizer.kinematics.seven.redundant_pose import RedundantPose
from joulepath.optimizer.problem.branches import Label


@dataclass(frozen=True)
class RedundantCurveSettings:
    """Settings of cutting curves to limits and of finding members."""

    parts: int = 320
    """Number of parts of a curve that are tested against the limits."""
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
        return nearest_on_arcs(parameter, self.arcs, self.whole)

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

    Parts that are left out are proven by their boxes to be outside. The arcs extend beyond the
    limits by some hundredths of a radian.

    Args:
        curves: whole curves of one pose.
        q_min: lower limits, shape (7,) [rad].
        q_max: upper limits, shape (7,) [rad].

    Returns:
        The curves that may be within the limits, cut to arcs that hold every member inside; and the
        given curves that may pass the shoulder's singularity within the limits.
    """
    if not curves:
        return [], []
    stack, m, parts = CurveStack.of(curves), len(curves), SETTINGS.parts
    low, high = np.array([curve.arcs[0] for curve in curves]).T
    ends = np.linspace(low, high, parts + 1, axis=1)
    q7 = stack.last_angle(ends.T, np.arange(m)).T
    signs = stack.signs.repeat(parts, axis=0)
    centre, half = boxes_of(stack.pose, Cells(q7[:, :-1].ravel(), q7[:, 1:].ravel(), signs))
    width = (q_max - q_min) / 2 + SETTINGS.rounding
    beyond = np.abs(wrapped(centre - (q_min + q_max) / 2)) - np.where(width < np.pi, width, np.inf)
    inside = (beyond <= half).all(axis=1).reshape(m, parts)
    passing = (inside & (half[:, 0] >= np.pi).reshape(m, parts)).any(axis=1)
    # An arc starts at a change of the mask, and ends at the next one.
    changes = np.diff(inside, axis=1, prepend=False, append=False)
    cut = list[RedundantCurve]()
    for curve, own, changing in zip(curves, ends, changes, strict=True):
        bounds = own[changing].tolist()
        arcs = list(zip(bounds[::2], bounds[1::2], strict=True))
        if arcs:
            cut.append(replace(curve, arcs=arcs))
    return cut, [curves[k] for k in np.flatnonzero(passing).tolist()]


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


def last_angle(u: Array, interval: Array, whole: Mask) -> Array:
    """Last angles q7 (…, n) [rad] at parameters u (…, n) of curves over intervals (2,) or (2, n)
    [rad].
    """
    a, b = interval
    return np.where(whole, u, (a + b) / 2 - (b - a) / 2 * np.cos(u))
