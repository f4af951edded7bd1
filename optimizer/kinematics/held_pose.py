"""The curve of configurations of a redundant arm that hold one pose of the TCP, near any of them.

It is found by Newton's method on the arm itself. So it does not end where the charts of a closed form do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from models.robot import Array
from optimizer.kinematics.tcp import tcp_jacobian, tcp_pose
from optimizer.problem.arm import Arm

# the pose is held to this error [m, rad]; Newton steps, of which a few suffice near the curve
HELD, STEPS = 1e-11, 12
# a joint that would leave its range by more than rounding stays on its limit instead [rad]
INSIDE = 1e-9
# of the curve's length [rad] for differences of its tangent
STEP = 1e-4


@dataclass(frozen=True)
class HeldPose:
    """What holds T_base_tcp (4, 4) within joint limits (nq,) [rad]. The arm has one joint more than a pose fixes."""

    arm: Arm
    T: Array
    q_min: Array
    q_max: Array

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
        return np.asarray(np.linalg.svd(tcp_jacobian(self.arm, q))[2][-1])

    def bend(self, q: Array, tangent: Array) -> Array:
        """The change (nq,) of the tangent per length of the curve [1/rad]."""
        after, before = (self.tangent(q + side * STEP * tangent) for side in (1, -1))
        difference = after * np.sign(after @ tangent) - before * np.sign(before @ tangent)
        return np.asarray(difference / (2 * STEP))

    def _solved(self, q: Array, fixed: int | None) -> Array | None:
        """The configuration that holds the pose, with one joint `fixed`; None if Newton's method finds none."""
        moving = np.arange(len(q)) != fixed
        q = q.copy()
        for _ in range(STEPS):
            error = self._error(q)
            if np.abs(error).max() < HELD:
                return q
            q[moving] -= np.linalg.lstsq(tcp_jacobian(self.arm, q)[:, moving], error, rcond=None)[0]
        return None

    def _error(self, q: Array) -> Array:
        """How far the TCP is from the pose at q (nq,): (6,) [m, rad], in base axes."""
        T = tcp_pose(self.arm, q)
        turned = pin.log3(np.ascontiguousarray(T[:3, :3] @ self.T[:3, :3].T))
        return np.concatenate([T[:3, 3] - self.T[:3, 3], turned])
