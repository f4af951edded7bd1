"""Manifold of all configurations of a pose with a partly free orientation.

The manifold of a seven-joint arm has two dimensions with one free rotation, and four dimensions
with a free orientation. Many configurations move at once: a first-order step leads along the
manifold, and Newton's method leads back onto the manifold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.coupling import Coupling
from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.forward import joint_placements, link_frames
from joulepath.optimizer.kinematics.jacobians import geometric_jacobian
from joulepath.optimizer.kinematics.tcp import T_last_tcp
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose


@dataclass(frozen=True)
class GoalManifoldSettings:
    """Settings of the projection onto the manifold and of the motion along it."""

    tolerance: float = 1e-10
    """Largest pose error of a configuration on the manifold [m, rad]."""
    newton_steps: int = 12
    """Largest number of Newton steps of a projection."""
    longest_newton_step: float = 0.5
    """Largest joint movement of one Newton step [rad]."""
    damping: float = 1e-10
    """Damping relative to the largest entry of the normal matrix; it keeps steps short next to a
    singularity.
    """
    held: float = 1e-9
    """Singular value of the constraints, relative to the largest, above which a direction of the
    joints is held.
    """
    moving: float = 1e-6
    """Share of a joint in a unit motion of all joints above which it moves."""
    parallel: float = 1e-12
    """Sine of the tilt below which the tilt axis is undetermined."""
    approach_steps: int = 14
    """Number of steps towards a target configuration."""
    longest_approach_step: float = 0.35
    """Largest joint movement of one step towards a target [rad]."""
    nearest_distance: float = 0.1
    """Joint distance from the target below which the weight of a joint no longer grows [rad]."""


SETTINGS = GoalManifoldSettings()


@dataclass(frozen=True, eq=False)
class GoalManifold:
    """Configurations of an arm at `pose` within the joint limits `q_min`, `q_max` (nq,) [rad]."""

    pose: ConeOrientedPose
    placements: Array
    T_last: Array
    q_min: Array
    q_max: Array
    coupling: Coupling

    @classmethod
    def of(cls, arm: Arm, pose: ConeOrientedPose) -> GoalManifold:
        """Manifold of an arm within its active limits."""
        limits, robot = arm.active_limits, arm.robot
        placements, T_last = joint_placements(robot.model), T_last_tcp(arm)
        return cls(pose, placements, T_last, limits.q_min, limits.q_max, robot.coupling)

    def put(self, q: Array) -> tuple[Array, Mask]:
        """Projects configurations onto the manifold by Newton's method.

        Args:
            q: start configurations (n, nq) [rad].

        Returns:
            The projected configurations (n, nq) [rad], and a mask (n,) of the successful
            projections within the limits.
        """
        q = np.clip(q, self.q_min, self.q_max)
        for _ in range(SETTINGS.newton_steps):
            error, rows = self._error_and_rows(q)
            if np.abs(error).max(initial=0.0) < SETTINGS.tolerance:
                break
            move = self._towards(error, rows, np.ones_like(q))
            # A joint about to leave its range stays on its limit, and the other joints take over
            # its part.
            held = ((q <= self.q_min) & (move < 0)) | ((q >= self.q_max) & (move > 0))
            if held.any():
                move = self._towards(error, rows, np.where(held, 0.0, 1.0))
            q = np.clip(q + _shortened(move, SETTINGS.longest_newton_step), self.q_min, self.q_max)
        error, _ = self._error_and_rows(q)
        return q, np.asarray(np.abs(error).max(axis=1) < SETTINGS.tolerance)

    def free_joints(self, q: Array) -> list[tuple[int, ...]]:
        """Movable joints at configurations on the manifold, with the pose held.

        Args:
            q: configurations on the manifold, shape (n, nq) [rad].

        Returns:
            Indices of the movable joints per configuration; empty for an isolated configuration.
        """
        _, size, modes = np.linalg.svd(self._error_and_rows(q)[1])
        fixed = (size > SETTINGS.held * size[:, :1]).sum(axis=1)
        moving = [
            np.abs(rows[k:]).max(axis=0, initial=0.0) for rows, k in zip(modes, fixed, strict=True)
        ]
        return [tuple(np.flatnonzero(each > SETTINGS.moving).tolist()) for each in moving]

    def nearest(self, q: Array, to: Array, weights: Array) -> tuple[Array, Mask]:
        """Moves configurations along the manifold towards target configurations.

        Minimises the weighted sum of joint distances locally, by quadratic steps with iteratively
        reweighted joints.

        Args:
            q: configurations (n, nq) on the manifold [rad].
            to: target configurations (n, nq) [rad].
            weights: weights of the joint distances, shape (nq,).

        Returns:
            The configurations (n, nq) [rad], and a mask (n,) of the rows at the pose and within the
            limits.
        """
        for _ in range(SETTINGS.approach_steps):
            error, rows = self._error_and_rows(q)
            remaining = to - q
            ease = np.maximum(np.abs(remaining), SETTINGS.nearest_distance) / weights
            held = np.zeros(q.shape, dtype=bool)
            for _ in range(2):
                pull = np.where(held, 0.0, remaining)
                given = np.where(held, 0.0, ease)
                along = pull - self._towards((rows @ pull[:, :, None])[:, :, 0], rows, given)
                held |= ((q <= self.q_min) & (along < 0)) | ((q >= self.q_max) & (along > 0))
            move = _shortened(along, SETTINGS.longest_approach_step) + _shortened(
                self._towards(error, rows, given), SETTINGS.longest_newton_step
            )
            q = np.clip(q + move, self.q_min, self.q_max)
        return self.put(q)

    def _error_and_rows(self, q: Array) -> tuple[Array, Array]:
        """Twists (n, 6) [m, rad] from q (n, nq) to the pose, to first order, and Jacobians (n, 6,
        nq).

        The Jacobian rows of free rotations are zero.
        """
        frames = link_frames(self.placements, self.coupling.positions(q))
        T = frames[:, -1] @ self.T_last
        rows = self.coupling.on_arm(geometric_jacobian(frames, T[:, :3, 3]))
        error = np.zeros((len(q), 6))
        error[:, :3] = self.pose.position - T[:, :3, 3]
        direction, pointing = self.pose.direction, T[:, :3, :3] @ self.pose.axis
        normal = np.cross(direction, pointing)
        sine = np.linalg.norm(normal, axis=1)
        angle = np.arctan2(sine, pointing @ direction)
        excess = np.maximum(angle - self.pose.half_angle, 0.0)
        unit = normal / np.maximum(sine, SETTINGS.parallel)[:, None]
        error[:, 3:] = -unit * excess[:, None]
        if self.pose.half_angle > 0:
            across = np.where((excess > 0)[:, None, None], unit[:, :, None] * unit[:, None, :], 0.0)
        else:
            across = (np.eye(3) - np.outer(direction, direction))[None]
        rows[:, 3:] = across @ rows[:, 3:]
        return error, rows

    @staticmethod
    def _towards(error: Array, rows: Array, ease: Array) -> Array:
        """Shortest steps (n, nq) with rows · step = error (n, 6), in the metric of the mobilities
        `ease` (n, nq).
        """
        eased = rows * ease[:, None, :]
        system = eased @ rows.transpose(0, 2, 1)
        scale = SETTINGS.damping * np.abs(system).max(axis=(1, 2), initial=1e-12)
        system[:, range(6), range(6)] += scale[:, None] + 1e-14
        solved = np.linalg.solve(system, error[:, :, None])
        return np.asarray((eased.transpose(0, 2, 1) @ solved)[:, :, 0])


def _shortened(move: Array, longest: float) -> Array:
    """Steps (n, nq), scaled so that no joint moves by more than `longest` [rad]."""
    return np.asarray(
        move * np.minimum(1.0, longest / np.maximum(np.abs(move).max(axis=1, keepdims=True), 1e-12))
    )
