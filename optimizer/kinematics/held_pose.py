"""Self-motion of a redundant or singular arm that holds a TCP pose, found by Newton's method on the
arm itself.

Unlike the curves of a closed form, it does not end at the limits of a parametrisation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from joulepath.models.coupling import Coupling
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import pose_error
from joulepath.optimizer.kinematics.tcp import T_last_tcp, tcp_pose
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class HeldPoseSettings:
    """Settings of Newton's method and of the singularity test."""

    tolerance: float = 1e-11
    """Largest pose error of a configuration on the curve [m, rad]."""
    newton_steps: int = 12
    """Largest number of Newton steps; a few suffice near the curve."""
    limit_rounding: float = 1e-9
    """Angle beyond a limit that is due to rounding [rad]."""
    difference: float = 1e-4
    """Arc length of the curve for differences of its tangent [rad]."""
    singular: float = 1e-8
    """Singular value of the Jacobian, relative to the largest, below which it is zero."""


HELD_POSE = HeldPoseSettings()


@dataclass(frozen=True)
class HeldPose:
    """Self-motion with the TCP at T (4, 4) in the base frame, within joint limits (nq,) [rad].

    `T_last` (4, 4) is the TCP in the frame of the last link. The arm has one redundant joint, or is
    singular. `data` is Pinocchio's work space of `model`, for a single thread.
    """

    model: pin.Model
    data: pin.Data
    T_last: Array
    T: Array
    q_min: Array
    q_max: Array
    coupling: Coupling

    @staticmethod
    def of(arm: Arm, q: Array) -> HeldPose:
        """Curve of an arm through q (nq,) [rad], within its active limits."""
        model, limits = arm.robot.model, arm.active_limits
        return HeldPose(
            model,
            model.createData(),
            T_last_tcp(arm),
            tcp_pose(arm, q),
            limits.q_min,
            limits.q_max,
            arm.robot.coupling,
        )

    def put(self, q: Array) -> Array | None:
        """Projects q (nq,) [rad] onto the curve by Newton's method.

        Returns:
            The configuration (nq,) [rad]; if a joint would be beyond its limit, the one with this
            joint on the limit; None if there is none within the limits.
        """
        found = self._solved(q, None)
        if found is None:
            return None
        beyond = np.maximum(self.q_min - found, found - self.q_max)
        worst = int(beyond.argmax())
        if beyond[worst] <= 0:
            return found
        found = self._solved(np.clip(found, self.q_min, self.q_max), worst)
        if (
            found is None
            or (np.maximum(self.q_min - found, found - self.q_max) > HELD_POSE.limit_rounding).any()
        ):
            return None
        return np.asarray(np.clip(found, self.q_min, self.q_max))

    def tangent(self, q: Array) -> Array:
        """Unit tangent (nq,) of the curve at q (nq,) [rad]."""
        return np.asarray(np.linalg.svd(self._tcp_and_jacobian(q)[1])[2][-1])

    def moves(self, q: Array) -> bool:
        """Whether the arm can move at q (nq,) [rad] while it holds the pose, to first order."""
        values = np.linalg.svd(self._tcp_and_jacobian(q)[1], compute_uv=False)
        return len(q) > len(values) or bool(values[-1] < HELD_POSE.singular * values[0])

    def bend(self, q: Array, tangent: Array) -> Array:
        """Derivative (nq,) of the tangent by arc length [1/rad]."""
        before, after = (
            self.tangent(q + step * tangent)
            for step in (-HELD_POSE.difference, HELD_POSE.difference)
        )
        return np.asarray(
            (after * np.sign(after @ tangent) - before * np.sign(before @ tangent))
            / (2 * HELD_POSE.difference)
        )

    def _solved(self, q: Array, fixed: int | None) -> Array | None:
        """Configuration that holds the pose, with one joint `fixed`; None if Newton's method finds
        none.
        """
        moving = np.arange(len(q)) != fixed
        q = q.copy()
        for _ in range(HELD_POSE.newton_steps):
            T, jacobian = self._tcp_and_jacobian(q)
            error = pose_error(T[None], self.T)[0]
            if np.abs(error).max() < HELD_POSE.tolerance:
                return q
            q[moving] += np.linalg.lstsq(jacobian[:, moving], error, rcond=HELD_POSE.singular)[0]
        return None

    def _tcp_and_jacobian(self, q: Array) -> tuple[Array, Array]:
        """TCP pose (4, 4) at q (nq,), and geometric Jacobian (6, nq) in base axes."""
        about_base = pin.computeJointJacobians(self.model, self.data, self.coupling.positions(q))
        T = self.data.oMi[self.model.njoints - 1].homogeneous @ self.T_last
        jacobian = about_base.copy()
        jacobian[:3] -= pin.skew(T[:3, 3]) @ about_base[3:]
        return T, self.coupling.on_arm(jacobian)
