"""Self-motions of an arm of the form `SphericalShoulder` at a constant last angle, at two
singularities.

With the third axis in line with the first, both turn against each other. With the fifth axis
through the shoulder, as in a stretched LBR iiwa, it turns against the first three. Such a
self-motion crosses the curves over the last angle (`redundant_curve`), or is all that is left of
them. A pose has one only by coincidence or by intention.
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


@dataclass(frozen=True)
class FreeTurnSettings:
    """Tolerances of the singularities, and settings of the search for them."""

    in_line: float = 1e-10
    """Sine of the angle between first and third axis below which they are in line: every member
    then reaches the pose to a fraction of the promised accuracy.
    """
    stretched: float = 1e-10
    """Largest error of the distance from shoulder to wrist at the other singularity [m]; also the
    largest cosine between the fifth and sixth axes.
    """
    points: int = 32
    """Number of points of a curve that start the search for a crossing."""
    steps: int = 20
    """Largest number of Gauss-Newton steps of the search."""
    difference: float = 1e-6
    """Difference of parameters for derivatives."""
    first_steps: int = 3
    """Number of steps before a slow search is given up."""
    slowest: float = 0.7
    """Ratio of consecutive leans above which a search is slow."""
    bend: float = 4.0
    """Largest distance of the lean from zero at a point next to a crossing, relative to its second
    difference.
    """
    rounding: float = 1e-8
    """Margin of boxes for rounding [rad]."""
    loop_half_width: float = 2e-4
    """Half the width of the loops on which an arm within `stretched` of the stretched position
    holds a pose [rad]: the elbow is bent by up to 4e-5 rad, and rounding of the pose hides the
    loops.
    """


SETTINGS = FreeTurnSettings()


@dataclass(frozen=True, eq=False)
class FreeTurn:
    """`SelfMotion` with the angle of `joint`, the first (0) or the fifth (4), as parameter.

    `angles` are q7, θ and ψ [rad], `side` is the sign of the shoulder.
    """

    pose: RedundantPose
    angles: tuple[float, float, float]
    side: float
    joint: Literal[0, 4]
    label: Label

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of the moving joints."""
        return (0, 2) if self.joint == 0 else (0, 1, 2, 4)

    @property
    def arcs(self) -> list[tuple[float, float]]:
        """A whole turn [rad]."""
        return [(-np.pi, np.pi)]

    def parameter(self, q: Array) -> float:
        """Angle [rad] of the joint in q (7,)."""
        return self.clipped(float(q[self.joint]))

    def clipped(self, parameter: float) -> float:
        """The parameter [rad], shifted by full turns into [-π, π]."""
        return float(wrapped(np.asarray(parameter)))

    def at(self, parameter: Array) -> Array:
        """Configurations (n, 7) [rad] at parameters (n,)."""
        u = np.asarray(parameter, dtype=float)
        q7, theta, psi, side = (np.full_like(u, each) for each in (*self.angles, self.side))
        return self.pose.at_angles(q7, theta, psi, side, {self.joint: u})

    def boxes(self, parameter: Array, half: Array) -> tuple[Array, Array]:
        """Boxes that cover the curve, see `SelfMotion.boxes`.

        If the fifth joint is free, the first three joints are bounded as in `redundant_boxes`.
        """
        centre = self.at(parameter)
        sides = np.full(
            (len(parameter), 7),
            SETTINGS.loop_half_width if self.joint == 4 else SETTINGS.rounding,
        )
        sides[:, self.joint] += half
        if self.joint == 4:
            with_shoulder(self.pose, centre.T, sides.T)
            return centre, sides
        sides[:, 2] += half
        return centre, sides


def stretched(pose: RedundantPose, label: Label) -> list[FreeTurn]:
    """Self-motions with the fifth axis through the shoulder, of an arm with a fifth axis
    perpendicular to the sixth.
    """
    found = []
    height = pose.coefficients[1]
    size, phase = float(np.hypot(height[1], height[2])), float(np.arctan2(height[2], height[1]))
    if abs(pose.form.fifth_in_6[2]) > SETTINGS.stretched or size < abs(height[0]):
        return []
    spread = float(np.arccos(-height[0] / size)) if size > 0 else 0.0
    for theta in pose.form.aligned:
        S = pose.form.shoulder_about_fifth(np.array([theta]))[0]
        for q7 in (phase + spread, phase - spread):
            v = pose.from_wrist(np.array([q7]))[:, 0]
            if abs(float(np.linalg.norm(v)) - abs(float(S[2]))) < SETTINGS.stretched:
                psi = 0.0 if S[2] > 0 else np.pi
                found += [FreeTurn(pose, (q7, theta, psi), side, 4, label) for side in (1.0, -1.0)]
    return found


def crossing(curves: Sequence[RedundantCurve]) -> list[FreeTurn]:
    """Self-motions with the third axis in line with the first, at crossings with the given curves
    of one pose.

    Crossings outside the arcs of the curves count, too. A crossing may be overlooked next to an end
    of a curve, where the lean hardly changes (1 of 300 poses drawn at the singularity). The boxes
    of the curves hold its configurations nevertheless, so bounds stay valid.
    """
    # Curves on both shoulders cross the singularity at the same points.
    different = list(
        {(curve.interval, *curve.signs[1:].tolist()): curve for curve in curves}.values()
    )
    if not different:
        return []
    stack = CurveStack.of(different)
    lower = np.where(stack.whole, -np.pi, 0.0)[:, None]
    u = lower + (np.pi - lower) * (np.arange(SETTINGS.points) + 0.5) / SETTINGS.points
    lean = _lean(stack, u.ravel(), np.repeat(np.arange(len(u)), SETTINGS.points)).reshape(u.shape)
    rows, k = np.nonzero(_may_be_zero(lean))
    found = []
    for row, at in zip(rows.tolist(), _zeros(stack, u[rows, k], rows).tolist(), strict=True):
        if np.isfinite(at):
            curve = different[row]
            last = curve.last_angle(np.array([at]))
            theta, psi = curve.pose.angles(last, curve.signs[1:2], curve.signs[2:3])
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
    """Mask (m, n) of the points along curves next to a possible zero of the lean, from the leans
    (m, n).
    """
    size, step = np.abs(lean), np.abs(lean[:, 1:] - lean[:, :-1])
    near = np.ones(lean.shape, dtype=bool)
    near[:, 1:] &= size[:, 1:] <= size[:, :-1]
    near[:, :-1] &= size[:, :-1] <= size[:, 1:]
    near[:, 1:-1] &= size[:, 1:-1] <= 2 * np.maximum(step[:, 1:], step[:, :-1])
    near[:, [0, -1]] &= size[:, [0, -1]] <= 2 * step[:, [0, -1]]
    # A zero within a step is passed at a distance that the bend of the lean explains.
    ahead, bend = lean[:, 2:] - lean[:, :-2], np.abs(lean[:, 2:] - 2 * lean[:, 1:-1] + lean[:, :-2])
    aside = np.abs((np.conj(ahead) * lean[:, 1:-1]).imag)
    near[:, 1:-1] &= aside <= SETTINGS.bend * bend * np.abs(ahead) + SETTINGS.in_line
    return np.asarray(near)


def _lean(curves: CurveStack, u: Array, rows: NDArray[np.intp]) -> NDArray[np.complex128]:
    """Lean (n,) of the third axis from the first, a complex number, at parameters u (n,) of the
    curves in rows (n,).
    """
    q7 = curves.last_angle(u, rows)
    return curves.pose.third_axis(q7, *curves.pose.angles(q7, *curves.signs[rows, 1:].T))


def _zeros(curves: CurveStack, u: Array, rows: NDArray[np.intp]) -> Array:
    """Parameters (n,) next to u (n,) with the third axis in line, by Gauss-Newton steps; nan if
    there is none.
    """
    u, found, best = u.copy(), np.full(len(u), np.nan), np.full(len(u), np.inf)
    active = np.arange(len(u))
    for n in range(SETTINGS.steps):
        if not len(active):
            break
        at, three = u[active], np.tile(rows[active], 3)
        before, here, after = _lean(
            curves, np.concatenate([at - SETTINGS.difference, at, at + SETTINGS.difference]), three
        ).reshape(3, -1)
        size, slope = np.abs(here), (after - before) / (2 * SETTINGS.difference)
        found[active[size < SETTINGS.in_line]] = at[size < SETTINGS.in_line]
        # Next to a zero the steps converge quadratically; elsewhere they end at the smallest lean.
        on = (
            (size >= SETTINGS.in_line)
            & (np.abs(slope) > 0)
            & ((n <= SETTINGS.first_steps) | (size <= SETTINGS.slowest * best[active]))
        )
        best[active], active = size, active[on]
        moved = u[active] - (np.conj(slope[on]) * here[on]).real / np.abs(slope[on]) ** 2
        u[active] = np.clip(moved, np.where(curves.whole[rows[active]], -np.pi, 0.0), np.pi)
    return found
