"""Branches of an arm with an ortho-parallel base and a spherical wrist, the form of most industrial
arms.

The second axis is perpendicular to the first, the third parallel to the second. The last three axes
meet in one point, the wrist, each perpendicular to the next one at some position. The arm's plane
is perpendicular to the second axis.

The names of the branches need few lengths in this plane: M. Brandstötter, A. Angerer, M. Hofbaur,
"An analytical solution of the inverse kinematics problem of industrial serial manipulators with an
ortho-parallel basis and a spherical wrist" (2014).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import atan2, hypot, sqrt
from typing import get_args

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.joint_axes import AXES, JointAxes, meeting_point, upward
from joulepath.optimizer.kinematics.reach import REACH
from joulepath.optimizer.problem.branches import Elbow, Label, Shoulder, Wrist


@dataclass(frozen=True)
class SphericalWristSettings:
    """Thresholds of singular configurations."""

    aligned: float = 5e-10
    """Sine of the wrist angle, or distance [m], below which the wrist counts as aligned: every
    member of its self-motion then reaches the pose to half the promised accuracy.
    """
    singular: float = 1e-6
    """Sine, or distance of the shoulder [m], below which a part of the label is singular: closer to
    it, a pose rounded to double precision no longer determines the joints to 1e-9 rad.
    """


SPHERICAL_WRIST = SphericalWristSettings()


# All branches, in the order of their names.
LABELS = tuple(
    Label(*parts)
    for parts in product(*(sorted(get_args(part)) for part in (Shoulder, Elbow, Wrist)))
)


def branch_numbers(measures: Array) -> Array:
    """Branches (...), as indices of LABELS, from `SphericalWrist.measures` (..., 3)."""
    ahead, elbow, wrist = measures[..., 0], measures[..., 1], measures[..., 2]
    return np.asarray(4 * (ahead >= 0) + 2 * (ahead * elbow < 0) + (wrist < 0))


@dataclass(frozen=True, eq=False)
class SphericalWrist:
    """Geometry of the singularities, where the parts of the label change.

    Lengths are in the arm's plane, forward and up of the first axis.
    """

    shoulder: Array
    """Position (2,) of the second axis [m]."""
    upper: tuple[float, float]
    """Length [m] and, at zero, angle [rad] of the link from the second axis to the third."""
    fore: tuple[float, float]
    """Length [m] and, at zero, angle [rad] of the link from the third axis to the wrist."""
    turns: tuple[float, float]
    """Factors of q2 and q3 in the angles of the links, 1 or -1."""
    offset: float
    """Distance of the wrist's plane from the first axis [m]."""
    bend: float
    """Wrist angle at q5 = 0 [rad]."""
    up: Array
    """Direction (3,) of the first axis."""
    forward: Array
    """Direction (3,) ahead of the first axis in the arm's plane, at zero."""
    origin: Array
    """Point (3,) on the first axis [m]."""
    wrist: Array
    """Position (3,) of the wrist in the flange frame [m]."""
    last_axis: Array
    """Direction (3,) of the last axis in the flange frame."""

    @classmethod
    def of(cls, axes: JointAxes) -> SphericalWrist | None:
        """Geometry of an arm with these axes; None for an arm of another form."""
        z, p = axes.directions, axes.points
        if len(z) != 6:
            return None
        wrist, distance = meeting_point(z[3:], p[3:])
        square = all(abs(z[i] @ z[j]) < AXES.parallel for i, j in ((0, 1), (3, 4), (4, 5)))
        if (
            distance > AXES.meeting
            or not square
            or np.linalg.norm(np.cross(z[1], z[2])) > AXES.parallel
        ):
            return None
        up = upward(z[0])
        forward = np.cross(z[1], up)
        reach = float((p[1] - p[0]) @ forward)
        if reach < 0 or (reach == 0 and (wrist - p[0]) @ forward < 0):
            forward = -forward
        plane = np.stack([forward, up])
        normal = np.cross(forward, up)
        upper, fore = plane @ (p[2] - p[1]), plane @ (wrist - p[2])
        return cls(
            shoulder=plane @ (p[1] - p[0]),
            upper=(hypot(*upper), atan2(upper[1], upper[0])),
            fore=(hypot(*fore), atan2(fore[1], fore[0])),
            turns=(float(np.sign(normal @ z[1])), float(np.sign(normal @ z[2]))),
            offset=float((wrist - p[0]) @ normal),
            bend=atan2(float(np.cross(z[3], z[5]) @ z[4]), float(z[3] @ z[5])),
            up=up,
            forward=forward,
            origin=p[0],
            wrist=axes.T_zero[:3, :3].T @ (wrist - axes.T_zero[:3, 3]),
            last_axis=axes.T_zero[:3, :3].T @ z[5],
        )

    def label(self, q: Array) -> Label:
        """Branch of a configuration (6,) [rad]; at a singularity, one of the meeting branches."""
        return LABELS[int(branch_numbers(self.measures(q)))]

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """Singular parts of the label at a configuration (6,) [rad]."""
        measures = zip(("shoulder", "elbow", "wrist"), self.measures(q), strict=True)
        return tuple(part for part, value in measures if abs(value) < SPHERICAL_WRIST.singular)

    def measures(self, q: Array) -> Array:
        """Distances from the three singularities, (..., 3), at q (..., 6) [rad].

        They are the distance of the wrist ahead of the first axis [m], and the sines of the elbow
        and wrist angles. Each is zero at the singularity that changes its part of the label.
        """
        lift = self.turns[0] * q[..., 1]
        first, second = self.upper[1] + lift, self.fore[1] + lift + self.turns[1] * q[..., 2]
        found = np.empty((*q.shape[:-1], 3))
        found[..., 0] = (
            self.shoulder[0] + self.upper[0] * np.cos(first) + self.fore[0] * np.cos(second)
        )
        found[..., 1] = np.sin(second - first)
        found[..., 2] = np.sin(self.bend + q[..., 4])
        return found

    def bent(self, sine: float, aligned: bool) -> Array:
        """Positions of the fifth joint for the sine of a wrist angle.

        Args:
            sine: sine of the wrist angle, at least 0.
            aligned: whether the wrist is near alignment, with both axes in the same direction;
                otherwise it is near folding.

        Returns:
            Two positions (2,) [rad], or one (1,) if the sine is zero.
        """
        angles = [
            atan2(side, 1.0 if aligned else -1.0)
            for side in ((sine, -sine) if sine > 0 else (0.0,))
        ]
        return np.asarray(wrapped(np.array(angles) - self.bend))

    def distance_to_reach(self, T: Array) -> float | None:
        """Distance [m] by which the wrist is out of reach at the flange pose T (4, 4); None for an
        arm with an offset.

        The orientation does not matter. In the arm's plane the wrist can be anywhere between two
        circles about the second axis, ahead of the first axis or behind it.
        """
        if abs(self.offset) > SPHERICAL_WRIST.aligned:
            return None
        radius, height = self._wrist_at(T)
        least, most = abs(self.upper[0] - self.fore[0]), self.upper[0] + self.fore[0]
        distances = [
            hypot(side - self.shoulder[0], height - self.shoulder[1]) for side in (radius, -radius)
        ]
        return min(max(0.0, least - distance, distance - most) for distance in distances)

    def turns_freely(self, T: Array) -> bool:
        """Whether the first or the second axis may turn at the flange pose T (4, 4), because the
        wrist lies on it.

        The wrist then compensates the turn. Of an arm with an offset, only the second axis can.
        """
        radius, height = self._wrist_at(T)
        ahead = sqrt(max(radius**2 - self.offset**2, 0.0))
        on_second = (
            min(
                hypot(side - self.shoulder[0], height - self.shoulder[1])
                for side in (ahead, -ahead)
            )
            < SPHERICAL_WRIST.aligned
        )
        if on_second and abs(self.upper[0] - self.fore[0]) < SPHERICAL_WRIST.aligned:
            return True
        distance = self.distance_to_reach(T)
        return (
            radius < SPHERICAL_WRIST.aligned and distance is not None and distance <= REACH.rounding
        )

    def _wrist_at(self, T: Array) -> tuple[float, float]:
        """Distance from the first axis and height along it [m] of the wrist at the flange pose T
        (4, 4).
        """
        away = T[:3, :3] @ self.wrist + T[:3, 3] - self.origin
        height = float(away @ self.up)
        x, y, z = (away - height * self.up).tolist()
        return sqrt(x * x + y * y + z * z), height
