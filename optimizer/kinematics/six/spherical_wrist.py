"""The branches of an arm with a spherical wrist whose base is ortho-parallel, as most industrial
arms are.

The second axis is at right angles to the first, the third parallel to the second. The last three
meet in one point, the wrist, each at right angles to the next at some position. The arm's plane is
at right angles to the second axis.

The names of such arms' branches need few lengths of this plane: M. Brandstötter, A. Angerer, M.
Hofbaur, "An analytical solution of the inverse kinematics problem of industrial serial manipulators
with an ortho-parallel basis and a spherical wrist" (2014).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import atan2, hypot, sqrt
from typing import get_args

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.joint_axes import MEETING, PARALLEL, JointAxes, meeting_point
from joulepath.optimizer.problem.branches import Elbow, Label, Shoulder, Wrist

# sine of the wrist angle below which the wrist counts as aligned: then every member of its
# self-motion reaches the pose to half of what is promised of a solution
ALIGNED = 5e-10
# distance [m] beyond the reach at which a pose may lie by rounding alone
ROUNDING = 1e-10
# a part of the label is singular where its sine, or the shoulder's distance [m], is below this:
# nearer to it, a pose that is rounded to double precision no longer determines the joints to 1e-9
# rad
SINGULAR = 1e-6


# all branches, in the order of their names
LABELS = tuple(
    Label(*parts)
    for parts in product(*(sorted(get_args(part)) for part in (Shoulder, Elbow, Wrist)))
)


def branch_numbers(measures: Array) -> Array:
    """The branches (...), as indices of LABELS, with these `SphericalWrist.measures` (..., 3)."""
    ahead, elbow, wrist = measures[..., 0], measures[..., 1], measures[..., 2]
    return np.asarray(4 * (ahead >= 0) + 2 * (ahead * elbow < 0) + (wrist < 0))


@dataclass(frozen=True, eq=False)
class SphericalWrist:
    """Where the parts of the label change.

    In the arm's plane, forward and up of the first axis: `shoulder` (2,) [m] the second axis,
    `upper` and `fore` the length [m] and, at zero, angle [rad] of the links from second to third
    axis and from there to the wrist. These turn with `turns` (2,) times q2 and q3. `offset` [m] is
    the distance of the wrist's plane from the first axis, `bend` [rad] the wrist angle at q5 = 0.
    `up` and `origin` (3,) are direction and point of the first axis, `wrist` (3,) the wrist in the
    flange frame.
    """

    shoulder: Array
    upper: tuple[float, float]
    fore: tuple[float, float]
    turns: tuple[float, float]
    offset: float
    bend: float
    up: Array
    origin: Array
    wrist: Array
    last_axis: Array

    @classmethod
    def of(cls, axes: JointAxes) -> SphericalWrist | None:
        """The geometry of an arm's axes; None for an arm of another kind."""
        z, p = axes.directions, axes.points
        if len(z) != 6:
            return None
        wrist, distance = meeting_point(z[3:], p[3:])
        square = all(abs(z[i] @ z[j]) < PARALLEL for i, j in ((0, 1), (3, 4), (4, 5)))
        if distance > MEETING or not square or np.linalg.norm(np.cross(z[1], z[2])) > PARALLEL:
            return None
        # away from the ground, if the first axis is upright
        up = z[0] * (-1.0 if z[0][2] < -0.5 else 1.0)
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
            origin=p[0],
            wrist=axes.T_zero[:3, :3].T @ (wrist - axes.T_zero[:3, 3]),
            last_axis=axes.T_zero[:3, :3].T @ z[5],
        )

    def label(self, q: Array) -> Label:
        """The branch of a configuration (6,) [rad]; on a singularity, one of those that meet
        there."""
        return LABELS[int(branch_numbers(self.measures(q)))]

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """The parts of the label that are singular at a configuration (6,) [rad]."""
        measures = zip(("shoulder", "elbow", "wrist"), self.measures(q), strict=True)
        return tuple(part for part, value in measures if abs(value) < SINGULAR)

    def measures(self, q: Array) -> Array:
        """Distance [m] of the wrist ahead of the first axis, sines of elbow and wrist (..., 3), at
        q (..., 6) [rad].

        Each is zero where its part of the label changes.
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
        """The positions (2,) [rad] of the fifth joint with a wrist angle of this sine; one for no
        sine.

        They are near the `aligned` wrist, whose axes point the same way, or else near the folded
        one.
        """
        angles = [
            atan2(side, 1.0 if aligned else -1.0)
            for side in ((sine, -sine) if sine > 0 else (0.0,))
        ]
        return np.asarray(wrapped(np.array(angles) - self.bend))

    def distance_to_reach(self, T: Array) -> float | None:
        """Distance [m] by which the wrist is out of reach with the flange at T (4, 4); None for an
        arm with an offset.

        The orientation does not matter. In the arm's plane the wrist can be anywhere between two
        circles about the second axis, ahead of the first axis or behind it.
        """
        if abs(self.offset) > ALIGNED:
            return None
        radius, height = self._wrist_at(T)
        least, most = abs(self.upper[0] - self.fore[0]), self.upper[0] + self.fore[0]
        distances = [
            hypot(side - self.shoulder[0], height - self.shoulder[1]) for side in (radius, -radius)
        ]
        return min(max(0.0, least - distance, distance - most) for distance in distances)

    def turns_freely(self, T: Array) -> bool:
        """Whether the first axis, or the second, may turn with the flange at T (4, 4), because the
        wrist lies on it.

        The wrist then turns back. Of an arm with an offset no axis but the second can.
        """
        radius, height = self._wrist_at(T)
        ahead = sqrt(max(radius**2 - self.offset**2, 0.0))
        on_second = (
            min(
                hypot(side - self.shoulder[0], height - self.shoulder[1])
                for side in (ahead, -ahead)
            )
            < ALIGNED
        )
        if on_second and abs(self.upper[0] - self.fore[0]) < ALIGNED:
            return True
        distance = self.distance_to_reach(T)
        return radius < ALIGNED and distance is not None and distance <= ROUNDING

    def _wrist_at(self, T: Array) -> tuple[float, float]:
        """Distance from the first axis, and height along it [m], of the wrist with the flange at T
        (4, 4).
        """
        away = T[:3, :3] @ self.wrist + T[:3, 3] - self.origin
        height = float(away @ self.up)
        x, y, z = (away - height * self.up).tolist()
        return sqrt(x * x + y * y + z * z), height
