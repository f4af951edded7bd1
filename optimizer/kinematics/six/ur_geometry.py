"""Geometry of arms of Universal Robots' form: parallel inner axes, offset wrist axes.

The arm has the standard Denavit-Hartenberg table

    a     = [0, a2, a3, 0, 0, 0]
    d     = [d1, 0, 0, d4, d5, d6]
    alpha = [pi/2, 0, 0, pi/2, -pi/2, 0]
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, pi, sin, sqrt
from typing import Self

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.reach import REACH
from joulepath.optimizer.problem.branches import Label


@dataclass(frozen=True)
class URSettings:
    """Tolerances of the closed form."""

    rounding: float = 1e-10
    """Sine of the wrist angle that is due to rounding."""
    stretched: float = 5e-10
    """Sine of the wrist angle, or distance of a folded elbow [m], below which the wrist counts as
    stretched: every member of its self-motion then reaches the pose to half the promised accuracy.
    """
    edge: float = 1e-13
    """Distance from an edge of the workspace within which the two meeting branches count as one
    [m]: the distance of a pose on the edge after rounding to double precision.
    """
    heading_error: float = 1e-14
    """Uncertainty of q2 + q3 + q4, times the sine of the wrist angle, for a pose rounded to double
    precision [rad].
    """
    least_ahead: float = 1e-5
    """Smallest distance of the wrist ahead of the first axis that divides the heading error [m];
    the first angle is uncertain, too, if the wrist is less than 1 m ahead.
    """
    newton_steps: int = 4
    """Newton steps of the fourth axis back into reach; the second one already meets the last digit,
    because the excess is small against the circle of the fourth axis.
    """
    singular: float = 1e-6
    """Sine, or distance of the shoulder [m], below which a part of the label is singular: closer to
    it, a pose rounded to double precision no longer determines the joints to 1e-9 rad.
    """
    table_tolerance: float = 1e-12
    """Largest difference of the table's forward kinematics from the model's [m, 1]."""
    shoulder_angles: int = 720
    """Number of first angles, per wrist, in the search for the nearest reachable position; the best
    one is then refined.
    """


UR = URSettings()


@dataclass(frozen=True)
class URGeometry:
    """Signed lengths [m] of the table above, and the names of the branches."""

    d1: float
    a2: float
    a3: float
    d4: float
    d5: float
    d6: float

    @classmethod
    def of(cls, model: pin.Model, tolerance: float = UR.table_tolerance) -> Self | None:
        """Geometry of a Pinocchio model with a frame `flange`; None if the table does not
        describe the model.

        Args:
            model: Pinocchio model.
            tolerance: largest difference [m, 1] between the poses of table and model. With more
                than rounding, the geometry names the branches of an arm with deviations, such as a
                calibrated one.
        """
        if model.nq != 6:
            return None
        flange, data = model.getFrameId("flange"), model.createData()
        pin.framesForwardKinematics(model, data, np.zeros(6))
        elbow, wrist_1, wrist_2 = (data.oMi[j].translation for j in (3, 4, 5))
        end = data.oMf[flange].translation
        # At zero the arm lies along x, and the second axis along -y.
        d1, d4 = float(elbow[2]), -float(wrist_2[1])
        form = cls(
            d1=d1,
            a2=float(elbow[0]),
            a3=float(wrist_1[0] - elbow[0]),
            d4=d4,
            d5=d1 - float(end[2]),
            d6=-float(end[1]) - d4,
        )
        return form if form._describes(model, data, flange, tolerance) else None

    def _describes(self, model: pin.Model, data: pin.Data, flange: int, tolerance: float) -> bool:
        """Whether the table gives the forward kinematics of the model, at configurations in general
        position.
        """
        for q in np.random.default_rng(0).uniform(-pi, pi, (4, 6)):
            pin.framesForwardKinematics(model, data, q)
            if np.abs(data.oMf[flange].homogeneous - self._forward(q)).max() > tolerance:
                return False
        return True

    def _forward(self, q: Array) -> Array:
        a, d = (0, self.a2, self.a3, 0, 0, 0), (self.d1, 0, 0, self.d4, self.d5, self.d6)
        T = np.eye(4)
        twists = (0, 1), (1, 0), (1, 0), (0, 1), (0, -1), (1, 0)  # cos and sin of alpha
        for theta, length, offset, (ca, sa) in zip(q, a, d, twists, strict=True):
            c, s = cos(theta), sin(theta)
            T = T @ np.array(
                [
                    [c, -s * ca, s * sa, length * c],
                    [s, c * ca, -c * sa, length * s],
                    [0, sa, ca, offset],
                    [0, 0, 0, 1],
                ]
            )
        return T

    @property
    def reach(self) -> tuple[float, float]:
        """Smallest and largest distance [m] from the second axis to the fourth."""
        return abs(abs(self.a2) - abs(self.a3)), abs(self.a2) + abs(self.a3)

    def label(self, q: Array) -> Label:
        """Branch of a configuration (6,) [rad]; at a singularity, one of the meeting branches."""
        return self.label_of(self.ahead(q), sin(q[2]), sin(q[4]))

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """Singular parts of the label at a configuration (6,) [rad].

        A part is singular if a pose rounded to double precision may have changed it: within
        `singular` of the singularity. The angle of an elbow near its edge is √(2 · excess over the
        reach · reach / (a2 a3)). Next to a stretched wrist the excess grows, since the fourth axis
        moves with the uncertain heading.
        """
        ahead, sin_elbow, sin_wrist = abs(self.ahead(q)), abs(sin(q[2])), abs(sin(q[4]))
        excess = abs(self.d5) * heading_uncertainty(max(sin_wrist, UR.stretched), ahead)
        elbow = sqrt(2 * excess * self.reach[1] / abs(self.a2 * self.a3))
        near = {
            "shoulder": ahead < UR.singular,
            "elbow": sin_elbow < max(UR.singular, elbow),
            "wrist": sin_wrist < UR.singular,
        }
        return tuple(part for part, singular in near.items() if singular)

    def ahead(self, q: Array) -> float:
        """Distance [m] of the last axis' origin ahead of the first axis at a configuration (6,)."""
        return self.a2 * cos(q[1]) + self.a3 * cos(q[1] + q[2]) + self.d5 * sin(q[1] + q[2] + q[3])

    def label_of(self, ahead: float, sin_elbow: float, sin_wrist: float) -> Label:
        """Label from the distance [m] of the last axis' origin ahead of the first axis, and from
        the sines of the third and fifth angles.
        """
        return Label(
            shoulder="left" if ahead * self.d4 < 0 else "right",
            elbow="up" if ahead * self.a2 * self.a3 * sin_elbow < 0 else "down",
            wrist="no_flip" if sin_wrist < 0 else "flip",
        )

    def shoulders(self, T: Array) -> list[tuple[float, float]]:
        """First angles [rad], each with the distance [m] of the last axis' origin ahead of the
        first axis.
        """
        x, y = float(T[0, 3] - self.d6 * T[0, 2]), float(T[1, 3] - self.d6 * T[1, 2])
        distance = hypot(x, y)
        if distance < abs(self.d4) - REACH.near:
            return []
        beyond = distance - abs(self.d4)
        ahead = sqrt(beyond * (distance + abs(self.d4))) if beyond > UR.edge else 0.0
        towards = atan2(y, x)
        return [
            (towards + atan2(self.d4, side), side)
            for side in ((ahead, -ahead) if ahead > 0 else (0.0,))
        ]


def heading_uncertainty(sine: float, ahead: float) -> float:
    """Uncertainty [rad] of q2 + q3 + q4 for a rounded pose.

    Args:
        sine: sine of the wrist angle.
        ahead: distance of the wrist ahead of the first axis [m].
    """
    return UR.heading_error / (sine * min(1.0, max(ahead, UR.least_ahead)))
