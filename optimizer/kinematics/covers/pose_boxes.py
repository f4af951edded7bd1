"""Boxes of joint positions, narrowed to the configurations that reach a pose with a partly free
orientation.

For q in a box with middle c and half sides h, let δ = q - c. The TCP is at p(q) = p(c) + J δ + r
with |r| ≤ 1/2 Σ_jk L_max(j,k) h_j h_k. The columns of J are z_j × (p - o_j), and L_j bounds the
distance of the TCP from the origin o_j of joint j: the second derivative of p by q_j and q_k, j ≤
k, is z_j × (z_k × (p - o_k)). Likewise the tool's axis is a(q) = a(c) + A δ + s with columns z_j ×
a and |s| ≤ 1/2 (Σ_j h_j)², and lies within 2 sin(half_angle / 2) of the cone's direction.

So J δ = e - r, with e the error of the middle, is a linear system with a bounded right-hand side.
For any matrix P, with M = P J, M_jj δ_j = (P e)_j - (P r)_j - Σ_{k≠j} M_jk δ_k gives an interval
for δ_j (the Krawczyk operator without its restriction to square systems; Neumaier, Interval methods
for systems of equations, 1990, chapter 5). A box with an empty interval holds no configuration that
reaches the pose. A joint that moves neither the TCP nor the tool's axis has h = 0 in these bounds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.coupling import Coupling
from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.covers.wrist_geometry import potential_rates
from joulepath.optimizer.kinematics.forward import joint_placements, link_frames
from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
from joulepath.optimizer.kinematics.tcp import T_last_tcp
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose


@dataclass(frozen=True)
class PoseBoxSettings:
    """Settings of the narrowing."""

    rounding: float = 1e-9
    """Margin of intervals for rounding [rad]."""
    damping: float = 1e-6
    """Addition to the diagonal of J Jᵀ [m²]: P is near the pseudoinverse, and bounded where J loses
    its rank.
    """
    least_diagonal: float = 1e-6
    """Smallest diagonal element of M by which an interval is divided."""
    widest_cone: float = np.pi / 2
    """Half angle of a cone below which the tool's axis is bounded, too [rad]; a wider cone leaves
    the axis nearly free.
    """


SETTINGS = PoseBoxSettings()


@dataclass(frozen=True)
class Placed:
    """Arm at the middles of b boxes, in the base frame."""

    axes: Array
    """Joint axes, shape (b, nq, 3)."""
    origins: Array
    """Origins of the joints, shape (b, nq, 3) [m]."""
    tcp: Array
    """Position of the TCP, shape (b, 3) [m]."""
    tool_axis: Array
    """Tool's axis, shape (b, 3)."""
    centres: Array
    """Centre of mass of each link, shape (b, nq, 3) [m]."""


@dataclass(frozen=True)
class PoseBoxes:
    """Narrowing of boxes of joint positions (b, nq) [rad] to a pose, for every chain of revolute
    joints.
    """

    arm: Arm
    pose: ConeOrientedPose

    @cached_property
    def _placements(self) -> Array:
        return joint_placements(rigid_body_model(self.arm))

    @cached_property
    def _rates(self) -> Array:
        return potential_rates(rigid_body_model(self.arm), np.asarray(self.arm.gravity))

    @property
    def _coupling(self) -> Coupling:
        return self.arm.robot.coupling

    @cached_property
    def _bodies(self) -> tuple[Array, Array]:
        """Mass (nq,) [kg] and centre of mass (nq, 3) [m], in its own frame, of each link."""
        bodies = list(rigid_body_model(self.arm).inertias)[1:]
        return np.array([body.mass for body in bodies]), np.array([body.lever for body in bodies])

    @cached_property
    def _T_last_tcp(self) -> Array:
        return T_last_tcp(self.arm)

    @cached_property
    def levers(self) -> Array:
        """Largest path (nq,) [m/rad] of the TCP by each joint."""
        return self._coupling.most_on_arm(self._lengths)

    @cached_property
    def _lengths(self) -> Array:
        """Largest distance (n,) [m] of the TCP from the origin of each joint of the chain."""
        lengths = np.linalg.norm(self._placements[1:, :3, 3], axis=1)
        steps = np.append(lengths, np.linalg.norm(self._T_last_tcp[:3, 3]))
        return np.asarray(np.cumsum(steps[::-1])[::-1])

    @cached_property
    def free(self) -> Mask:
        """Mask (nq,) of the joints that move neither the TCP nor the tool's axis: the last one, if
        both lie on its axis.
        """
        free = np.zeros(len(self.levers), dtype=bool)
        across = np.hypot(*self._T_last_tcp[:2, 3])
        tilted = np.hypot(*(self._T_last_tcp[:3, :3] @ self.pose.axis)[:2])
        on_axis = across < SETTINGS.rounding and self._coupling.has_free_end
        free[-1] = on_axis and (
            tilted < SETTINGS.rounding or self.pose.half_angle >= SETTINGS.widest_cone
        )
        return free

    def placed(self, q: Array) -> Placed:
        """Arm at q (b, nq) [rad]."""
        frames = link_frames(self._placements, self._coupling.positions(q))[:, 1:]
        tcp = frames[:, -1] @ self._T_last_tcp
        centres = (
            np.einsum("bjxy,jy->bjx", frames[..., :3, :3], self._bodies[1]) + frames[..., :3, 3]
        )
        return Placed(
            frames[..., :3, 2],
            frames[..., :3, 3],
            tcp[:, :3, 3],
            tcp[:, :3, :3] @ self.pose.axis,
            centres,
        )

    def narrowed(self, centre: Array, half: Array) -> tuple[Array, Array, Mask]:
        """Narrows boxes to the configurations that reach the pose.

        Args:
            centre: middles of the boxes, shape (b, nq) [rad].
            half: half sides, shape (b, nq) [rad].

        Returns:
            Middles and half sides (b, nq) [rad] of boxes within the given ones that hold all these
            configurations, and a mask (b,) of the non-empty boxes.
        """
        at = self.placed(centre)
        J, error, slack = self._system(at, half)
        # Damped pseudoinverse; the narrowing holds for any matrix.
        P = np.linalg.solve(
            J @ J.transpose(0, 2, 1) + SETTINGS.damping * np.eye(J.shape[1]), J
        ).transpose(0, 2, 1)
        M = P @ J
        diagonal = np.einsum("bjj->bj", M)
        safe = diagonal > SETTINGS.least_diagonal
        divisor = np.where(safe, diagonal, 1.0)
        beside = np.einsum("bjk,bk->bj", np.abs(M), half) - np.abs(diagonal) * half
        blurred = np.einsum("bjm,bm->bj", np.abs(P), slack)
        middle = np.einsum("bjm,bm->bj", P, error) / divisor
        reach = (beside + blurred) / divisor + SETTINGS.rounding
        low = np.where(safe, np.maximum(-half, middle - reach), -half)
        high = np.where(safe, np.minimum(half, middle + reach), half)
        # Each equation by itself.
        possible = (
            np.abs(error) <= np.einsum("bmj,bj->bm", np.abs(J), half) + slack + SETTINGS.rounding
        ).all(axis=1)
        possible &= (low <= high).all(axis=1)
        return centre + (low + high) / 2, np.maximum(high - low, 0.0) / 2, possible

    def _system(self, at: Placed, half: Array) -> tuple[Array, Array, Array]:
        """Linear system of the boxes.

        Returns:
            J (b, m, nq), the error (b, m) of the middles, and a bound (b, m) of the remainder of
            each row.
        """
        arms, half = at.tcp[:, None] - at.origins, np.where(self.free, 0.0, half)
        J, half = np.cross(at.axes, arms).transpose(0, 2, 1), self._coupling.reaches(half)
        J = self._coupling.on_arm(J)
        error = self.pose.position - at.tcp
        slack = np.repeat(second_order(self._lengths, half)[:, None], 3, axis=1)
        if self.pose.half_angle >= SETTINGS.widest_cone:
            return J, error, slack
        tilt = np.cross(at.axes, at.tool_axis[:, None]).transpose(0, 2, 1)
        tilt = self._coupling.on_arm(tilt)
        chord = 2 * np.sin(self.pose.half_angle / 2)
        turned = second_order(np.ones(half.shape[1]), half) + chord
        return (
            np.concatenate([J, tilt], axis=1),
            np.concatenate([error, self.pose.direction - at.tool_axis], axis=1),
            np.concatenate([slack, np.repeat(turned[:, None], 3, axis=1)], axis=1),
        )

    def least_potential(self, centre: Array, half: Array) -> Array:
        """Lower bound (b,) [J] of the potential energy in boxes: by the gradient in the middle, or
        by the levers.
        """
        at, (masses, _) = self.placed(centre), self._bodies
        g = np.asarray(self.arm.gravity)
        potential = -(at.centres @ g) @ masses
        # Σ_{i ≥ j} m_i (c_i - o_j), and -g · (z_j × this sum)
        beyond = np.cumsum((masses[:, None] * at.centres)[:, ::-1], axis=1)[:, ::-1]
        beyond = beyond - np.cumsum(masses[::-1])[::-1, None] * at.origins
        gradient = self._coupling.on_arm(-np.cross(at.axes, beyond) @ g)
        rates, reaches = self._rates, self._coupling.reaches(half)
        fall = np.minimum(
            np.einsum("bj,bj->b", np.abs(gradient), half) + second_order(rates, reaches),
            reaches @ rates,
        )
        return np.asarray(potential - fall)


def second_order(levers: Array, half: Array) -> Array:
    """Bound 1/2 Σ_jk lever_max(j,k) h_j h_k (b,) of second-order terms in boxes of half sides
    (b, nq).
    """
    # Σ_j lever_j h_j (h_j + 2 Σ_{k<j} h_k)
    before = np.cumsum(half, axis=1) - half
    return np.asarray(0.5 * ((half + 2 * before) * half) @ levers)
