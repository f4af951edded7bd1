"""The configurations that reach a pose whose orientation is free in part, as a manifold to move on.

With one rotation free and seven joints it has two dimensions, with all of them four. Many
configurations move at once: along the manifold as a step to first order has it, then back onto it
by Newton's method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.forward import joint_placements, link_frames
from joulepath.optimizer.kinematics.jacobians import geometric_jacobian
from joulepath.optimizer.kinematics.tcp import T_last_tcp
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose

# a configuration reaches the pose up to this error [m, rad]; Newton steps back onto the manifold,
# each at most so long [rad]
REACHED, STEPS, LONGEST = 1e-10, 12, 0.5
# damping of the steps, relative to the greatest entry of a system: next to a singularity they stay
# short
DAMPING = 1e-10
# sine below which the axis of a tilt is any
PARALLEL = 1e-12
# steps towards other configurations, and the longest one [rad]
APPROACHES, STRIDE = 14, 0.35
# a joint nearer than this to where it is wanted pulls no harder [rad]
NEAR = 0.1


@dataclass(frozen=True, eq=False)
class GoalManifold:
    """What reaches `pose` with an arm within joint limits (nq,) [rad]."""

    pose: ConeOrientedPose
    placements: Array
    T_last: Array
    q_min: Array
    q_max: Array

    @classmethod
    def of(cls, arm: Arm, pose: ConeOrientedPose) -> GoalManifold:
        """The manifold of an arm within the limits in force."""
        limits = arm.active_limits
        return cls(
            pose, joint_placements(arm.robot.model), T_last_tcp(arm), limits.q_min, limits.q_max
        )

    def put(self, q: Array) -> tuple[Array, Mask]:
        """The configurations (n, nq) on the manifold that Newton's method finds from q (n, nq)
        [rad], and which of them (n,) reach the pose within the limits."""
        q = np.clip(q, self.q_min, self.q_max)
        for _ in range(STEPS):
            error, rows = self._error_and_rows(q)
            if np.abs(error).max(initial=0.0) < REACHED:
                break
            move = self._towards(error, rows, np.ones_like(q))
            # a joint that would leave its range stays on its limit, and the others do what it would
            # have done
            held = ((q <= self.q_min) & (move < 0)) | ((q >= self.q_max) & (move > 0))
            if held.any():
                move = self._towards(error, rows, np.where(held, 0.0, 1.0))
            q = np.clip(q + _shortened(move, LONGEST), self.q_min, self.q_max)
        error, _ = self._error_and_rows(q)
        return q, np.asarray(np.abs(error).max(axis=1) < REACHED)

    def nearest(self, q: Array, to: Array, weights: Array) -> tuple[Array, Mask]:
        """Where configurations (n, nq) on the manifold come to that move nearer to others (n, nq)
        [rad], and which (n,) of them reach the pose within the limits.

        They go where the sum of the joints' distances with `weights` (nq,) is least nearby: by
        quadratic steps whose weights are those of the distances left.
        """
        for _ in range(APPROACHES):
            error, rows = self._error_and_rows(q)
            way = to - q
            ease = np.maximum(np.abs(way), NEAR) / weights
            held = np.zeros(q.shape, dtype=bool)
            for _ in range(2):
                pull = np.where(held, 0.0, way)
                given = np.where(held, 0.0, ease)
                along = pull - self._towards((rows @ pull[:, :, None])[:, :, 0], rows, given)
                held |= ((q <= self.q_min) & (along < 0)) | ((q >= self.q_max) & (along > 0))
            move = _shortened(along, STRIDE) + _shortened(
                self._towards(error, rows, given), LONGEST
            )
            q = np.clip(q + move, self.q_min, self.q_max)
        return self.put(q)

    def _error_and_rows(self, q: Array) -> tuple[Array, Array]:
        """Twists (n, 6) [m, rad] that lead from q (n, nq) to the pose, to first order, and their
        rows (n, 6, nq) of the Jacobian: those of angles that are free are zero."""
        frames = link_frames(self.placements, q)
        T = frames[:, -1] @ self.T_last
        rows, error = geometric_jacobian(frames, T[:, :3, 3]), np.zeros((len(q), 6))
        error[:, :3] = self.pose.position - T[:, :3, 3]
        direction, pointing = self.pose.direction, T[:, :3, :3] @ self.pose.axis
        normal = np.cross(direction, pointing)
        sine = np.linalg.norm(normal, axis=1)
        angle = np.arctan2(sine, pointing @ direction)
        excess = np.maximum(angle - self.pose.half_angle, 0.0)
        unit = normal / np.maximum(sine, PARALLEL)[:, None]
        error[:, 3:] = -unit * excess[:, None]
        if self.pose.half_angle > 0:
            across = np.where((excess > 0)[:, None, None], unit[:, :, None] * unit[:, None, :], 0.0)
        else:
            across = (np.eye(3) - np.outer(direction, direction))[None]
        rows[:, 3:] = across @ rows[:, 3:]
        return error, rows

    @staticmethod
    def _towards(error: Array, rows: Array, ease: Array) -> Array:
        """The steps (n, nq) with rows · step = error (n, 6) that are shortest, each joint with its
        `ease` (n, nq).
        """
        eased = rows * ease[:, None, :]
        system = eased @ rows.transpose(0, 2, 1)
        scale = DAMPING * np.abs(system).max(axis=(1, 2), initial=1e-12)
        system[:, range(6), range(6)] += scale[:, None] + 1e-14
        solved = np.linalg.solve(system, error[:, :, None])
        return np.asarray((eased.transpose(0, 2, 1) @ solved)[:, :, 0])


def _shortened(move: Array, longest: float) -> Array:
    """Steps (n, nq), none with a joint that moves by more than `longest` [rad]."""
    return np.asarray(
        move * np.minimum(1.0, longest / np.maximum(np.abs(move).max(axis=1, keepdims=True), 1e-12))
    )
