"""Stand-ins for a tool and a payload without shapes: a rod up to the TCP, and a ball.

Only links, given shapes and obstacles are kept apart. If the shape of a carried tool or payload is
not given, a motion can be certified although the gripper passes through the table. The stand-ins
detect this on the final motion; they do not constrain it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.models.shape_sizes import SIZES
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.scene import Attachment, Scene, Sphere, capsule_between
from joulepath.optimizer.result.certificate import Clearance


@dataclass(frozen=True)
class StandInSettings:
    """Sizes of the stand-ins. They are small, so that a real body is rarely smaller."""

    tool_radius: float = 0.02
    """Radius of the rod from the flange to the TCP [m]: at most the radius of any usual gripper,
    torch or suction cup.
    """
    payload_density: float = 1500.0
    """Density [kg/m³] of the ball with the payload's mass and centre of mass: typical of plastics,
    or of metal parts with their hollows. Denser parts are smaller balls, but no part is as compact
    as a ball.
    """
    contact: float = 1e-3
    """Depth [m] up to which a contact is not reported: a TCP set down on a surface is that near to
    it.
    """


@dataclass(frozen=True)
class StandIns:
    """Collision model of the stand-ins of an arm and its obstacles, without margins and without the
    links.
    """

    model: CollisionModel
    settings: StandInSettings

    @classmethod
    def of(cls, arm: Arm, settings: StandInSettings | None = None) -> StandIns | None:
        """Stand-ins of an arm; None without obstacles, without missing shapes, or without collision
        checks.
        """
        settings = StandInSettings() if settings is None else settings
        if not (arm.collisions and arm.scene.obstacles):
            return None
        rod, ball = _rod(arm, settings.tool_radius), _ball(arm, settings.payload_density)
        if rod is None and ball is None:
            return None
        scene = Scene([replace(obstacle, margin=0.0) for obstacle in arm.scene.obstacles])
        alone = replace(
            arm,
            robot=replace(arm.robot, capsules=(), hulls=()),
            tool=() if rod is None else (rod,),
            payload=replace(arm.payload, shape=ball),
            scene=scene,
        )
        return cls(CollisionModel(alone), settings)

    def contacts(self, t: Array, q: Array) -> list[Clearance]:
        """Deepest contact of every stand-in at samples q (k, nq) [rad] of a motion, at times t (k,)
        [s].
        """
        distance = self.model.distances_along(q, 0.0)
        deepest = dict[str, Clearance]()
        for column in np.argsort(distance.min(axis=0), kind="stable"):
            row = int(distance[:, column].argmin())
            least = float(distance[row, column])
            if least >= -self.settings.contact:
                break
            pair = self.model.names(int(column))
            deepest.setdefault(pair[1], Clearance(least, least, pair, float(t[row])))
        return list(deepest.values())


def _rod(arm: Arm, radius: float) -> Attachment | None:
    """Rod from the flange to the TCP; None for an arm with a tool, or without a TCP of its own."""
    tcp = arm.T_flange_tcp[:3, 3]
    length = float(np.linalg.norm(tcp))
    if arm.tool or not 2 * SIZES.smallest <= length <= SIZES.largest:
        return None
    radius = min(radius, length / 2)
    return capsule_between(tcp * radius / length, tcp * (1 - radius / length), radius)


def _ball(arm: Arm, density: float) -> Attachment | None:
    """Ball about the payload's centre of mass; None for a payload without mass, or with a shape."""
    payload = arm.payload
    radius = float(np.cbrt(3 * payload.mass / (4 * np.pi * density)))
    if (
        payload.shape is not None
        or not SIZES.smallest <= radius <= SIZES.largest
        or np.abs(payload.com).max() > SIZES.largest
    ):
        return None
    T = np.eye(4)
    T[:3, 3] = payload.com
    return Attachment(Sphere(radius), T)
