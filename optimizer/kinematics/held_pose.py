"""The curve of configurations of a redundant arm that hold one pose of the TCP, near any of them.

It is found by Newton's method on the arm itself. So it does not end where the charts of a closed form do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.robot import Array
from optimizer.kinematics.chain import Chain, pose_error
from optimizer.kinematics.forward import joint_placements
from optimizer.kinematics.tcp import T_last_tcp
from optimizer.problem.arm import Arm

# the pose is held to this error [m, rad]; Newton steps, of which a few suffice near the curve
HELD, STEPS = 1e-11, 12
# a joint that would leave its range by more than rounding stays on its limit instead [rad]
INSIDE = 1e-9
# of the curve's length [rad] for differences of its tangent
STEP = 1e-4


@dataclass(frozen=True)
class HeldPose:
    """What holds the TCP at T (4, 4), base frame, within joint limits (nq,) [rad].

    `chain` ends at the TCP. It has one joint more than a pose fixes.
    """

    chain: Chain
    T: Array
    q_min: Array
    q_max: Array

    @staticmethod
    def of(arm: Arm, q: Array) -> HeldPose:
        """The curve of an arm through q (nq,) [rad], within the limits in force."""
        chain = Chain(joint_placements(arm.robot.model), T_last_tcp(arm))
        return HeldPose(chain, chain.flange(q[None])[0], arm.active_limits.q_min, arm.active_limits.q_max)

    def put(self, q: Array) -> Array | None:
        """The configuration (nq,) on the curve that Newton's method finds from q (nq,); None if it finds none within
        the limits. If a joint would be beyond its limit, the one on which it is on the limit."""
        found = self._solved(q, None)
        if found is None:
            return None
        beyond = np.maximum(self.q_min - found, found - self.q_max)
        worst = int(beyond.argmax())
        if beyond[worst] <= 0:
            return found
        found = self._solved(np.clip(found, self.q_min, self.q_max), worst)
        if found is None or (np.maximum(self.q_min - found, found - self.q_max) > INSIDE).any():
            return None
        return np.asarray(np.clip(found, self.q_min, self.q_max))

    def tangent(self, q: Array) -> Array:
        """The direction (nq,) of the curve at q (nq,), of length 1."""
        return np.asarray(np.linalg.svd(self.chain.flange_and_jacobian(q[None])[1][0])[2][-1])

    def bend(self, q: Array, tangent: Array) -> Array:
        """The change (nq,) of the tangent per length of the curve [1/rad]."""
        near = q + np.outer([-STEP, STEP], tangent)
        before, after = np.linalg.svd(self.chain.flange_and_jacobian(near)[1])[2][:, -1]
        return np.asarray((after * np.sign(after @ tangent) - before * np.sign(before @ tangent)) / (2 * STEP))

    def _solved(self, q: Array, fixed: int | None) -> Array | None:
        """The configuration that holds the pose, with one joint `fixed`; None if Newton's method finds none."""
        moving = np.arange(len(q)) != fixed
        q = q.copy()
        for _ in range(STEPS):
            T, jacobian = self.chain.flange_and_jacobian(q[None])
            error = pose_error(T, self.T)[0]
            if np.abs(error).max() < HELD:
                return q
            q[moving] += np.linalg.lstsq(jacobian[0][:, moving], error, rcond=None)[0]
        return None
