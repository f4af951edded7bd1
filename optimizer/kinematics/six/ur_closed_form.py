"""Closed-form inverse kinematics of arms of Universal Robots' form: inner axes parallel, the last
three offset.

The arm has the standard Denavit-Hartenberg table

    a     = [0, a2, a3, 0, 0, 0],  d = [d1, 0, 0, d4, d5, d6],  alpha = [pi/2, 0, 0, pi/2, -pi/2,
    0].

The derivation is K. P. Hawkins, "Analytic inverse kinematics for the Universal Robots UR-5/UR-10
arms" (Georgia Tech, 2013). Here every angle comes from an atan2 of two exact lengths, never from an
acos, so that a joint is as accurate next to a singularity as the pose allows: a pose rounded by e
moves joints by e / (smallest singular value).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, pi, sin, sqrt, tau

import numpy as np
import pinocchio as pin
from scipy.optimize import minimize_scalar

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.kinematics.reach import REACH
from joulepath.optimizer.kinematics.self_motion import StretchedWrist, is_point
from joulepath.optimizer.problem.branches import Label

# distance [m, or sine of the wrist angle] beyond the reach at which a pose may lie by rounding
# alone
ROUNDING = 1e-10
# sine of the wrist angle below which the wrist counts as stretched: then every member of its
# self-motion reaches the pose to half of what is promised of a solution
STRETCHED = 5e-10
# distance [m] from an edge of the reach within which the two branches that meet there count as one:
# a pose on the edge, rounded to double precision, lies that near
EDGE = 1e-13
# angle [rad] that a pose rounded to double precision leaves open in q2 + q3 + q4, times the wrist's
# sine. Where the wrist is ahead of the first axis by less than 1 m, the first angle is open, too:
# by this over the distance, or over LEAST_AHEAD [m] if that is more
HEADING, LEAST_AHEAD = 1e-14, 1e-5
# the excess is small against the circle that the fourth axis moves on: the second step meets the
# last digit
NEWTON_STEPS = 4
# a part of the label is singular where its sine, or the shoulder's distance [m], is below this:
# nearer to it, a pose that is rounded to double precision no longer determines the joints to 1e-9
# rad
SINGULAR = 1e-6
# greatest difference between the table's forward kinematics and the model's [m, 1]
EQUAL = 1e-12
# shoulder angles of the search for the nearest reachable position, for each wrist; the best is then
# refined
SHOULDER_ANGLES = 720


@dataclass(frozen=True)
class URClosedForm:
    """The closed form for the signed lengths [m] of the table above."""

    d1: float
    a2: float
    a3: float
    d4: float
    d5: float
    d6: float

    complete, confirmed = True, False

    @classmethod
    def of(cls, model: pin.Model, tolerance: float = EQUAL) -> URClosedForm | None:
        """The closed form of a Pinocchio model with a frame `flange`; None if the table does not
        describe the model.

        `tolerance` [m, 1] is the greatest difference between the poses of both. With more than
        rounding, the form names the branches of an arm that deviates from it, as a calibrated one
        does.
        """
        if model.nq != 6:
            return None
        flange, data = model.getFrameId("flange"), model.createData()
        pin.framesForwardKinematics(model, data, np.zeros(6))
        elbow, wrist_1, wrist_2 = (data.oMi[j].translation for j in (3, 4, 5))
        end = data.oMf[flange].translation
        # at zero the arm lies along x, the second axis along -y
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
    def _reach(self) -> tuple[float, float]:
        """Least and greatest distance [m] from the second axis to the fourth."""
        return abs(abs(self.a2) - abs(self.a3)), abs(self.a2) + abs(self.a3)

    def label(self, q: Array) -> Label:
        """The branch of a configuration, shape (6,); on a singularity, one of those that meet
        there.
        """
        return self._label(self._ahead(q), sin(q[2]), sin(q[4]))

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """The parts of the label that are singular at a configuration (6,): so near to changing
        that a pose rounded to double precision may have changed them.

        That is within SINGULAR. The elbow's angle near its edge is the root of twice the excess
        over the reach, times the reach, over both links: next to a stretched wrist, where the
        fourth axis moves with the open heading, more.
        """
        ahead, sin_elbow, sin_wrist = abs(self._ahead(q)), abs(sin(q[2])), abs(sin(q[4]))
        excess = abs(self.d5) * _open_heading(max(sin_wrist, STRETCHED), ahead)
        elbow = sqrt(2 * excess * self._reach[1] / abs(self.a2 * self.a3))
        near = {
            "shoulder": ahead < SINGULAR,
            "elbow": sin_elbow < max(SINGULAR, elbow),
            "wrist": sin_wrist < SINGULAR,
        }
        return tuple(part for part, singular in near.items() if singular)

    def _ahead(self, q: Array) -> float:
        """Distance [m] of the last axis' origin ahead of the first axis at a configuration (6,)."""
        return self.a2 * cos(q[1]) + self.a3 * cos(q[1] + q[2]) + self.d5 * sin(q[1] + q[2] + q[3])

    def _label(self, ahead: float, sin_elbow: float, sin_wrist: float) -> Label:
        """From the origin of the last axis ahead of the first axis [m], and sines of the third and
        fifth angle.
        """
        return Label(
            shoulder="left" if ahead * self.d4 < 0 else "right",
            elbow="up" if ahead * self.a2 * self.a3 * sin_elbow < 0 else "down",
            wrist="no_flip" if sin_wrist < 0 else "flip",
        )

    def solve(self, T: Array) -> tuple[Array, list[Label]]:
        """The isolated configurations (n, 6) [rad] in [-pi, pi] that put the flange at T (4, 4),
        and their labels.

        n is at most eight, and zero if T is out of reach by more than `Reach` allows. Where
        shoulder or elbow is singular, the branches that meet there count once. A stretched wrist
        has `self_motions` instead.
        """
        rows, labels = [], []
        for q1, ahead in self._shoulders(T):
            for q5, q6, sin_wrist, x, z, heading in self._wrists(T, q1, ahead):
                for q2, q3, sin_elbow in self._elbows(x, z):
                    rows.append((q1, q2, q3, heading - q2 - q3, q5, q6))
                    labels.append(self._label(ahead, sin_elbow, sin_wrist))
        if not rows:
            return np.zeros((0, 6)), []
        q = np.array(rows)
        # clipped by no more than the last digit
        return np.clip(q - tau * np.round(q / tau), -pi, pi), labels

    def _shoulders(self, T: Array) -> list[tuple[float, float]]:
        """First angle, and the distance [m] of the last axis' origin ahead of the first axis at
        this angle.
        """
        x, y = float(T[0, 3] - self.d6 * T[0, 2]), float(T[1, 3] - self.d6 * T[1, 2])
        distance = hypot(x, y)
        if distance < abs(self.d4) - REACH.near:
            return []
        beyond = distance - abs(self.d4)
        ahead = sqrt(beyond * (distance + abs(self.d4))) if beyond > EDGE else 0.0
        towards = atan2(y, x)
        return [
            (towards + atan2(self.d4, side), side)
            for side in ((ahead, -ahead) if ahead > 0 else (0.0,))
        ]

    def _wrists(
        self, T: Array, q1: float, ahead: float
    ) -> list[tuple[float, float, float, float, float, float]]:
        """Fifth and sixth angle, sin(q5), fourth axis ahead of the first and above the second [m],
        q2 + q3 + q4.

        None with the wrist stretched.
        """
        (r11, r12, r13, _), (r21, r22, r23, _), (r31, r32, r33, pz), _ = T.tolist()
        c1, s1 = cos(q1), sin(q1)
        # the second axis (s1, -c1, 0) in flange axes: (sin q5 cos q6, -sin q5 sin q6, cos q5)
        u, v, w = r11 * s1 - r21 * c1, r12 * s1 - r22 * c1, r13 * s1 - r23 * c1
        sine = hypot(u, v)
        found = []
        for sin_q5 in (sine, -sine) if sine >= STRETCHED else ():
            sign = 1.0 if sin_q5 > 0 else -1.0
            q5, q6 = atan2(sin_q5, w), atan2(-sign * v, sign * u)
            # the fifth axis, minus the y axis after it, in the arm's plane: (sin, -cos) of q2 + q3
            # + q4
            c6, s6 = cos(q6), sin(q6)
            along = -(c1 * (s6 * r11 + c6 * r12) + s1 * (s6 * r21 + c6 * r22))
            above = -(s6 * r31 + c6 * r32)
            height = pz - self.d6 * r33 - self.d1
            turn, x, z = self._turned_into_reach(
                ahead, height, along, above, _open_heading(sine, abs(ahead))
            )
            found.append(
                (q5, q6 - turn if w > 0 else q6 + turn, sin_q5, x, z, atan2(along, -above) + turn)
            )
        return found

    def _turned_into_reach(
        self, ahead: float, height: float, along: float, above: float, slack: float
    ) -> tuple[float, float, float]:
        """Turn [rad] of the fifth axis, at most `slack`, and where it leaves the fourth axis in the
        arm's plane [m].

        Next to a stretched wrist the rounding of the pose turns the fifth axis (along, above). On
        an edge of the elbow, this may carry the fourth axis out of reach. It is then turned back,
        by no more than the pose leaves open.
        """
        least, most = self._reach
        turn, c, s = 0.0, 1.0, 0.0
        for _ in range(NEWTON_STEPS):
            # the fifth axis is (sin, -cos) of an angle
            x = ahead - self.d5 * (c * along - s * above)
            z = height - self.d5 * (c * above + s * along)
            distance = hypot(x, z)
            excess = distance - min(max(distance, least), most)
            slope = self.d5 * (x * (c * above + s * along) - z * (c * along - s * above))
            if abs(excess) <= EDGE or not abs(excess) * distance <= slack * abs(slope):
                break
            turn -= excess * distance / slope
            c, s = cos(turn), sin(turn)
        return turn, x, z

    def _elbows(self, x: float, z: float) -> list[tuple[float, float, float]]:
        """Second and third angle, and sin(q3), that put the fourth axis at (x, z) in the arm's
        plane [m].
        """
        least, most = self._reach
        distance = hypot(x, z)
        if not least - REACH.near <= distance <= most + REACH.near:
            return []
        if distance < STRETCHED:
            return []  # both links of equal length, folded: the arm turns about its second axis
        # tan²(q3 / 2) = stretched / folded, by the half-angle law of cosines
        stretched = sqrt((most - distance) * (most + distance)) if most - distance > EDGE else 0.0
        folded = sqrt((distance - least) * (distance + least)) if distance - least > EDGE else 0.0
        if self.a2 * self.a3 < 0:
            stretched, folded = folded, stretched
        found = []
        for side in (stretched, -stretched) if stretched > 0 and folded > 0 else (stretched,):
            q3 = 2 * atan2(side, folded)
            s3 = sin(q3)
            q2 = atan2(z, x) - atan2(self.a3 * s3, self.a2 + self.a3 * cos(q3))
            found.append((q2, q3, s3))
        return found

    def self_motions(self, T: Array, limits: Limits | None = None) -> list[StretchedWrist]:
        """The self-motions that hold the flange at T (4, 4): one for each shoulder that stretches
        the wrist, and elbow.

        They are empty if no member is in reach. None is cut to the limits.
        """
        found = []
        R = T[:3, :3]
        for q1, ahead in self._shoulders(T):
            c1, s1 = cos(q1), sin(q1)
            u, v, w = R.T @ np.array([s1, -c1, 0.0])
            if hypot(u, v) >= STRETCHED:
                continue
            # the fifth axis in the arm's plane, at q6 = 0 and a quarter turn on: (sin, -cos) of q2
            # + q3 + q4
            inward = np.array([[c1, s1, 0.0], [0.0, 0.0, 1.0]])
            h1, h0 = (atan2(-along, above) for along, above in (inward @ R).T[:2].tolist())
            above = float(T[2, 3] - self.d6 * T[2, 2] - self.d1)
            for side in (1.0, -1.0):
                motion = StretchedWrist(
                    self._label(ahead, side * (1 if self.a2 * self.a3 > 0 else -1), 0.0),
                    self.a2,
                    self.a3,
                    self.d5,
                    ahead,
                    above,
                    q1,
                    0.0 if w > 0 else pi,
                    h0,
                    1.0 if sin(h1 - h0) > 0 else -1.0,
                    side,
                )
                if motion.arcs:
                    found.append(motion)
                    if is_point(motion):
                        break  # stretched or folded: the elbow has one side
        return found

    def distance_to_reach(self, T: Array) -> float:
        """Distance [m] by which T (4, 4) must shift, with its orientation kept, to have a solution;
        0 if it has one.

        At a given first angle, the offset out of the arm's plane and the excess of the fourth axis
        over its reach in this plane are at right angles. The distance is therefore a minimum over
        one angle.
        """
        least, most = self._reach
        axis = T[:3, 2]
        centre = T[:3, 3] - self.d6 * axis

        def distance(q1: Array, flip: float) -> Array:
            c1, s1, zero = np.cos(q1), np.sin(q1), np.zeros_like(q1)
            side = c1 * centre[1] - s1 * centre[0] + self.d4
            fifth = np.cross(np.stack([s1, -c1, zero], axis=-1), axis)
            fifth *= flip / np.maximum(np.linalg.norm(fifth, axis=-1, keepdims=True), ROUNDING)
            x = (
                c1 * centre[0]
                + s1 * centre[1]
                - self.d5 * (c1 * fifth[..., 0] + s1 * fifth[..., 1])
            )
            z = centre[2] - self.d1 - self.d5 * fifth[..., 2]
            radius = np.hypot(x, z)
            return np.asarray(
                np.hypot(side, np.maximum(0, np.maximum(least - radius, radius - most)))
            )

        angles = np.linspace(-pi, pi, SHOULDER_ANGLES + 1)
        best = self._distance_with_stretched_wrist(T)
        for flip in (1.0, -1.0):
            values = distance(angles, flip)
            k = int(np.argmin(values))
            bounds = angles[k] - tau / SHOULDER_ANGLES, angles[k] + tau / SHOULDER_ANGLES
            refined = minimize_scalar(
                lambda q1, flip=flip: float(distance(np.array(q1), flip)),
                bounds=bounds,
                method="bounded",
                options={"xatol": 1e-10},
            )
            best = min(best, float(values[k]), float(refined.fun))
        return best

    def _distance_with_stretched_wrist(self, T: Array) -> float:
        """The same distance [m] with the wrist stretched; infinite if no first angle stretches it.

        With the wrist stretched, the fourth axis may lie anywhere on a circle about the fifth
        joint.
        """
        least, most = self._reach
        best = np.inf
        for q1, ahead in self._shoulders(T):
            across = hypot(T[2, 2], cos(q1) * T[0, 2] + sin(q1) * T[1, 2])
            if across < ROUNDING:
                radius = hypot(ahead, T[2, 3] - self.d6 * T[2, 2] - self.d1)
                nearest, farthest = abs(radius - abs(self.d5)), radius + abs(self.d5)
                best = min(best, max(0.0, least - farthest, nearest - most))
        return best


def _open_heading(sine: float, ahead: float) -> float:
    """Angle [rad] that a rounded pose leaves open in q2 + q3 + q4, from the wrist's sine and its
    distance [m] ahead.
    """
    return HEADING / (sine * min(1.0, max(ahead, LEAST_AHEAD)))
