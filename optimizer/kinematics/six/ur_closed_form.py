"""Closed-form inverse kinematics of arms of Universal Robots' form, see `ur_geometry`.

The derivation is K. P. Hawkins, "Analytic inverse kinematics for the Universal Robots UR-5/UR-10
arms" (Georgia Tech, 2013). Every angle comes from an atan2 of two exact lengths, never from an
acos. A joint is therefore as accurate next to a singularity as the pose allows: a pose error e
moves the joints by e / (smallest singular value).
"""

from __future__ import annotations

from math import atan2, cos, hypot, pi, sin, sqrt, tau

import numpy as np
from scipy.optimize import minimize_scalar

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.kinematics.reach import REACH
from joulepath.optimizer.kinematics.self_motion import is_point
from joulepath.optimizer.kinematics.six.stretched_wrist import StretchedWrist
from joulepath.optimizer.kinematics.six.ur_geometry import UR, URGeometry, heading_uncertainty
from joulepath.optimizer.problem.branches import Label


class URClosedForm(URGeometry):
    """`PoseSolver` of an arm of Universal Robots' form."""

    complete, confirmed = True, False

    def solve(self, T: Array) -> tuple[Array, list[Label]]:
        """Isolated configurations of the flange pose T (4, 4), and their labels.

        Where shoulder or elbow is singular, the meeting branches count once. A stretched wrist has
        `self_motions` instead.

        Returns:
            At most eight configurations (n, 6) [rad] in [-pi, pi], none if T is out of reach by
            more than `Reach` allows, and their n labels.
        """
        T = self.drawing.pose(T)
        rows, labels = [], []
        for q1, ahead in self.shoulders(T):
            for q5, q6, sin_wrist, x, z, heading in self._wrists(T, q1, ahead):
                for q2, q3, sin_elbow in self._elbows(x, z):
                    rows.append((q1, q2, q3, heading - q2 - q3, q5, q6))
                    labels.append(self.label_of(ahead, sin_elbow, sin_wrist))
        if not rows:
            return np.zeros((0, 6)), []
        return self.drawing.file_within_turn(np.array(rows)), labels

    def _wrists(
        self, T: Array, q1: float, ahead: float
    ) -> list[tuple[float, float, float, float, float, float]]:
        """Wrists for a first angle, none if the wrist is stretched.

        Returns:
            Fifth and sixth angle [rad], sin(q5), position of the fourth axis ahead of the first and
            above the second [m], and q2 + q3 + q4 [rad] of each wrist.
        """
        (r11, r12, r13, _), (r21, r22, r23, _), (r31, r32, r33, pz), _ = T.tolist()
        c1, s1 = cos(q1), sin(q1)
        # The second axis (s1, -c1, 0) in flange axes is (sin q5 cos q6, -sin q5 sin q6, cos q5).
        u, v, w = r11 * s1 - r21 * c1, r12 * s1 - r22 * c1, r13 * s1 - r23 * c1
        sine = hypot(u, v)
        found = []
        for sin_q5 in (sine, -sine) if sine >= UR.stretched else ():
            sign = 1.0 if sin_q5 > 0 else -1.0
            q5, q6 = atan2(sin_q5, w), atan2(-sign * v, sign * u)
            # The fifth axis, opposite to the next y axis, is (sin, -cos) of q2 + q3 + q4 in the
            # arm's plane.
            c6, s6 = cos(q6), sin(q6)
            along = -(c1 * (s6 * r11 + c6 * r12) + s1 * (s6 * r21 + c6 * r22))
            above = -(s6 * r31 + c6 * r32)
            along, above = self.tilted(along, above)
            height = pz - self.d6 * r33 - self.d1
            turn, x, z = self._turned_into_reach(
                ahead - self.a1, height, along, above, heading_uncertainty(sine, abs(ahead))
            )
            found.append(
                (q5, q6 - turn if w > 0 else q6 + turn, sin_q5, x, z, atan2(along, -above) + turn)
            )
        return found

    def _turned_into_reach(
        self, ahead: float, height: float, along: float, above: float, slack: float
    ) -> tuple[float, float, float]:
        """Turn of the wrist that brings the fourth axis into reach, within the uncertainty of the
        pose.

        Next to a stretched wrist, the rounding of the pose turns the direction (along, above) from
        the fourth axis to the sixth, which is `ahead` of the second. At
        an edge of the elbow's reach, this may carry the fourth axis out of reach. Newton's method
        then turns it back, by no more than `slack` [rad].

        Returns:
            The turn [rad], and the position (x, z) [m] of the fourth axis in the arm's plane.
        """
        least, most = self.reach
        turn, c, s = 0.0, 1.0, 0.0
        for _ in range(UR.newton_steps):
            # The direction is (sin, -cos) of an angle.
            x = ahead - self.d5 * (c * along - s * above)
            z = height - self.d5 * (c * above + s * along)
            distance = hypot(x, z)
            excess = distance - min(max(distance, least), most)
            slope = self.d5 * (x * (c * above + s * along) - z * (c * along - s * above))
            if abs(excess) <= UR.edge or not abs(excess) * distance <= slack * abs(slope):
                break
            turn -= excess * distance / slope
            c, s = cos(turn), sin(turn)
        return turn, x, z

    def _elbows(self, x: float, z: float) -> list[tuple[float, float, float]]:
        """Second and third angle [rad], and sin(q3), that put the fourth axis at (x, z) [m] in the
        arm's plane.
        """
        least, most = self.reach
        distance = hypot(x, z)
        if not least - REACH.near <= distance <= most + REACH.near:
            return []
        if distance < UR.stretched:
            return []  # both links of equal length, folded: the arm turns about its second axis
        # Half-angle law of cosines: tan²(q3 / 2) = stretched / folded.
        stretched = (
            sqrt((most - distance) * (most + distance)) if most - distance > UR.edge else 0.0
        )
        folded = (
            sqrt((distance - least) * (distance + least)) if distance - least > UR.edge else 0.0
        )
        found = []
        for side in (stretched, -stretched) if stretched > 0 and folded > 0 else (stretched,):
            q3 = 2 * atan2(side, folded)
            s3 = sin(q3)
            q2 = atan2(z, x) - atan2(self.a3 * s3, self.a2 + self.a3 * cos(q3))
            found.append((q2, q3, s3))
        return found

    def self_motions(self, T: Array, limits: Limits | None = None) -> list[StretchedWrist]:
        """Self-motions of the flange pose T (4, 4), one for each shoulder with a stretched wrist,
        and elbow.

        Self-motions without a reachable member are left out; none is cut to the limits.
        """
        T, found = self.drawing.pose(T), list[StretchedWrist]()
        R = T[:3, :3]
        for q1, ahead in self.shoulders(T):
            c1, s1 = cos(q1), sin(q1)
            u, v, w = R.T @ np.array([s1, -c1, 0.0])
            if hypot(u, v) >= UR.stretched:
                continue
            # The fifth axis in the arm's plane, at q6 = 0 and a quarter turn later, is (sin, -cos)
            # of q2 + q3 + q4.
            inward = np.array([[c1, s1, 0.0], [0.0, 0.0, 1.0]])
            h1, h0 = (atan2(-along, above) for along, above in (inward @ R).T[:2].tolist())
            above = float(T[2, 3] - self.d6 * T[2, 2] - self.d1)
            for side in (1.0, -1.0):
                motion = StretchedWrist(
                    self.label_of(ahead, side, 0.0),
                    self.a2,
                    self.a3,
                    self.d5,
                    ahead - self.a1,
                    above,
                    q1,
                    0.0 if w > 0 else pi,
                    h0 + self.tilt,
                    1.0 if sin(h1 - h0) > 0 else -1.0,
                    side,
                    self.drawing,
                )
                if motion.arcs:
                    found.append(motion)
                    if is_point(motion):
                        break  # stretched or folded: the elbow has one side
        return found

    def distance_to_reach(self, T: Array) -> float:
        """Shortest shift [m] of the flange pose T (4, 4), at constant orientation, to a reachable
        pose.

        At a given first angle, the offset out of the arm's plane and the excess of the fourth axis
        over its reach within the plane are perpendicular. The distance is therefore a minimum over
        one angle.
        """
        T = self.drawing.pose(T)
        least, most = self.reach
        axis = T[:3, 2]
        centre = T[:3, 3] - self.d6 * axis

        def distance(q1: Array, flip: float) -> Array:
            c1, s1, zero = np.cos(q1), np.sin(q1), np.zeros_like(q1)
            side = c1 * centre[1] - s1 * centre[0] + self.d4
            fifth = np.cross(np.stack([s1, -c1, zero], axis=-1), axis)
            fifth *= flip / np.maximum(np.linalg.norm(fifth, axis=-1, keepdims=True), UR.rounding)
            along, above = self.tilted(c1 * fifth[..., 0] + s1 * fifth[..., 1], fifth[..., 2])
            x = c1 * centre[0] + s1 * centre[1] - self.a1 - self.d5 * along
            z = centre[2] - self.d1 - self.d5 * above
            radius = np.hypot(x, z)
            return np.asarray(
                np.hypot(side, np.maximum(0, np.maximum(least - radius, radius - most)))
            )

        angles = np.linspace(-pi, pi, UR.shoulder_angles + 1)
        best = self._distance_with_stretched_wrist(T)
        for flip in (1.0, -1.0):
            values = distance(angles, flip)
            k = int(np.argmin(values))
            bounds = angles[k] - tau / UR.shoulder_angles, angles[k] + tau / UR.shoulder_angles
            refined = minimize_scalar(
                lambda q1, flip=flip: float(distance(np.array(q1), flip)),
                bounds=bounds,
                method="bounded",
                options={"xatol": 1e-10},
            )
            best = min(best, float(values[k]), float(refined.fun))
        return best

    def _distance_with_stretched_wrist(self, T: Array) -> float:
        """Distance to reach [m] with the wrist stretched, of the table's flange pose T (4, 4);
        infinite if no first angle stretches it.

        With the wrist stretched, the fourth axis may lie anywhere on a circle about the fifth
        joint.
        """
        least, most = self.reach
        best = np.inf
        for q1, ahead in self.shoulders(T):
            across = hypot(T[2, 2], cos(q1) * T[0, 2] + sin(q1) * T[1, 2])
            if across < UR.rounding:
                radius = hypot(ahead - self.a1, T[2, 3] - self.d6 * T[2, 2] - self.d1)
                nearest, farthest = abs(radius - abs(self.d5)), radius + abs(self.d5)
                best = min(best, max(0.0, least - farthest, nearest - most))
        return best
