"""What a tool and a payload that have no shape would touch: a rod up to the TCP and a ball stand in
for them.

Only links, given shapes and obstacles are kept apart. Where the flange carries a tool or a payload
whose shape is not given, a motion can be certified although the gripper goes through the table. The
stand-ins find this out on the final motion. They constrain nothing.
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
    """Sizes of the bodies that stand in for what has no shape. They are small, so that the real
    body is hardly ever smaller."""

    tool_radius: float = 0.02
    """Radius of the rod from the flange to the TCP [m]: slimmer than any gripper or torch that an
    arm carries, and as slim as the suction cups."""
    payload_density: float = 1500.0
    """Density [kg/m³] of the ball that has the payload's mass and centre: of plastics, or of metal
    parts with the hollows that they have. Denser parts are smaller balls, but no part is as compact
    as a ball."""
    contact: float = 1e-3
    """Depth [m] up to which a contact is not told: a TCP that is set down on a surface is that near
    to it.
    """


@dataclass(frozen=True)
class StandIns:
    """The collision model of the stand-ins of an arm and its obstacles, without margins and without
    the links.
    """

    model: CollisionModel
    settings: StandInSettings

    @classmethod
    def of(cls, arm: Arm, settings: StandInSettings | None = None) -> StandIns | None:
        """The stand-ins; None if there are no obstacles, if nothing lacks a shape, or if no
        collisions are checked.
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
            robot=replace(arm.robot, capsules=()),
            tool=() if rod is None else (rod,),
            payload=replace(arm.payload, shape=ball),
            scene=scene,
        )
        return cls(CollisionModel(alone), settings)

    def contacts(self, t: Array, q: Array) -> list[Clearance]:
        """The deepest contact of each stand-in at samples q (k, nq) [rad] of a motion, at times t
        (k,) [s].
        """
        distance = self.model.along(q, 0.0)
        found = dict[str, Clearance]()
        for column in np.argsort(distance.min(axis=0), kind="stable"):
            row = int(distance[:, column].argmin())
            least = float(distance[row, column])
            if least >= -self.settings.contact:
                break
            pair = self.model.names(int(column))
            found.setdefault(pair[1], Clearance(least, least, pair, float(t[row])))
        return list(found.values())


def _rod(arm: Arm, radius: float) -> Attachment | None:
    """The rod that begins at the flange and ends at the TCP; None for an arm with a tool, or with
    no TCP of its own.
    """
    tcp = arm.T_flange_tcp[:3, 3]
    length = float(np.linalg.norm(tcp))
    if arm.tool or not 2 * SIZES.smallest <= length <= SIZES.largest:
        return None
    radius = min(radius, length / 2)
    return capsule_between(tcp * radius / length, tcp * (1 - radius / length), radius)


def _ball(arm: Arm, density: float) -> Attachment | None:
    """The ball about the payload's centre of mass; None for one without mass, or with a shape of
    its own.
    """
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
