"""Geometry of arms of Universal Robots' form: parallel inner axes, offset wrist axes.

In some convention, the arm has the standard Denavit-Hartenberg table

    a     = [a1, a2, a3, a4, 0, 0]
    d     = [d1, 0, 0, d4, d5, d6]
    alpha = [pi/2, 0, 0, pi/2, -pi/2, 0]

The second, third and fourth axes are parallel, the others at right angles to the one before, and
the fifth meets the sixth. `table_lengths` finds the lengths whatever convention the file uses.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan2, cos, hypot, pi, sin, sqrt
from typing import Any, Self

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.joint_axes import JointAxes
from joulepath.optimizer.kinematics.reach import REACH
from joulepath.optimizer.kinematics.six.drawing import Drawing, without_rounding
from joulepath.optimizer.kinematics.six.table_lengths import drawn_lengths
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
    """Signed lengths [m] of the table above, and the names of the branches.

    `d5` is the distance of the sixth axis from the fourth in the arm's plane, `tilt` [rad] the
    angle of this line from the fifth axis, and `drawing` the convention of the file. `a2` and `a3`
    are negative, `d4`, `d5` and `d6` not: every drawing of an arm has the same lengths, and its
    branches the same names.
    """

    d1: float
    a1: float
    a2: float
    a3: float
    d4: float
    d5: float
    d6: float
    tilt: float
    drawing: Drawing

    @classmethod
    def of(cls, model: pin.Model, tolerance: float = UR.table_tolerance) -> Self | None:
        """Geometry of a Pinocchio model with a frame `flange`; None if the table does not
        describe the model in any convention.

        Args:
            model: Pinocchio model.
            tolerance: largest difference [m, 1] between the poses of table and model. With more
                than rounding, the geometry names the branches of an arm with deviations, such as a
                calibrated one.
        """
        if model.nq != 6:
            return None
        chain = Chain.of(model)
        lengths = drawn_lengths(JointAxes.of(chain))
        if lengths is None:
            return None
        form = cls(**vars(lengths))
        form = replace(form, drawing=form._with_flange(chain))
        return form if form._describes(chain, tolerance) else None

    def _with_flange(self, chain: Chain) -> Drawing:
        """The drawing with the flange frame of the table."""
        drawing, q = self.drawing, np.zeros(6)
        T = drawing.T_form_base @ chain.flange(q[None])[0]
        T_flange_form = without_rounding(np.linalg.inv(T) @ self._forward(drawing.form(q)))
        return replace(drawing, T_flange_form=T_flange_form)

    def _describes(self, chain: Chain, tolerance: float) -> bool:
        """Whether the table gives the forward kinematics of the chain, at configurations in general
        position.
        """
        q = np.random.default_rng(0).uniform(-pi, pi, (4, 6))
        table = np.array([self._forward(each) for each in self.drawing.form(q)])
        return bool(np.abs(self.drawing.pose(chain.flange(q)) - table).max() <= tolerance)

    def _forward(self, q: Array) -> Array:
        a4, d5 = self.d5 * sin(self.tilt), self.d5 * cos(self.tilt)
        a, d = (self.a1, self.a2, self.a3, a4, 0, 0), (self.d1, 0, 0, self.d4, d5, self.d6)
        T = np.eye(4)
        twists = (0, 1), (1, 0), (1, 0), (0, 1), (0, -1), (1, 0)  # cos and sin of alpha
        tilts = 0.0, 0.0, 0.0, self.tilt, 0.0, 0.0
        for theta, length, offset, (ca, sa) in zip(q - tilts, a, d, twists, strict=True):
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

    def tilted(self, along: Any, above: Any) -> tuple[Any, Any]:
        """Direction in the arm's plane from the fourth axis to the sixth, for that of the fifth
        axis.
        """
        c, s = cos(self.tilt), sin(self.tilt)
        return c * along - s * above, c * above + s * along

    @property
    def reach(self) -> tuple[float, float]:
        """Smallest and largest distance [m] from the second axis to the fourth."""
        return abs(abs(self.a2) - abs(self.a3)), abs(self.a2) + abs(self.a3)

    def label(self, q: Array) -> Label:
        """Branch of a configuration (6,) [rad]; at a singularity, one of the meeting branches."""
        q = self.drawing.form(q)
        return self.label_of(self._ahead(q), sin(q[2]), sin(q[4]))

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """Singular parts of the label at a configuration (6,) [rad].

        A part is singular if a pose rounded to double precision may have changed it: within
        `singular` of the singularity. The angle of an elbow near its edge is √(2 · excess over the
        reach · reach / (a2 a3)). Next to a stretched wrist the excess grows, since the fourth axis
        moves with the uncertain heading.
        """
        q = self.drawing.form(q)
        ahead, sin_elbow, sin_wrist = abs(self._ahead(q)), abs(sin(q[2])), abs(sin(q[4]))
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
        return self._ahead(self.drawing.form(q))

    def _ahead(self, q: Array) -> float:
        links = self.a2 * cos(q[1]) + self.a3 * cos(q[1] + q[2])
        return self.a1 + links + self.d5 * sin(q[1] + q[2] + q[3])

    def label_of(self, ahead: float, sin_elbow: float, sin_wrist: float) -> Label:
        """Label from the distance [m] of the last axis' origin ahead of the first axis, and from
        the sines of the third and fifth angles.
        """
        return Label(
            shoulder="left" if ahead < 0 else "right",
            elbow="up" if ahead * sin_elbow < 0 else "down",
            wrist="no_flip" if sin_wrist < 0 else "flip",
        )

    def shoulders(self, T: Array) -> list[tuple[float, float]]:
        """First angles [rad] of the table's flange pose T (4, 4), each with the distance [m] of the
        last axis' origin ahead of the first axis.
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
