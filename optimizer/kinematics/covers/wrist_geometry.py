"""Bounds on where a chain can be if it reaches a position with its last three joints in any
position.

These three joints, the wrist, decide the orientation of the tool. The joints before them, the inner
ones, decide where the wrist is: the origin of its first joint. The bounds hold for every chain of
revolute joints with at least one inner joint. They are exact for a point and conservative over a
box of inner joint positions.
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

OUTER = 3
# angles of each of the last two joints at which the distance from wrist to TCP is sampled; a margin
# covers the rest
REACH_ANGLES = 240
# rounding of these distances [m]
ROUNDING = 1e-9
# points on the axis of the pose, from the TCP [m], whose distance from the wrist is bounded if a
# cone holds the axis
ANCHORS = (0.0, -0.05, 0.05, -0.1, 0.1, -0.2, 0.2, -0.3, 0.3)


@dataclass(frozen=True)
class Shell:
    """The wrist lies between `least` and `most` [m] from `centre` (3,) in the base frame."""

    centre: Array
    least: float
    most: float


@dataclass(frozen=True)
class WristBody:
    """A link beyond the wrist: mass [kg], greatest distance [m] of its centre of mass from the
    wrist, and the least potential [J/kg] that the goal leaves it."""

    mass: float
    reach: float
    least_potential: float


@dataclass(frozen=True)
class WristGeometry:
    """An arm's chain, split into inner joints and wrist. `model` holds payload and gravity, as
    Pinocchio has them.
    """

    arm: Arm
    model: pin.Model

    @classmethod
    def of(cls, arm: Arm) -> WristGeometry | None:
        """The arm's chain; None for a chain without an inner joint."""
        return cls(arm, rigid_body_model(arm)) if arm.robot.nq > OUTER else None

    @property
    def inner(self) -> int:
        """Number of inner joints."""
        return self.arm.robot.nq - OUTER

    @property
    def gravity(self) -> Array:
        """Acceleration (3,) of gravity in the base frame [m/s²]."""
        return np.asarray(self.arm.gravity)

    @cached_property
    def placements(self) -> Array:
        """Of each joint in the one before, with all joints at zero (nq, 4, 4)."""
        return joint_placements(self.model)

    @cached_property
    def levers(self) -> Array:
        """Greatest distance (inner,) of the wrist from each inner joint's origin [m]."""
        lengths = np.linalg.norm(self.placements[1 : self.inner + 1, :3, 3], axis=1)
        return np.asarray(np.cumsum(lengths[::-1])[::-1])

    @cached_property
    def potential_rates(self) -> Array:
        """Greatest change (inner,) of the inner links' potential energy with each inner joint
        [J/rad].
        """
        return potential_rates(self.model, self.gravity, self.inner)

    def placed(self, q: Array) -> tuple[Array, Array]:
        """Wrist (b, 3) [m] and potential energy (b,) [J] of the inner links at inner joint
        positions q (b, inner).
        """
        frames = link_frames(self.placements[: self.inner], q)
        potential = np.zeros(len(q))
        for j in range(1, self.inner + 1):
            body, T = self.model.inertias[j], frames[:, j]
            potential -= body.mass * (T[:, :3, :3] @ body.lever + T[:, :3, 3]) @ self.gravity
        return (frames[:, -1] @ self.placements[self.inner])[:, :3, 3], potential

    @cached_property
    def _wrist_lengths(self) -> Array:
        """Distances (2,) [m] from the wrist's first joint to its second, and from this one to its
        third.
        """
        return np.asarray(np.linalg.norm(self.placements[self.inner + 1 :, :3, 3], axis=1))

    def shells(self, pose: ConeOrientedPose) -> list[Shell]:
        """Where the wrist lies if the TCP is at the pose.

        A point on the pose's axis, s from the TCP, lies within 2 |s| sin(half_angle / 2) of its
        place with the axis along the direction. The wrist's first joint does not change the
        distance of this point from its own origin.
        """
        tcp, lengths = T_last_tcp(self.arm), self._wrist_lengths
        angles = 2 * np.pi * np.arange(REACH_ANGLES) / REACH_ANGLES
        turns = link_frames(np.eye(4)[None], angles[:, None])[:, 1]
        last_two = self.placements[self.inner + 1] @ turns @ self.placements[self.inner + 2]
        shells = []
        for s in ANCHORS if pose.half_angle < np.pi / 2 else (0.0,):
            anchor = tcp[:3, 3] + s * (tcp[:3, :3] @ pose.axis)
            rotated = np.append(anchor, 1.0) @ turns.transpose(0, 2, 1)
            reach = np.linalg.norm((rotated @ last_two.transpose(0, 2, 1))[..., :3], axis=-1)
            length = float(np.linalg.norm(anchor))
            slack = np.pi / REACH_ANGLES * (2 * length + float(lengths[1])) + ROUNDING
            slack += 2 * abs(s) * float(np.sin(pose.half_angle / 2))
            centre = pose.position + s * pose.direction
            shells.append(Shell(centre, float(reach.min()) - slack, float(reach.max()) + slack))
        return shells

    def bodies(self, pose: ConeOrientedPose) -> list[WristBody]:
        """The links beyond the wrist, if the TCP is at the pose."""
        T, lengths = T_last_tcp(self.arm), self._wrist_lengths
        g, strength = self.gravity, float(np.linalg.norm(self.gravity))
        tcp = float(np.linalg.norm(T[:3, 3]))
        bodies = [self.model.inertias[k] for k in range(self.inner + 1, self.arm.robot.nq + 1)]
        levers = [float(np.linalg.norm(body.lever)) for body in bodies]
        at_goal = -float(pose.position @ g)
        # the last body is fixed in the TCP frame: along the axis it cannot rotate further than the
        # cone allows
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


def potential_rates(model: pin.Model, gravity: Array, links: int | None = None) -> Array:
    """Greatest change (links,) [J/rad] of the potential energy of the first `links` links with each
    of their joints.

    A link's centre of mass is no farther from an earlier joint than the joints' origins between
    them and its own lever. `links` is by default every link; `gravity` (3,) is in m/s².
    """
    count = model.nq if links is None else links
    lengths = np.linalg.norm(joint_placements(model)[1:count, :3, 3], axis=1)
    rates = np.zeros(count)
    for k in range(count):
        body = model.inertias[k + 1]
        for j in range(k + 1):
            rates[j] += body.mass * (float(np.linalg.norm(body.lever)) + float(lengths[j:k].sum()))
    return np.asarray(rates * float(np.linalg.norm(gravity)))
