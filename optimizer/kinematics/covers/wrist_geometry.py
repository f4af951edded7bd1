"""Bounds on a chain whose last three joints may be anywhere while its TCP reaches a position.

The last three joints, the wrist, determine the orientation of the tool. The joints before them, the
inner joints, determine the position of the wrist: the origin of its first joint. The bounds hold
for every chain of revolute joints with at least one inner joint. They are exact for a point and
conservative over a box of inner joint positions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.forward import joint_placements, link_frames
from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
from joulepath.optimizer.kinematics.tcp import T_last_tcp
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose

WRIST_JOINTS = 3
"""Number of the last joints that count as the wrist."""


@dataclass(frozen=True)
class ShellSettings:
    """Sampling of the distance from wrist to TCP."""

    reach_angles: int = 240
    """Number of sampled angles of each of the last two joints; a margin covers the angles
    between.
    """
    rounding: float = 1e-9
    """Margin of distances for rounding [m]."""
    anchors: tuple[float, ...] = (0.0, -0.05, 0.05, -0.1, 0.1, -0.2, 0.2, -0.3, 0.3)
    """Positions, from the TCP, of points on the tool's axis whose distance from the wrist is
    bounded if a cone constrains the axis [m].
    """


SETTINGS = ShellSettings()


@dataclass(frozen=True)
class Shell:
    """Spherical shell of the wrist: between `least` and `most` [m] from `centre` (3,) in the base
    frame.
    """

    centre: Array
    least: float
    most: float


@dataclass(frozen=True)
class WristBody:
    """Link beyond the wrist."""

    mass: float
    """Mass [kg]."""
    reach: float
    """Largest distance of its centre of mass from the wrist [m]."""
    least_potential: float
    """Smallest potential that the goal allows [J/kg]."""


@dataclass(frozen=True)
class WristGeometry:
    """Chain of an arm, divided into inner joints and wrist; `model` includes payload and
    gravity.
    """

    arm: Arm
    model: pin.Model

    @classmethod
    def of(cls, arm: Arm) -> WristGeometry | None:
        """Geometry of an arm; None for a chain without an inner joint."""
        if arm.robot.nq <= WRIST_JOINTS or arm.robot.coupling.follows:
            return None
        return cls(arm, rigid_body_model(arm))

    @property
    def inner(self) -> int:
        """Number of inner joints."""
        return self.arm.robot.nq - WRIST_JOINTS

    @property
    def gravity(self) -> Array:
        """Acceleration (3,) of gravity in the base frame [m/s²]."""
        return np.asarray(self.arm.gravity)

    @cached_property
    def placements(self) -> Array:
        """Poses (nq, 4, 4) of the joints, each in the frame of the previous link."""
        return joint_placements(self.model)

    @cached_property
    def levers(self) -> Array:
        """Largest distance (inner,) [m] of the wrist from the origin of each inner joint."""
        lengths = np.linalg.norm(self.placements[1 : self.inner + 1, :3, 3], axis=1)
        return np.asarray(np.cumsum(lengths[::-1])[::-1])

    @cached_property
    def potential_rates(self) -> Array:
        """Largest derivative (inner,) [J/rad] of the inner links' potential energy by each inner
        joint.
        """
        return potential_rates(self.model, self.gravity, self.inner)

    def placed(self, q: Array) -> tuple[Array, Array]:
        """Position of the wrist, and potential energy of the inner links.

        Args:
            q: inner joint positions, shape (b, inner) [rad].

        Returns:
            The positions (b, 3) [m] and the energies (b,) [J].
        """
        frames = link_frames(self.placements[: self.inner], q)
        potential = np.zeros(len(q))
        for j in range(1, self.inner + 1):
            body, T = self.model.inertias[j], frames[:, j]
            potential -= body.mass * (T[:, :3, :3] @ body.lever + T[:, :3, 3]) @ self.gravity
        return (frames[:, -1] @ self.placements[self.inner])[:, :3, 3], potential

    @cached_property
    def _wrist_lengths(self) -> Array:
        """Distances (2,) [m] from the first joint of the wrist to the second, and from the second
        to the third.
        """
        return np.asarray(np.linalg.norm(self.placements[self.inner + 1 :, :3, 3], axis=1))

    def shells(self, pose: ConeOrientedPose) -> list[Shell]:
        """Shells of the wrist for a TCP at the pose.

        A point on the tool's axis, at s from the TCP, lies within 2 |s| sin(half_angle / 2) of its
        position with the axis along the cone's direction. The wrist's first joint does not change
        the distance of this point from its own origin.
        """
        tcp, lengths = T_last_tcp(self.arm), self._wrist_lengths
        angles = 2 * np.pi * np.arange(SETTINGS.reach_angles) / SETTINGS.reach_angles
        turns = link_frames(np.eye(4)[None], angles[:, None])[:, 1]
        last_two = self.placements[self.inner + 1] @ turns @ self.placements[self.inner + 2]
        shells = []
        for s in SETTINGS.anchors if pose.half_angle < np.pi / 2 else (0.0,):
            anchor = tcp[:3, 3] + s * (tcp[:3, :3] @ pose.axis)
            rotated = np.append(anchor, 1.0) @ turns.transpose(0, 2, 1)
            reach = np.linalg.norm((rotated @ last_two.transpose(0, 2, 1))[..., :3], axis=-1)
            length = float(np.linalg.norm(anchor))
            slack = (
                np.pi / SETTINGS.reach_angles * (2 * length + float(lengths[1])) + SETTINGS.rounding
            )
            slack += 2 * abs(s) * float(np.sin(pose.half_angle / 2))
            centre = pose.position + s * pose.direction
            shells.append(Shell(centre, float(reach.min()) - slack, float(reach.max()) + slack))
        return shells

    def bodies(self, pose: ConeOrientedPose) -> list[WristBody]:
        """Links beyond the wrist, for a TCP at the pose."""
        T, lengths = T_last_tcp(self.arm), self._wrist_lengths
        g, strength = self.gravity, float(np.linalg.norm(self.gravity))
        tcp = float(np.linalg.norm(T[:3, 3]))
        bodies = [self.model.inertias[k] for k in range(self.inner + 1, self.arm.robot.nq + 1)]
        levers = [float(np.linalg.norm(body.lever)) for body in bodies]
        at_goal = -float(pose.position @ g)
        # The last body is fixed in the TCP frame: its axis can tilt no further than the cone
        # allows.
        offset = T[:3, :3].T @ (bodies[-1].lever - T[:3, 3])
        along = float(offset @ pose.axis)
        across = float(np.linalg.norm(offset - along * pose.axis))
        tilt = 2 * float(np.sin(pose.half_angle / 2))
        upright = -along * float(pose.direction @ g) - strength * (abs(along) * tilt + across)
        least = [
            at_goal - strength * (levers[0] + float(lengths.sum()) + tcp),
            at_goal - strength * (levers[1] + float(lengths[1]) + tcp),
            at_goal + max(upright, -strength * float(np.linalg.norm(offset))),
        ]
        reach = [levers[k] + float(lengths[:k].sum()) for k in range(len(bodies))]
        return [
            WristBody(body.mass, far, low)
            for body, far, low in zip(bodies, reach, least, strict=True)
        ]


def greatest_rates(arm: Arm) -> Array:
    """Largest derivative (nq,) [J/rad] of the potential energy by each joint of an arm."""
    rates = potential_rates(rigid_body_model(arm), np.asarray(arm.gravity))
    return arm.robot.coupling.most_on_arm(rates)


def potential_rates(model: pin.Model, gravity: Array, links: int | None = None) -> Array:
    """Largest derivative (links,) [J/rad] of the potential energy of the first links by each of
    their joints.

    The centre of mass of a link is no farther from an earlier joint than the path through the
    joints' origins between them plus its own lever.

    Args:
        model: Pinocchio model.
        gravity: acceleration of gravity, shape (3,) [m/s²].
        links: number of links; by default all.
    """
    count = model.nq if links is None else links
    lengths = np.linalg.norm(joint_placements(model)[1:count, :3, 3], axis=1)
    rates = np.zeros(count)
    for k in range(count):
        body = model.inertias[k + 1]
        for j in range(k + 1):
            rates[j] += body.mass * (float(np.linalg.norm(body.lever)) + float(lengths[j:k].sum()))
    return np.asarray(rates * float(np.linalg.norm(gravity)))
