"""Self-motion of Universal Robots' arms with a stretched or folded wrist.

With sin(q5) = 0 the sixth axis is parallel to the second, third and fourth, and the last joint may
turn while these three keep the flange in place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.reach import REACH
from joulepath.optimizer.kinematics.self_motion import nearest_on_arcs
from joulepath.optimizer.kinematics.six.drawing import Drawing
from joulepath.optimizer.problem.branches import Label


@dataclass(frozen=True, eq=False)
class StretchedWrist:
    """Self-motion of an arm of Universal Robots' form with a stretched or folded wrist, sin(q5) =
    0.

    The parameter is the angle h = q2 + q3 + q4 of the fifth axis in the arm's plane. The fourth
    axis lies at (x, z) = (ahead - d5 sin h, above + d5 cos h) [m] in this plane, relative to the
    second. With its distance D from the second axis, the law of cosines gives q3 on the elbow's
    `side` (1 or -1) and q2. The last joint is q6 = turn (h - h0). These are joint positions of the
    closed form; the `drawing` converts them to those of the file.
    """

    label: Label
    a2: float
    a3: float
    d5: float
    ahead: float
    above: float
    q1: float
    q5: float
    h0: float
    turn: float
    side: float
    drawing: Drawing

    free = (1, 2, 3, 5)

    @property
    def arcs(self) -> list[tuple[float, float]]:
        """Arcs with the fourth axis within reach of the second: least² <= A + B cos(h - phase) <=
        most².
        """
        radius = float(np.hypot(self.ahead, self.above))
        A, B = radius**2 + self.d5**2, 2 * self.d5 * radius
        phase = -float(np.arctan2(self.ahead, self.above))
        if B < 0:
            phase, B = phase + np.pi, -B
        least = max(abs(abs(self.a2) - abs(self.a3)) - REACH.rounding, 0.0)
        most = abs(self.a2) + abs(self.a3) + REACH.rounding
        if least**2 > A + B or most**2 < A - B:
            return []
        # Range of the cosine, and the arcs over it.
        lower = max((least**2 - A) / B, -1.0) if B else -1.0
        upper = min((most**2 - A) / B, 1.0) if B else 1.0
        near, far = float(np.arccos(upper)), float(np.arccos(lower))
        if near == 0:
            return [(phase - far, phase + far)]
        if far == np.pi:
            return [(phase + near, phase + 2 * np.pi - near)]
        return [(phase + near, phase + far), (phase - far, phase - near)]

    def parameter(self, q: Array) -> float:
        """Parameter h [rad] of q (6,), clipped to the nearest end if it is on no arc."""
        return self.clipped(float(self.drawing.form(q)[1:4].sum()))

    def clipped(self, parameter: float) -> float:
        """Nearest parameter [rad] on an arc."""
        return nearest_on_arcs(parameter, self.arcs)

    def at(self, parameter: Array) -> Array:
        """Configurations (n, 6) [rad] at parameters (n,) on the arcs."""
        h = np.asarray(parameter, dtype=float)
        x, z = self._fourth_axis(h)
        elbow, shoulder = self._triangle(np.hypot(x, z))
        q = np.empty((len(h), 6))
        q[:, 0], q[:, 4] = self.q1, self.q5
        q[:, 1] = np.arctan2(z, x) - self._turned(shoulder, self.a2 < 0)
        q[:, 2] = self._turned(elbow, self._opposed)
        q[:, 3], q[:, 5] = h - q[:, 1] - q[:, 2], self.turn * (h - self.h0)
        return self.drawing.file_within_turn(q)

    def boxes(self, parameter: Array, half: Array) -> tuple[Array, Array]:
        """Boxes that cover the curve, see `SelfMotion.boxes`.

        The fourth axis moves by at most |d5| per radian. Both angles of the triangle are bounded
        over the resulting interval of distances.
        """
        h, half = np.asarray(parameter, dtype=float), np.asarray(half, dtype=float)
        x, z = self._fourth_axis(h)
        middle, blur = np.hypot(x, z), np.abs(self.d5) * half
        near, far = np.maximum(middle - blur, 0.0), middle + blur
        direction = np.where(
            blur < middle,
            np.arcsin(np.minimum(blur / np.maximum(middle, blur + 1e-300), 1.0)),
            np.pi,
        )
        elbows = np.stack([self._triangle(distance)[0] for distance in (near, far)])
        # Between the ends, the shoulder angle has at most one extremum.
        turning = np.sqrt(max(self.a2**2 - self.a3**2, 0.0))
        shoulders = np.stack(
            [self._triangle(d)[1] for d in (near, far, np.clip(turning, near, far))]
        )
        centre, sides = np.zeros((len(h), 6)), np.zeros((len(h), 6))
        centre[:, 0], centre[:, 4] = self.q1, self.q5
        centre[:, 2] = self._turned((elbows.max(axis=0) + elbows.min(axis=0)) / 2, self._opposed)
        sides[:, 2] = (elbows.max(axis=0) - elbows.min(axis=0)) / 2
        shoulder = (shoulders.max(axis=0) + shoulders.min(axis=0)) / 2
        centre[:, 1] = np.arctan2(z, x) - self._turned(shoulder, self.a2 < 0)
        sides[:, 1] = direction + (shoulders.max(axis=0) - shoulders.min(axis=0)) / 2
        centre[:, 3] = h - centre[:, 1] - centre[:, 2]
        sides[:, 3] = half + sides[:, 1] + sides[:, 2]
        centre[:, 5], sides[:, 5] = self.turn * (h - self.h0), half
        return self.drawing.file(centre), sides

    @property
    def _opposed(self) -> bool:
        """Whether the arm is stretched at q3 = pi."""
        return self.a2 * self.a3 < 0

    def _fourth_axis(self, h: Array) -> tuple[Array, Array]:
        """Position (x, z) [m] of the fourth axis in the arm's plane, relative to the second."""
        return self.ahead - self.d5 * np.sin(h), self.above + self.d5 * np.cos(h)

    def _triangle(self, distance: Array) -> tuple[Array, Array]:
        """Angles [rad] at elbow and shoulder of the triangle with sides |a2|, |a3| and `distance`
        [m].

        The distance is clipped to the possible triangles. The half-angle law of cosines is accurate
        next to the stretched and the folded arm.
        """
        a, b = abs(self.a2), abs(self.a3)
        d = np.clip(distance, abs(a - b), a + b)
        elbow = 2 * np.arctan2(
            np.sqrt((a + b - d) * (a + b + d)), np.sqrt((d - a + b) * (d + a - b))
        )
        shoulder = np.arctan2(b * np.sin(elbow), a + b * np.cos(elbow))
        return self.side * elbow, self.side * shoulder

    @staticmethod
    def _turned(angle: Array, half_turn: bool) -> Array:
        return angle + np.pi if half_turn else angle
