"""Path constraints: a cone of tool directions, and limits on the speeds of TCP and elbow.

Each constraint gives ratios value / limit for joint positions and velocities, and their gradients.
A ratio above 1 violates the limit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from joulepath.models.coupling import UNCOUPLED, Coupling
from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.forward import joint_placements, link_frames
from joulepath.optimizer.kinematics.jacobians import (
    direction_jacobian,
    point_jacobian,
    velocity_gradient,
)
from joulepath.optimizer.kinematics.tcp import T_last_tcp
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.tool_cone import ToolCone

REGULAR = 1e-9
"""Angle [rad] or speed [m/s] below which the gradient is kept finite: both have a kink at zero."""


class ConstraintRatios(NamedTuple):
    """Ratios value / limit (n, c) of c constraints at n states, and their gradients (n, c, nq) by q
    and v.
    """

    value: Array
    by_q: Array
    by_v: Array


class PathConstraint(Protocol):
    """Constraint along the path with c ratios."""

    @property
    def names(self) -> tuple[str, ...]:
        """Name of every ratio."""
        ...

    def ratios(self, frames: Array, q: Array, v: Array) -> Array:
        """Ratios (n, c) for link frames (n, nq + 1, 4, 4), q [rad] and v [rad/s] (n, nq)."""
        ...

    def linearised(
        self, frames: Array, q: Array, v: Array, wanted: Mask | None = None
    ) -> ConstraintRatios:
        """Ratios and gradients at the same states; entries outside the mask `wanted` (n, c) may be
        zero.
        """
        ...


@dataclass(frozen=True)
class ToolConeConstraint:
    """Cone constraint of a tool axis.

    The unit vector `axis` (3,), in the frame of the last link, stays within `half_angle` [rad] of
    the unit vector `direction` (3,), in the base frame. The ratio is the angle between them over
    the half angle.
    """

    axis: Array
    direction: Array
    half_angle: float
    coupling: Coupling = UNCOUPLED

    names: ClassVar[tuple[str, ...]] = ("tool_cone",)

    @staticmethod
    def of(arm: Arm, cone: ToolCone) -> ToolConeConstraint:
        """Constraint of an arm's cone, with its axis transformed from the TCP frame to the last
        link.
        """
        return ToolConeConstraint(
            T_last_tcp(arm)[:3, :3] @ cone.axis,
            cone.direction,
            cone.half_angle,
            arm.robot.coupling,
        )

    def ratios(self, frames: Array, q: Array, v: Array) -> Array:
        """Ratios (n, 1) for link frames (n, nq + 1, 4, 4), q [rad] and v [rad/s] (n, nq)."""
        return (self._angle(frames[:, -1, :3, :3] @ self.axis) / self.half_angle)[:, None]

    def linearised(
        self, frames: Array, q: Array, v: Array, wanted: Mask | None = None
    ) -> ConstraintRatios:
        """Ratios and gradients at the same states; the differential of the angle is -d(cos) /
        sin.
        """
        pointing = frames[:, -1, :3, :3] @ self.axis
        angle = self._angle(pointing)
        slope = -self.coupling.on_arm(self.direction @ direction_jacobian(frames, pointing))
        by_q = slope / (np.maximum(np.sin(angle), REGULAR) * self.half_angle)[:, None]
        return ConstraintRatios(
            (angle / self.half_angle)[:, None],
            by_q[:, None],
            np.zeros((*v.shape[:1], 1, v.shape[1])),
        )

    def _angle(self, pointing: Array) -> Array:
        """Angles (n,) [rad] to `direction`, by atan2, accurate near zero and near a half turn."""
        across = np.linalg.norm(np.cross(pointing, self.direction), axis=1)
        return np.asarray(np.arctan2(across, pointing @ self.direction))


@dataclass(frozen=True)
class PointSpeedConstraint:
    """Speed limit [m/s], in the base frame, of points (c, 3) [m] fixed to a link, in its frame."""

    name: str
    link: int
    points: Array
    limit: float
    coupling: Coupling = UNCOUPLED

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The name of the constraint, once per point."""
        return (self.name,) * len(self.points)

    def ratios(self, frames: Array, q: Array, v: Array) -> Array:
        """Ratios (n, c) for link frames (n, nq + 1, 4, 4), q [rad] and v [rad/s] (n, nq)."""
        rates = self.coupling.rates(v)[..., None]
        velocities = [point_jacobian(frames, self.link, x) @ rates for x in self._positions(frames)]
        return (
            np.stack([np.linalg.norm(velocity[..., 0], axis=1) for velocity in velocities], axis=1)
            / self.limit
        )

    def linearised(
        self, frames: Array, q: Array, v: Array, wanted: Mask | None = None
    ) -> ConstraintRatios:
        """Ratios and gradients at the same states."""
        value, by_q, by_v = [], [], []
        v = self.coupling.rates(v)
        for x in self._positions(frames):
            J = point_jacobian(frames, self.link, x)
            velocity = (J @ v[..., None])[..., 0]
            speed = np.linalg.norm(velocity, axis=1)
            along = (velocity / np.maximum(speed, REGULAR)[:, None])[:, None]
            value.append(speed)
            by_q.append(self.coupling.on_arm((along @ velocity_gradient(frames, J, v))[:, 0]))
            by_v.append(self.coupling.on_arm((along @ J)[:, 0]))
        return ConstraintRatios(
            *(np.stack(each, axis=1) / self.limit for each in (value, by_q, by_v))
        )

    def _positions(self, frames: Array) -> list[Array]:
        return [
            frames[:, self.link, :3, :3] @ point + frames[:, self.link, :3, 3]
            for point in self.points
        ]


@dataclass(frozen=True)
class PathConstraints:
    """All path constraints of an arm whose chain has joint placements (n, 4, 4)."""

    placements: Array
    limits: Sequence[PathConstraint]
    coupling: Coupling = UNCOUPLED

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Name of every ratio."""
        return tuple(name for limit in self.limits for name in limit.names)

    @cached_property
    def limit_speeds(self) -> bool:
        """Whether any ratio depends on v; otherwise all depend on q alone."""
        return any(isinstance(limit, PointSpeedConstraint) for limit in self.limits)

    def ratios(self, q: Array, v: Array) -> Array:
        """Ratios (n, c) at q [rad] and v [rad/s] (n, nq)."""
        frames = self._frames(q)
        return np.concatenate([limit.ratios(frames, q, v) for limit in self.limits], axis=1)

    def speed_ratios(self, q: Array, v: Array) -> Array:
        """Largest speed ratio (n,) at q [rad] and v [rad/s] (n, nq); 0 without speed limits."""
        frames, speeds = self._frames(q), np.zeros((len(q), 1))
        limited = [
            each.ratios(frames, q, v)
            for each in self.limits
            if isinstance(each, PointSpeedConstraint)
        ]
        return np.asarray(np.hstack([speeds, *limited]).max(axis=1))

    def linearised(self, q: Array, v: Array, wanted: Mask | None = None) -> ConstraintRatios:
        """Ratios and gradients at q [rad] and v [rad/s] (n, nq).

        Entries outside the mask `wanted` (n, c) may be zero.
        """
        frames = self._frames(q)
        if wanted is None:
            parts = [limit.linearised(frames, q, v) for limit in self.limits]
        else:
            columns = np.split(
                wanted, np.cumsum([len(limit.names) for limit in self.limits])[:-1], axis=1
            )
            parts = [
                limit.linearised(frames, q, v, each)
                for limit, each in zip(self.limits, columns, strict=True)
            ]
        if len(parts) == 1:
            return parts[0]
        return ConstraintRatios(
            *(np.concatenate(each, axis=1) for each in zip(*parts, strict=True))
        )

    def _frames(self, q: Array) -> Array:
        return link_frames(self.placements, self.coupling.positions(q))


def path_constraint_list(arm: Arm) -> list[PathConstraint]:
    """Path constraints of an arm: tool cone, TCP speed, elbow speed."""
    limits: list[PathConstraint] = []
    if arm.tool_cone is not None:
        limits.append(ToolConeConstraint.of(arm, arm.tool_cone))
    if arm.tcp_speed is not None:
        limits.append(
            PointSpeedConstraint(
                "tcp_speed",
                arm.robot.last_link,
                T_last_tcp(arm)[None, :3, 3],
                arm.tcp_speed,
                arm.robot.coupling,
            )
        )
    if arm.elbow_speed is not None and arm.robot.elbow is not None:
        limits.append(
            PointSpeedConstraint(
                "elbow_speed",
                arm.robot.elbow.link,
                arm.robot.elbow.axis,
                arm.elbow_speed,
                arm.robot.coupling,
            )
        )
    return limits


def path_constraints_of(arm: Arm) -> PathConstraints | None:
    """Combined path constraints of an arm; None if it has none."""
    limits, robot = path_constraint_list(arm), arm.robot
    if not limits:
        return None
    return PathConstraints(joint_placements(robot.model), limits, robot.coupling)
