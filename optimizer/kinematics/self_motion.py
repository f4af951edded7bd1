"""Self-motions: curves of configurations that hold one and the same pose, as a singular arm has
them.

`SelfMotion` is the interface. `StretchedWrist` is that of Universal Robots' arms: with sin(q5) = 0
the sixth axis is parallel to the second, third and fourth. The last joint may then turn while these
three keep the flange in place.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import Protocol

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import nearest_turn, wrapped
from joulepath.optimizer.problem.branches import BranchLabel, Label

# distance [m] beyond the reach at which the fourth axis may lie by rounding alone
ROUNDING = 1e-10
# an arc shorter than this is one configuration, up to rounding [rad]
POINT = 1e-4
# distance of a joint between two members of a curve that leaves room for others [rad], and halvings
# of the way between them
FAR_APART, OUTLYING, HALVINGS = 0.5, 3.0, 6


class SelfMotion(Protocol):
    """A curve of configurations that hold one pose, over a parameter on some arcs of the circle."""

    @property
    def label(self) -> BranchLabel:
        """The branch; the part that is singular has no meaning."""
        ...

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of the joints that move."""
        ...

    @property
    def arcs(self) -> list[tuple[float, float]]:
        """The intervals [rad] of the parameter."""
        ...

    def parameter(self, q: Array) -> float:
        """The parameter of the member nearest to q (nq,) [rad]."""
        ...

    def clipped(self, parameter: float) -> float:
        """The nearest parameter on an arc."""
        ...

    def at(self, parameter: Array) -> Array:
        """The configurations (n, nq) [rad], in [-pi, pi], at parameters (n,) on the arcs."""
        ...

    def boxes(self, parameter: Array, half: Array) -> tuple[Array, Array]:
        """Middle (n, nq) and half sides (n, nq) [rad] of boxes that hold every configuration of the
        curve whose parameter lies within `half` (n,) of `parameter` (n,). A full turn of a joint
        counts as none."""
        ...


def is_point(motion: SelfMotion) -> bool:
    """Whether the curve is one configuration, up to rounding."""
    return sum(upper - lower for lower, upper in motion.arcs) < POINT


def spread(motion: SelfMotion, count: int) -> Array:
    """At least `count` parameters, evenly spread over the arcs, both ends of each arc among them.

    Of an arc shorter than POINT there is one parameter, its middle; of a whole circle, both ends
    are one.
    """
    length = sum(upper - lower for lower, upper in motion.arcs)
    found = list[float]()
    for lower, upper in motion.arcs:
        if upper - lower < POINT:
            found.append((lower + upper) / 2)
            continue
        pieces = max(2, ceil(count * (upper - lower) / length))
        step, closed = (upper - lower) / pieces, upper - lower > 2 * np.pi - POINT
        # plain numbers: several times as fast as arrays of so few
        found += [lower + step * k for k in range(pieces)]
        if not closed:
            found.append(upper)
    return np.array(found)


def without_gaps(motion: SelfMotion, parameters: Array, q: Array) -> Array:
    """The members q (n, nq) [rad] of a self-motion at parameters (n,), in the order of its arcs,
    with members between neighbours on an arc that are FAR_APART, and OUTLYING times as far as most
    are.

    Next to a singularity the arm moves far while the parameter hardly does.
    """
    lower = np.sort([arc[0] for arc in motion.arcs])
    apart = np.abs(wrapped(np.diff(q, axis=0))).max(axis=1)
    far = max(FAR_APART, OUTLYING * float(np.median(apart))) if len(apart) else np.inf
    for _ in range(HALVINGS):
        arc = np.searchsorted(lower, parameters, "right")
        apart = np.abs(wrapped(np.diff(q, axis=0))).max(axis=1) > far
        gaps = np.flatnonzero(apart & (np.diff(arc) == 0) & (np.diff(parameters) > 0))
        if not len(gaps):
            break
        between = (parameters[gaps] + parameters[gaps + 1]) / 2
        q = np.insert(q, gaps + 1, motion.at(between), axis=0)
        parameters = np.insert(parameters, gaps + 1, between)
    return q


@dataclass(frozen=True, eq=False)
class StretchedWrist:
    """The self-motion of an arm of Universal Robots' form whose wrist is stretched or folded,
    sin(q5) = 0.

    The parameter is the angle h = q2 + q3 + q4 of the fifth axis in the arm's plane. The fourth
    axis lies at (x, z) = (ahead - d5 sin h, above + d5 cos h) [m] in this plane, seen from the
    second. With its distance D from the second axis, the law of cosines gives q3 on the elbow's
    `side` (1 or -1) and q2. q6 = turn (h - h0).
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

    free = (1, 2, 3, 5)

    @property
    def arcs(self) -> list[tuple[float, float]]:
        """Where the fourth axis is within reach of the second: least² <= A + B cos(h - phase) <=
        most².
        """
        radius = float(np.hypot(self.ahead, self.above))
        A, B = radius**2 + self.d5**2, 2 * self.d5 * radius
        phase = -float(np.arctan2(self.ahead, self.above))
        if B < 0:
            phase, B = phase + np.pi, -B
        least = max(abs(abs(self.a2) - abs(self.a3)) - ROUNDING, 0.0)
        most = abs(self.a2) + abs(self.a3) + ROUNDING
        if least**2 > A + B or most**2 < A - B:
            return []
        # the cosine's range, and the arcs on which it has it
        lower, upper = (
            max((least**2 - A) / B, -1.0) if B else -1.0,
            min((most**2 - A) / B, 1.0) if B else 1.0,
        )
        near, far = float(np.arccos(upper)), float(np.arccos(lower))
        if near == 0:
            return [(phase - far, phase + far)]
        if far == np.pi:
            return [(phase + near, phase + 2 * np.pi - near)]
        return [(phase + near, phase + far), (phase - far, phase - near)]

    def parameter(self, q: Array) -> float:
        """h [rad] of q (6,), at the end of an arc if it is on none."""
        return self.clipped(float(q[1] + q[2] + q[3]))

    def clipped(self, parameter: float) -> float:
        """The nearest parameter [rad] on an arc."""
        found = []
        for lower, upper in self.arcs:
            near = float(nearest_turn(np.asarray(parameter), np.asarray((lower + upper) / 2)))
            on_arc = float(np.clip(near, lower, upper))
            found.append((abs(near - on_arc), on_arc))
        return min(found)[1]

    def at(self, parameter: Array) -> Array:
        """The configurations (n, 6) [rad] at parameters (n,) on the arcs."""
        h = np.asarray(parameter, dtype=float)
        x, z = self._fourth_axis(h)
        elbow, shoulder = self._triangle(np.hypot(x, z))
        q = np.empty((len(h), 6))
        q[:, 0], q[:, 4] = self.q1, self.q5
        q[:, 1], q[:, 2] = (
            np.arctan2(z, x) - self._turned(shoulder, self.a2 < 0),
            self._turned(elbow, self._opposed),
        )
        q[:, 3], q[:, 5] = h - q[:, 1] - q[:, 2], self.turn * (h - self.h0)
        return np.clip(wrapped(q), -np.pi, np.pi)

    def boxes(self, parameter: Array, half: Array) -> tuple[Array, Array]:
        """See `SelfMotion`. The fourth axis moves by at most |d5| per radian; both angles of the
        triangle are bounded over the interval of its distance."""
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
        # between the ends, the angle at the shoulder has at most one extremum
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
        centre[:, 3], sides[:, 3] = (
            h - centre[:, 1] - centre[:, 2],
            half + sides[:, 1] + sides[:, 2],
        )
        centre[:, 5], sides[:, 5] = self.turn * (h - self.h0), half
        return centre, sides

    @property
    def _opposed(self) -> bool:
        """Whether the arm is stretched at q3 = pi."""
        return self.a2 * self.a3 < 0

    def _fourth_axis(self, h: Array) -> tuple[Array, Array]:
        """Place (x, z) [m] of the fourth axis in the arm's plane, seen from the second."""
        return self.ahead - self.d5 * np.sin(h), self.above + self.d5 * np.cos(h)

    def _triangle(self, distance: Array) -> tuple[Array, Array]:
        """Angles [rad] of elbow and shoulder of a triangle with sides |a2|, |a3| and `distance`
        [m], clipped to it.

        By the half-angle law of cosines, which is exact next to the stretched and to the folded
        arm.
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
