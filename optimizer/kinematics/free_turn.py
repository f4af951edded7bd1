"""Self-motions of an arm of the form `SphericalShoulder` on which the last angle stands still, at two singularities.

Where the third axis is in line with the first, both turn against each other. Where the fifth axis meets the shoulder,
as with an LBR iiwa that is stretched, it turns against the first three. Such a motion crosses the curves over the last
angle (`redundant_curve`), or is all that is left of them. A pose has one only by chance, or if somebody asks for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from models.robot import Array
from optimizer.kinematics.angles import wrapped
from optimizer.kinematics.redundant_boxes import with_shoulder
from optimizer.kinematics.redundant_curve import RedundantCurve
from optimizer.kinematics.redundant_pose import RedundantPose
from optimizer.problem.branches import Label

# sine of the angle between first and third axis, and error [m] of the distance from shoulder to wrist, below which a
# pose is on the singularity: every member reaches it to a part of what is promised of a solution
IN_LINE, STRETCHED = 1e-10, 1e-10
# points of a curve from which a crossing is sought, steps of the search, the difference of parameters in it, and how
# many steps it has before it is given up, if one leaves more than a ratio of the lean
POINTS, STEPS, STEP, FIRST_STEPS, SLOW = 32, 20, 1e-6, 3, 0.7
# rounding of a box [rad]; and half the width of the loops on which an arm that is stretched to within STRETCHED, but
# not quite, holds a pose: its elbow is bent by up to 4e-5, and rounding of the pose hides the loops
ROUNDING, LOOPS = 1e-8, 2e-4


@dataclass(frozen=True, eq=False)
class FreeTurn:
    """`SelfMotion` with the angle of `joint`, the first (0) or the fifth (4), as parameter; `angles` are q7, θ, ψ."""

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
        centre, sides = self.at(parameter), np.full((len(parameter), 7), LOOPS if self.joint == 4 else ROUNDING)
        sides[:, self.joint] += half
        if self.joint == 4:
            return centre, with_shoulder(self.pose, centre, sides)
        sides[:, 2] += half
        return centre, sides


def stretched(pose: RedundantPose, label: Label) -> list[FreeTurn]:
    """The motions with the fifth axis through the shoulder, of an arm whose fifth axis is square to the sixth."""
    found = []
    height = pose.waves[1]
    size, phase = float(np.hypot(height[1], height[2])), float(np.arctan2(height[2], height[1]))
    if abs(pose.form.fifth_in_6[2]) > STRETCHED or size < abs(height[0]):
        return []
    spread = float(np.arccos(-height[0] / size)) if size > 0 else 0.0
    for theta in pose.form.aligned:
        S = pose.form.shoulder_about_fifth(np.array([theta]))[0]
        for q7 in (phase + spread, phase - spread):
            v = pose.from_wrist(np.array([q7]))[0]
            if abs(float(np.linalg.norm(v)) - abs(float(S[2]))) < STRETCHED:
                psi = 0.0 if S[2] > 0 else np.pi
                found += [FreeTurn(pose, (q7, theta, psi), side, 4, label) for side in (1.0, -1.0)]
    return found


def crossing(curves: Sequence[RedundantCurve]) -> list[FreeTurn]:
    """The motions with the third axis in line with the first, where these whole curves of one pose pass that
    singularity.

    A pass may be overlooked next to an end of a curve, where the lean hardly changes (1 of 300 poses drawn on the
    singularity). The boxes of the curves hold its configurations all the same, so that bounds cover them.
    """
    # those of the other shoulder pass it at the same points
    curves = [curve for curve in curves if curve.sheet[0] > 0]
    if not curves:
        return []
    pose = curves[0].pose
    lower, upper = np.array([curve.arcs[0] for curve in curves]).T
    u = lower[:, None] + (upper - lower)[:, None] * (np.arange(POINTS) + 0.5) / POINTS
    q7 = np.array([curve.last_angle(each) for curve, each in zip(curves, u, strict=True)])
    sheet = np.repeat([curve.sheet for curve in curves], POINTS, axis=0)
    lean = _lean(pose, pose.configurations(q7.ravel(), sheet)).reshape(u.shape)
    size, step = np.abs(lean), np.abs(np.diff(lean, axis=1))
    reach = 2 * np.maximum(np.pad(step, ((0, 0), (0, 1)), "edge"), np.pad(step, ((0, 0), (1, 0)), "edge"))
    beside = np.pad(size, ((0, 0), (1, 1)), constant_values=np.inf)
    found = []
    for row, k in np.argwhere((size <= reach) & (size <= beside[:, :-2]) & (size <= beside[:, 2:])).tolist():
        curve = curves[row]
        at = _zero(curve, float(u[row, k]))
        if at is not None:
            last = curve.last_angle(np.array([at]))
            theta, psi = pose.angles(last, curve.sheet[1:2], curve.sheet[2:3])
            found.append(FreeTurn(pose, (float(last[0]), float(theta[0]), float(psi[0])), 1.0, 0, curve.label))
    return found


def _lean(pose: RedundantPose, q: Array) -> NDArray[np.complex128]:
    """How the third axis leans (n,) from the first at q (n, 7), its two components as a complex number."""
    return np.asarray(np.sin(pose.form.lean(q[:, 1])) * np.exp(1j * q[:, 0]))


def _zero(curve: RedundantCurve, u: float) -> float | None:
    """The parameter next to u at which the third axis is in line, by Gauss and Newton; None if there is none."""
    (lower, upper), best = curve.arcs[0], np.inf
    for n in range(STEPS):
        before, here, after = _lean(curve.pose, curve.at(np.array([u - STEP, u, u + STEP])))
        if abs(here) < IN_LINE:
            return u
        slope = (after - before) / (2 * STEP)
        # next to a zero the steps converge quadratically; elsewhere they end where the lean is least
        if abs(slope) == 0 or (n > FIRST_STEPS and abs(here) > SLOW * best):
            return None
        best = abs(here)
        u = float(np.clip(u - (np.conj(slope) * here).real / abs(slope) ** 2, lower, upper))
    return None
