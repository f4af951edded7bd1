"""The curve of configurations of a redundant or singular arm that hold one pose of the TCP.

It is found by Newton's method on the arm itself. So it does not end where the charts of a closed
form do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import pose_error
from joulepath.optimizer.kinematics.tcp import T_last_tcp, tcp_pose
from joulepath.optimizer.problem.arm import Arm

# the pose is held to this error [m, rad]; Newton steps, of which a few suffice near the curve
HELD, STEPS = 1e-11, 12
# a joint that would leave its range by more than rounding stays on its limit instead [rad]
INSIDE = 1e-9
# of the curve's length [rad] for differences of its tangent
STEP = 1e-4
# a singular value of the Jacobian below this share of the largest is zero: the arm is singular
SINGULAR = 1e-8


@dataclass(frozen=True)
class HeldPose:
    """What holds the TCP at T (4, 4), base frame, within joint limits (nq,) [rad].

    The TCP is at `T_last` (4, 4) in the frame of the last link. The arm has one joint more than a
    pose fixes, or is singular. `data` is Pinocchio's memory for its `model`: for one thread.
    """

    model: pin.Model
    data: pin.Data
    T_last: Array
    T: Array
    q_min: Array
    q_max: Array

    @staticmethod
    def of(arm: Arm, q: Array) -> HeldPose:
        """The curve of an arm through q (nq,) [rad], within the limits in force."""
        model, limits = arm.robot.model, arm.active_limits
        return HeldPose(
            model, model.createData(), T_last_tcp(arm), tcp_pose(arm, q), limits.q_min, limits.q_max
        )

    def put(self, q: Array) -> Array | None:
        """The configuration (nq,) on the curve that Newton's method finds from q (nq,); None if it
        finds none within the limits. If a joint would be beyond its limit, the one on which it is
        on the limit."""
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
        return np.asarray(np.linalg.svd(self._tcp_and_jacobian(q)[1])[2][-1])

    def moves(self, q: Array) -> bool:
        """Whether the arm can move at q (nq,) [rad] while it holds the pose, to first order."""
        values = np.linalg.svd(self._tcp_and_jacobian(q)[1], compute_uv=False)
        return len(q) > len(values) or bool(values[-1] < SINGULAR * values[0])

    def bend(self, q: Array, tangent: Array) -> Array:
        """The change (nq,) of the tangent per length of the curve [1/rad]."""
        before, after = (self.tangent(q + step * tangent) for step in (-STEP, STEP))
        return np.asarray(
            (after * np.sign(after @ tangent) - before * np.sign(before @ tangent)) / (2 * STEP)
        )

    def _solved(self, q: Array, fixed: int | None) -> Array | None:
        """The configuration that holds the pose, with one joint `fixed`; None if Newton's method
        finds none.
        """
        moving = np.arange(len(q)) != fixed
        q = q.copy()
        for _ in range(STEPS):
            T, jacobian = self._tcp_and_jacobian(q)
            error = pose_error(T[None], self.T)[0]
            if np.abs(error).max() < HELD:
                return q
            q[moving] += np.linalg.lstsq(jacobian[:, moving], error, rcond=SINGULAR)[0]
        return None

    def _tcp_and_jacobian(self, q: Array) -> tuple[Array, Array]:
        """Pose (4, 4) of the TCP at q (nq,), and its geometric Jacobian (6, nq) in base axes."""
        about_base = pin.computeJointJacobians(self.model, self.data, q)
        T = self.data.oMi[self.model.njoints - 1].homogeneous @ self.T_last
        jacobian = about_base.copy()
        jacobian[:3] -= pin.skew(T[:3, 3]) @ about_base[3:]
        return T, jacobian
