"""Self-motions of an arm of the form `SphericalShoulder` on which the last angle stands still, at
two singularities.

Where the third axis is in line with the first, both turn against each other. Where the fifth axis
meets the shoulder, as with an LBR iiwa that is stretched, it turns against the first three. Such a
motion crosses the curves over the last angle (`redundant_curve`), or is all that is left of them. A
pose has one only by chance, or if somebody asks for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.seven.redundant_boxes import with_shoulder
from joulepath.optimizer.kinematics.seven.redundant_curve import CurveStack, RedundantCurve
from joulepath.optimizer.kinematics.seven.redundant_pose import RedundantPose
from joulepath.optimizer.problem.branches import Label

# sine of the angle between first and third axis, and error [m] of the distance from shoulder to
# wrist, below which a pose is on the singularity: every member reaches it to a part of what is
# promised of a solution
IN_LINE, STRETCHED = 1e-10, 1e-10
# points of a curve from which a crossing is sought, steps of the search, the difference of
# parameters in it, and how many steps it has before it is given up, if one leaves more than a ratio
# of the lean
POINTS, STEPS, STEP, FIRST_STEPS, SLOW = 32, 20, 1e-6, 3, 0.7
# how far the lean may pass zero for a zero to be near, of its second difference between points
BENT = 4.0
# rounding of a box [rad]; and half the width of the loops on which an arm that is stretched to
# within STRETCHED, but not quite, holds a pose: its elbow is bent by up to 4e-5, and rounding of
# the pose hides the loops
ROUNDING, LOOPS = 1e-8, 2e-4


@dataclass(frozen=True, eq=False)
class FreeTurn:
    """`SelfMotion` with the angle of `joint`, the first (0) or the fifth (4), as parameter;
    `angles` are q7, θ, ψ.
    """

    pose: RedundantPose
    angles: tuple[float, float, float]
    side: float
    joint: Literal[0, 4]
    label: Label

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of the joints that move."""
        return (0, 2) if self.joint == 0 else (0, 1, 2, 4)

    @property
    def arcs(self) -> list[tuple[float, float]]:
        """A whole turn."""
        return [(-np.pi, np.pi)]

    def parameter(self, q: Array) -> float:
        """The angle [rad] of the joint in q (7,)."""
        return self.clipped(float(q[self.joint]))

    def clipped(self, parameter: float) -> float:
        """The parameter within half a turn of zero."""
        return float(wrapped(np.asarray(parameter)))

    def at(self, parameter: Array) -> Array:
        """The configurations (n, 7) [rad] at parameters (n,)."""
        u = np.asarray(parameter, dtype=float)
        q7, theta, psi, side = (np.full_like(u, each) for each in (*self.angles, self.side))
        return self.pose.at_angles(q7, theta, psi, side, {self.joint: u})

    def boxes(self, parameter: Array, half: Array) -> tuple[Array, Array]:
        """See `SelfMotion`. The first three joints follow the fifth as `redundant_boxes` has it."""
        centre, sides = (
            self.at(parameter),
            np.full((len(parameter), 7), LOOPS if self.joint == 4 else ROUNDING),
        )
        sides[:, self.joint] += half
        if self.joint == 4:
            with_shoulder(self.pose, centre.T, sides.T)
            return centre, sides
        sides[:, 2] += half
        return centre, sides


def stretched(pose: RedundantPose, label: Label) -> list[FreeTurn]:
    """The motions with the fifth axis through the shoulder, of an arm whose fifth axis is square to
    the sixth.
    """
    found = []
    height = pose.waves[1]
    size, phase = float(np.hypot(height[1], height[2])), float(np.arctan2(height[2], height[1]))
    if abs(pose.form.fifth_in_6[2]) > STRETCHED or size < abs(height[0]):
        return []
    spread = float(np.arccos(-height[0] / size)) if size > 0 else 0.0
    for theta in pose.form.aligned:
        S = pose.form.shoulder_about_fifth(np.array([theta]))[0]
        for q7 in (phase + spread, phase - spread):
            v = pose.from_wrist(np.array([q7]))[:, 0]
            if abs(float(np.linalg.norm(v)) - abs(float(S[2]))) < STRETCHED:
                psi = 0.0 if S[2] > 0 else np.pi
                found += [FreeTurn(pose, (q7, theta, psi), side, 4, label) for side in (1.0, -1.0)]
    return found


def crossing(curves: Sequence[RedundantCurve]) -> list[FreeTurn]:
    """The motions with the third axis in line with the first, where these curves of one pose pass
    that singularity, on their arcs or not.

    A pass may be overlooked next to an end of a curve, where the lean hardly changes (1 of 300
    poses drawn on the singularity). The boxes of the curves hold its configurations all the same,
    so that bounds cover them.
    """
    # both shoulders pass it at the same points
    different = list(
        {(curve.interval, *curve.sheet[1:].tolist()): curve for curve in curves}.values()
    )
    if not different:
        return []
    stack = CurveStack.of(different)
    lower = np.where(stack.whole, -np.pi, 0.0)[:, None]
    u = lower + (np.pi - lower) * (np.arange(POINTS) + 0.5) / POINTS
    lean = _lean(stack, u.ravel(), np.repeat(np.arange(len(u)), POINTS)).reshape(u.shape)
    rows, k = np.nonzero(_may_be_zero(lean))
    found = []
    for row, at in zip(rows.tolist(), _zeros(stack, u[rows, k], rows).tolist(), strict=True):
        if np.isfinite(at):
            curve = different[row]
            last = curve.last_angle(np.array([at]))
            theta, psi = curve.pose.angles(last, curve.sheet[1:2], curve.sheet[2:3])
            found.append(
                FreeTurn(
                    curve.pose,
                    (float(last[0]), float(theta[0]), float(psi[0])),
                    1.0,
                    0,
                    curve.label,
                )
            )
    return found


def _may_be_zero(lean: NDArray[np.complex128]) -> Mask:
    """Next to which of points along curves (m, n) the lean may be zero, by the leans there (m,
    n)."""
    size, step = np.abs(lean), np.abs(lean[:, 1:] - lean[:, :-1])
    near = np.ones(lean.shape, dtype=bool)
    near[:, 1:] &= size[:, 1:] <= size[:, :-1]
    near[:, :-1] &= size[:, :-1] <= size[:, 1:]
    near[:, 1:-1] &= size[:, 1:-1] <= 2 * np.maximum(step[:, 1:], step[:, :-1])
    near[:, [0, -1]] &= size[:, [0, -1]] <= 2 * step[:, [0, -1]]
    # a zero within a step is passed at a distance that the bend of the way explains
    ahead, bend = lean[:, 2:] - lean[:, :-2], np.abs(lean[:, 2:] - 2 * lean[:, 1:-1] + lean[:, :-2])
    aside = np.abs((np.conj(ahead) * lean[:, 1:-1]).imag)
    near[:, 1:-1] &= aside <= BENT * bend * np.abs(ahead) + IN_LINE
    return np.asarray(near)


def _lean(curves: CurveStack, u: Array, rows: NDArray[np.intp]) -> NDArray[np.complex128]:
    """The lean (n,), a complex number, of the third axis from the first at parameters u (n,) of
    curves (n,).
    """
    q7 = curves.last_angle(u, rows)
    return curves.pose.third_axis(q7, *curves.pose.angles(q7, *curves.sheet[rows, 1:].T))


def _zeros(curves: CurveStack, u: Array, rows: NDArray[np.intp]) -> Array:
    """The parameters (n,) next to u (n,) of curves (n,) at which the third axis is in line, by
    Gauss and Newton; nan if there is none."""
    u, found, best = u.copy(), np.full(len(u), np.nan), np.full(len(u), np.inf)
    going = np.arange(len(u))
    for n in range(STEPS):
        if not len(going):
            break
        at, three = u[going], np.tile(rows[going], 3)
        before, here, after = _lean(
            curves, np.concatenate([at - STEP, at, at + STEP]), three
        ).reshape(3, -1)
        size, slope = np.abs(here), (after - before) / (2 * STEP)
        found[going[size < IN_LINE]] = at[size < IN_LINE]
        # next to a zero the steps converge quadratically; elsewhere they end where the lean is
        # least
        on = (
            (size >= IN_LINE)
            & (np.abs(slope) > 0)
            & ((n <= FIRST_STEPS) | (size <= SLOW * best[going]))
        )
        best[going], going = size, going[on]
        moved = u[going] - (np.conj(slope[on]) * here[on]).real / np.abs(slope[on]) ** 2
        u[going] = np.clip(moved, np.where(curves.whole[rows[going]], -np.pi, 0.0), np.pi)
    return found
