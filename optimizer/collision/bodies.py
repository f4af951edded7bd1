"""Bodies that can collide: convex cores fixed to links, tool, payload and obstacles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.robot import Array
from optimizer.problem.arm import Arm
from optimizer.problem.scene import Core

Indices = np.ndarray[tuple[int, ...], np.dtype[np.intp]]
TOOL, PAYLOAD = "tool", "payload"


@dataclass(frozen=True, eq=False)
class Body:
    """A core fixed to a link (0: the base or the surroundings) at `T_link_core`; kept `margin` [m] away from."""

    name: str
    link: int
    core: Core
    T_link_core: Array
    margin: float = 0.0

    @cached_property
    def points(self) -> Array:
        """The core's points (m, 3) in the link frame."""
        return self.core.points @ self.T_link_core[:3, :3].T + self.T_link_core[:3, 3]

    @property
    def middle(self) -> Array:
        """Centre (3,) of a ball that holds the core, in the link frame."""
        return np.asarray((self.points.min(axis=0) + self.points.max(axis=0)) / 2)

    @property
    def reach(self) -> float:
        """Radius of that ball, the core's own radius left out."""
        return float(np.linalg.norm(self.points - self.middle, axis=1).max()) + self.core.ring

    @property
    def is_segment(self) -> bool:
        """Whether the core is a point or a segment."""
        core = self.core
        return len(core.points) <= 2 and core.ring == 0 and not core.plane


def bodies_of(arm: Arm) -> tuple[Body, ...]:
    """The robot's capsules, then what it carries, then what surrounds it."""
    robot, last = arm.robot, arm.robot.nq
    T_last_flange = robot.T_last_flange
    links = [
        Body(robot.link_names[capsule.link], capsule.link, Core(capsule.axis, capsule.radius), np.eye(4))
        for capsule in robot.capsules
    ]
    carried = [Body(TOOL, last, part.shape.core, T_last_flange @ part.T_flange_shape) for part in arm.tool]
    if arm.payload.shape is not None:
        shape = arm.payload.shape
        carried.append(Body(PAYLOAD, last, shape.shape.core, T_last_flange @ shape.T_flange_shape))
    around = [Body(o.name, 0, o.shape.core, o.T_base_shape, o.margin) for o in arm.scene.obstacles]
    return (*links, *carried, *around)
