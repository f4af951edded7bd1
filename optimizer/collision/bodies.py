"""Bodies that can collide: convex cores fixed to the links, to the flange (tool, payload) and to
the base (scene).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from joulepath.models.robot import MOST_ROBOTS, Array, Robot
from joulepath.optimizer.collision.clouds import Cloud, cloud_of
from joulepath.optimizer.collision.cores import Core, core_of
from joulepath.optimizer.collision.cores import Indices as Indices
from joulepath.optimizer.problem.arm import PAYLOAD, TOOL, Arm
from joulepath.optimizer.problem.clouds import Cloud as CloudShape
from joulepath.optimizer.problem.clouds import Points
from joulepath.optimizer.problem.scene import Attachment, Obstacle

COVER_SPHERES = 4
"""Number of spheres that cover a body."""


@dataclass(frozen=True, eq=False)
class Body:
    """Core at `T_link_core` (4, 4) in the frame of a link; the base and the scene have link 0.

    Other bodies must keep a distance of at least `margin` [m]. `touches` are the links that the
    body touches by design. A body with `is_hull` is a hull of a link or tool: it is compared with
    obstacles in place of the capsules of this name and link. A body with a `cloud` is its patch
    `patch`; the core is then only a box around it, with the radius of its parts.
    """

    name: str
    link: int
    core: Core
    T_link_core: Array
    margin: float = 0.0
    touches: frozenset[int] = frozenset()
    is_hull: bool = False
    cloud: Cloud | None = None
    patch: int = 0

    @cached_property
    def points(self) -> Array:
        """Points (m, 3) [m] of the core in the link frame."""
        return self.core.points @ self.T_link_core[:3, :3].T + self.T_link_core[:3, 3]

    @cached_property
    def ball_centre(self) -> Array:
        """Centre (3,) [m] of a ball around the core, in the link frame."""
        return np.asarray((self.points.min(axis=0) + self.points.max(axis=0)) / 2)

    @cached_property
    def ball_radius(self) -> float:
        """Radius [m] of the ball around the core; the radius of the core is not included."""
        return (
            float(np.linalg.norm(self.points - self.ball_centre, axis=1).max())
            + self.core.disc_radius
        )

    @cached_property
    def cover(self) -> tuple[Array, float]:
        """Centres (COVER_SPHERES, 3) [m] of the covering spheres in the link frame, and their
        radius [m].

        The spheres of a moving body without discs stand in a row along its longest principal axis.
        For any other body, they coincide.
        """
        middle, points = self.ball_centre, self.points - self.ball_centre
        if self.link > 0 and self.core.disc_radius == 0:
            axis = np.linalg.svd(points, full_matrices=False)[2][0]
            along = points @ axis
            low, length = along.min(), np.ptp(along)
            across = np.linalg.norm(points - along[:, None] * axis, axis=1).max()
            radius = float(np.hypot(length / (2 * COVER_SPHERES), across))
            if radius < self.ball_radius:
                fractions = (np.arange(COVER_SPHERES) + 0.5) / COVER_SPHERES
                return middle + (low + fractions * length)[:, None] * axis, radius
        return np.tile(middle, (COVER_SPHERES, 1)), self.ball_radius

    @property
    def is_segment(self) -> bool:
        """Whether the core is a point or a segment."""
        core = self.core
        return (
            self.cloud is None
            and len(core.points) <= 2
            and core.disc_radius == 0
            and not core.is_half_space
        )


def bodies_of(arm: Arm) -> tuple[Body, ...]:
    """Bodies of an arm: the capsules of the robot, then tool and payload, then the hulls of robot
    and tool if any of them is compared, then the obstacles of the scene.
    """
    robot, last = arm.robot, arm.robot.last_link
    T_last_flange = robot.T_last_flange
    capsules, hulls = _bodies_of_links(robot)
    parts = [(TOOL, part) for part in arm.tool]
    if arm.payload.shape is not None:
        parts.append((PAYLOAD, arm.payload.shape))
    attached = [
        Body(
            name,
            last,
            core_of(p.shape),
            T_last_flange @ p.T_flange_shape,
            touches=_touched(p, robot),
            is_hull=p.is_hull,
        )
        for name, p in parts
    ]
    of_tool = [body for body in attached if not body.is_hull]
    hulls = [*hulls, *(body for body in attached if body.is_hull)]
    obstacles = [body for obstacle in arm.scene.obstacles for body in _bodies_of_obstacle(obstacle)]
    compared = robot.links_by_hulls or obstacles
    return (*capsules, *of_tool, *(hulls if compared else ()), *obstacles)


@lru_cache(MOST_ROBOTS)
def _bodies_of_links(robot: Robot) -> tuple[list[Body], list[Body]]:
    """The capsules and the hulls of a robot's links."""
    names, stand = robot.link_names, np.eye(4)
    return (
        [Body(names[c.link], c.link, Core(c.axis, c.radius), stand) for c in robot.capsules],
        [
            Body(names[h.link], h.link, Core(h.points, h.radius), stand, is_hull=True)
            for h in robot.hulls
        ],
    )


def _bodies_of_obstacle(obstacle: Obstacle) -> list[Body]:
    """The obstacle as one body, or the patches of its cloud."""
    shape = obstacle.shape
    if not isinstance(shape, CloudShape):
        return [Body(obstacle.name, 0, core_of(shape), obstacle.T_base_shape, obstacle.margin)]
    cloud, radius = cloud_of(shape), shape.radius if isinstance(shape, Points) else 0.0
    return [
        Body(
            obstacle.name,
            0,
            Core(cloud.box(patch), radius),
            obstacle.T_base_shape,
            obstacle.margin,
            cloud=cloud,
            patch=patch,
        )
        for patch in cloud.patches
    ]


def _touched(part: Attachment, robot: Robot) -> frozenset[int]:
    """Links that a tool or payload touches by design: the declared links, by default the link with
    the flange.
    """
    names = robot.link_names
    return frozenset(
        [robot.last_link] if part.touches is None else [names.index(name) for name in part.touches]
    )
