"""Closed-form inverse kinematics of arms of the form `SphericalShoulder`: every self-motion of a
pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import atan2, cos, sin

import numpy as np
import pinocchio as pin
from scipy.optimize import minimize

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.kinematics.seven.free_turn import FreeTurn, crossing, stretched
from joulepath.optimizer.kinematics.seven.redundant_curve import RedundantCurve, cut_to_limits
from joulepath.optimizer.kinematics.seven.redundant_pose import RedundantPose
from joulepath.optimizer.kinematics.seven.spherical_shoulder import SphericalShoulder
from joulepath.optimizer.problem.branches import Label


@dataclass(frozen=True)
class RedundantArmSettings:
    """Settings of labels and of the distance to reach."""

    singular: float = 1e-6
    """Sine of its angle below which a part of the label is singular."""
    q7_angles: int = 48
    """Number of last angles in the search for the nearest reachable position; the best one is then
    refined.
    """
    elbow_angles: int = 48
    """Number of elbow angles θ in this search."""


SETTINGS = RedundantArmSettings()


@dataclass(frozen=True, eq=False)
class RedundantArm:
    """`PoseSolver` of a redundant arm.

    Configurations are never isolated, except on a self-motion that is a single point.
    """

    form: SphericalShoulder
    complete, confirmed = True, False

    @classmethod
    def of(cls, model: pin.Model) -> RedundantArm | None:
        """Closed form of a Pinocchio model with a frame `flange`; None for an arm of another
        form.
        """
        form = SphericalShoulder.of(model)
        return None if form is None else cls(form)

    def label(self, q: Array) -> Label:
        """Branch of a configuration (7,) [rad], see `label_of`."""
        return label_of(np.where(np.sin(self._angles(q)) < 0, -1.0, 1.0))

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """Singular parts of the label at a configuration (7,) [rad]."""
        parts = zip(("shoulder", "elbow", "wrist"), self._angles(q), strict=True)
        return tuple(part for part, angle in parts if abs(sin(angle)) < SETTINGS.singular)

    def solve(self, T: Array) -> tuple[Array, list[Label]]:
        """Always empty: all configurations are on self-motions."""
        return np.zeros((0, 7)), []

    def self_motions(
        self, T: Array, limits: Limits | None = None
    ) -> Sequence[RedundantCurve | FreeTurn]:
        """All self-motions of the flange pose T (4, 4).

        The curves over the last angle come first, cut to arcs that hold every member within the
        limits, then the self-motions at singularities with a constant last angle.
        """
        pose = RedundantPose(self.form, T)
        aligned = curves = curves_of(pose)
        if limits is not None:
            curves, aligned = cut_to_limits(curves, limits.q_min, limits.q_max)
        return [*curves, *crossing(aligned), *stretched(pose, label_of(np.ones(3)))]

    def distance_to_reach(self, T: Array) -> float:
        """Shortest shift [m] of T (4, 4), at constant orientation, to a reachable pose; 0 if T is
        reachable.
        """
        pose = RedundantPose(self.form, T)
        if pose.intervals(1.0) or pose.intervals(-1.0):
            return 0.0
        q7 = np.linspace(-np.pi, np.pi, SETTINGS.q7_angles, endpoint=False)
        theta = np.linspace(-np.pi, np.pi, SETTINGS.elbow_angles, endpoint=False)
        each = [angle.ravel() for angle in np.meshgrid(q7, theta)]
        tried = self._misses(pose, *each)
        best = int(tried.argmin())
        start: Array = np.array([angle[best] for angle in each], dtype=float)

        def distance(x: Array) -> float:
            return float(self._misses(pose, x[:1], x[1:])[0])

        refined = minimize(
            distance, start, method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-12}
        )
        return float(min(refined.fun, tried[best]))

    def _misses(self, pose: RedundantPose, q7: Array, theta: Array) -> Array:
        """Distances (n,) [m] of v from the positions that the fifth axis allows, at last angles and
        elbow angles (n,) [rad].
        """
        form, v, S = self.form, pose.from_wrist(q7).T, self.form.shoulder_about_fifth(theta)
        # About the sixth axis, S lies on the ring at polar angles from (inclination - cone) to
        # (inclination + cone) of the fifth axis.
        length = np.linalg.norm(S, axis=1)
        cone = np.arctan2(np.hypot(S[:, 0], S[:, 1]), S[:, 2])
        inclined = float(np.arctan2(form.inclined, form.fifth_in_6[2]))
        least, most = np.abs(inclined - cone), np.pi - np.abs(np.pi - inclined - cone)
        polar = np.arctan2(np.hypot(v[:, 0], v[:, 1]), v[:, 2])
        nearest = np.clip(polar, least, most)
        across = np.hypot(v[:, 0], v[:, 1]) - length * np.sin(nearest)
        up = v[:, 2] - length * np.cos(nearest)
        return np.asarray(np.hypot(across, up))

    def _angles(self, q: Array) -> tuple[float, float, float]:
        """Angles χ, θ and ψ [rad] of a configuration (7,)."""
        form, harmonics = self.form, self._label_harmonics
        theta = form.q4_at_zero - float(q[3])
        ct, st, c, s = cos(theta), sin(theta), cos(q[4]), sin(q[4])
        # S turned by the fifth joint: its components along the fifth axis, across, and
        # perpendicular to both.
        x, y, z = (still + ct * cosine + st * sine for still, cosine, sine in harmonics[:3])
        along, ahead = c * x + s * y, c * y - s * x
        u, v = (a * along + b * ahead + d * z for a, b, d in harmonics[3:])
        # Azimuth of v, turned by the sixth angle, relative to the azimuth of the fifth axis.
        return form.lean_at_zero + float(q[1]), theta, atan2(v, u) - form.fifth_azimuth

    @cached_property
    def _label_harmonics(self) -> list[list[float]]:
        """Coefficients of 1, cos θ and sin θ in S about the fifth axis, three rows; then the first
        two axes of joint 6 in the frame of link 5.
        """
        return [
            *self.form.shoulder_harmonics.T.tolist(),
            *self.form.placements[5][:3, :2].T.tolist(),
        ]


def curves_of(pose: RedundantPose) -> list[RedundantCurve]:
    """All curves of a pose over the last angle."""
    return [
        RedundantCurve.of(pose, signs, interval, label_of(signs))
        for elbow in (1.0, -1.0)
        for interval in pose.intervals(elbow)
        for signs in (
            np.array([shoulder, elbow, wrist]) for shoulder, wrist in product((1.0, -1.0), repeat=2)
        )
    ]


def label_of(signs: Array) -> Label:
    """Label of a branch with signs (3,) of χ, θ and ψ.

    The shoulder is `right` if the second angle is on the positive side of its singularity, where
    the third axis is in line with the first. The elbow is `up` if θ > 0, one of the two ways to
    bend it from the position with shoulder and wrist nearest to each other. The wrist is `no_flip`
    if the shoulder, seen from the sixth axis, is on the positive side of the fifth.
    """
    return Label(
        shoulder="right" if signs[0] > 0 else "left",
        elbow="up" if signs[1] > 0 else "down",
        wrist="no_flip" if signs[2] > 0 else "flip",
    )
