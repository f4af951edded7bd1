"""Limits on where the arm is and how fast it passes: a tool axis within a cone, speeds of the TCP and the elbow.

Each gives shares for configurations and speeds: 1 is on the limit, more breaks it; and the gradients of these shares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from models.robot import Array
from optimizer.exceptions import InvalidProblem
from optimizer.jacobians import direction_jacobian, point_jacobian, velocity_gradient
from optimizer.kinematics import link_frames

# below this a direction's deviation [rad] or a point's speed [m/s] has no gradient to speak of
_AT_REST = 1e-9
# a direction given shorter than this is none; a narrower cone than this [rad] cannot be kept in double precision
LEAST_LENGTH, LEAST_HALF_ANGLE = 1e-6, 1e-3


class Shares(NamedTuple):
    """Shares (n, c) of c limits, and their gradients by q and by v (n, c, nq)."""

    value: Array
    by_q: Array
    by_v: Array


class PathLimit(Protocol):
    """A limit along the path: names of its c shares, and the shares at n states."""

    @property
    def names(self) -> tuple[str, ...]:
        """A name for every share."""
        ...

    def shares(self, frames: Array, q: Array, v: Array) -> Array:
        """Shares (n, c) for frames (n, nq + 1, 4, 4), q and v (n, nq)."""
        ...

    def linearised(self, frames: Array, q: Array, v: Array) -> Shares:
        """The same with gradients."""
        ...


@dataclass(frozen=True)
class Cone:
    """The tool's `axis` (3,) stays within `half_angle` [rad] of `direction` (3,) in the base frame.

    The axis is given in the TCP's frame, and looked at from the last link's (`seen_from`). Both are made unit vectors.
    The share is the angle between them over the half angle. Raises InvalidProblem.
    """

    axis: Array
    direction: Array
    half_angle: float

    names: ClassVar[tuple[str, ...]] = ("tool_cone",)

    def __post_init__(self) -> None:
        for name in ("axis", "direction"):
            vector = np.array(getattr(self, name), dtype=float)
            length = float(np.linalg.norm(vector)) if vector.shape == (3,) else 0.0
            if not (np.isfinite(length) and length > LEAST_LENGTH):
                raise InvalidProblem(f"tool_cone.{name}", f"tool_cone.{name} must be three numbers, not all zero.")
            object.__setattr__(self, name, vector / length)
        if not LEAST_HALF_ANGLE <= self.half_angle <= np.pi:
            raise InvalidProblem(
                "tool_cone.half_angle", f"tool_cone.half_angle must be between {LEAST_HALF_ANGLE} and pi rad."
            )

    def seen_from(self, R: Array) -> Cone:
        """The cone with its axis in another frame, in which R (3, 3) turns it."""
        return replace(self, axis=R @ self.axis)

    def shares(self, frames: Array, q: Array, v: Array) -> Array:
        """Shares (n, 1)."""
        return (self._angle(frames[:, -1, :3, :3] @ self.axis) / self.half_angle)[:, None]

    def linearised(self, frames: Array, q: Array, v: Array) -> Shares:
        """Shares and gradients: the angle grows by -d(cos)/sin."""
        pointing = frames[:, -1, :3, :3] @ self.axis
        angle = self._angle(pointing)
        slope = -(self.direction @ direction_jacobian(frames, pointing))
        by_q = slope / (np.maximum(np.sin(angle), _AT_REST) * self.half_angle)[:, None]
        return Shares((angle / self.half_angle)[:, None], by_q[:, None], np.zeros((*v.shape[:1], 1, v.shape[1])))

    def _angle(self, pointing: Array) -> Array:
        """(n,) [rad]; by atan2, exact near zero and near a half turn too."""
        across = np.linalg.norm(np.cross(pointing, self.direction), axis=1)
        return np.asarray(np.arctan2(across, pointing @ self.direction))


@dataclass(frozen=True)
class PointSpeed:
    """Points (c, 3) [m] fixed to a link, in its frame, move at most at `limit` [m/s] in the base frame."""

    name: str
    link: int
    points: Array
    limit: float

    @cached_property
    def names(self) -> tuple[str, ...]:
        """One name, repeated for every point."""
        return (self.name,) * len(self.points)

    def shares(self, frames: Array, q: Array, v: Array) -> Array:
        """Shares (n, c)."""
        velocities = [point_jacobian(frames, self.link, x) @ v[..., None] for x in self._positions(frames)]
        return np.stack([np.linalg.norm(velocity[..., 0], axis=1) for velocity in velocities], axis=1) / self.limit

    def linearised(self, frames: Array, q: Array, v: Array) -> Shares:
        """Shares and gradients."""
        value, by_q, by_v = [], [], []
        for x in self._positions(frames):
            J = point_jacobian(frames, self.link, x)
            velocity = (J @ v[..., None])[..., 0]
            speed = np.linalg.norm(velocity, axis=1)
            along = (velocity / np.maximum(speed, _AT_REST)[:, None])[:, None]
            value.append(speed)
            by_q.append((along @ velocity_gradient(frames, J, v))[:, 0])
            by_v.append((along @ J)[:, 0])
        return Shares(*(np.stack(each, axis=1) / self.limit for each in (value, by_q, by_v)))

    def _positions(self, frames: Array) -> list[Array]:
        return [frames[:, self.link, :3, :3] @ point + frames[:, self.link, :3, 3] for point in self.points]


@dataclass(frozen=True)
class PathLimits:
    """All limits along the path of one arm whose joints are mounted at `placements` (nq, 4, 4)."""

    placements: Array
    limits: Sequence[PathLimit]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """A name for every share."""
        return tuple(name for limit in self.limits for name in limit.names)

    def shares(self, q: Array, v: Array) -> Array:
        """Shares (n, c) at q, v (n, nq)."""
        frames = link_frames(self.placements, q)
        return np.concatenate([limit.shares(frames, q, v) for limit in self.limits], axis=1)

    def linearised(self, q: Array, v: Array) -> Shares:
        """Shares and gradients at q, v (n, nq)."""
        frames = link_frames(self.placements, q)
        parts = [limit.linearised(frames, q, v) for limit in self.limits]
        return Shares(*(np.concatenate(each, axis=1) for each in zip(*parts, strict=True)))
