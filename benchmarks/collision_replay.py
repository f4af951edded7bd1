"""Replays of a motion by Pinocchio and Coal: the number of samples in collision, for the bodies of
the collision model or for the meshes of the links.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

import coal
import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Body
from joulepath.optimizer.collision.coal_distance import COAL, coal_shape
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.motion.spline import Spline, sample
from joulepath.optimizer.problem.arm import TOOL, Arm


def collisions(arm: Arm, spline: Spline, period: float) -> int:
    """Number of samples of a motion in collision; the samples are `period` [s] apart."""
    replay = CollisionReplay(arm, CollisionModel(arm))
    t = np.append(np.arange(0.0, spline.duration, period), spline.duration)
    return sum(replay.collides(q) for q in sample(spline, t)[0])


def mesh_collisions(
    arm: Arm, meshes: Mapping[int, Sequence[Array]], spline: Spline, period: float
) -> int:
    """Number of samples of a motion at which a mesh of a link or a part of the tool overlaps an
    obstacle. Point clouds do not count as obstacles, and margins are ignored.

    Args:
        arm: arm with its tool and scene.
        meshes: triangles (t, 3, 3) [m] of the meshes of each moving link, in its frame.
        spline: the motion.
        period: period of the samples [s].
    """
    geometry, model = pin.GeometryModel(), CollisionModel(arm)
    moving, obstacles = list[tuple[int, float]](), list[tuple[int, float]]()
    for link, of_link in meshes.items():
        for k, triangles in enumerate(of_link):
            mesh = pin.GeometryObject(f"{link} {k}", link, pin.SE3.Identity(), _surface(triangles))
            moving.append((geometry.addGeometryObject(mesh), 0.0))
    # the tool is represented by its hulls if it has any, or else by its capsules
    has_hulls = any(part.is_hull for part in arm.tool)
    for number, body in enumerate(model.bodies[len(arm.robot.capsules) :]):
        if body.link == 0 or (body.name == TOOL and body.is_hull == has_hulls):
            growth = body.core.radius
            if _add(geometry, f"body {number}", body):
                # Coal ignores a negative margin of a mesh, so the radius has the growth.
                geometry.geometryObjects[geometry.ngeoms - 1].geometry.radius, growth = growth, 0.0
            (moving if body.link else obstacles).append((geometry.ngeoms - 1, growth))
    pairs = list(product(obstacles, moving))
    for (first, _), (second, _) in pairs:
        geometry.addCollisionPair(pin.CollisionPair(first, second))
    data, robot = pin.GeometryData(geometry), arm.robot.model
    for request, ((_, one), (_, other)) in zip(data.collisionRequests, pairs, strict=True):
        request.security_margin = one + other
    manager = pin.BroadPhaseManager_DynamicAABBTreeCollisionManager(robot, geometry, data)
    t = np.append(np.arange(0.0, spline.duration, period), spline.duration)
    chain, of_robot = arm.robot.coupling.positions(sample(spline, t)[0]), robot.createData()
    return sum(pin.computeCollisions(robot, of_robot, manager, q, True) for q in chain)


def _surface(triangles: Array) -> coal.CollisionGeometry:
    """A bounding volume hierarchy of Coal over triangles (t, 3, 3) [m]."""
    mesh = coal.BVHModelOBBRSS()
    mesh.beginModel(len(triangles), 3 * len(triangles))
    for corners in triangles:
        mesh.addTriangle(*corners)
    mesh.endModel()
    return mesh


class CollisionReplay:
    """The bodies and the checked pairs of a collision model, in Pinocchio and Coal.

    Bodies keep their margins and an additional `reserve` [m].
    """

    def __init__(self, arm: Arm, model: CollisionModel, reserve: float = 0.0) -> None:
        self._robot = arm.robot.model
        self._data = self._robot.createData()
        self._geometry = pin.GeometryModel()
        skins = [
            _add(self._geometry, str(number), body) for number, body in enumerate(model.bodies)
        ]
        self._clouds = np.flatnonzero(model.geometry.is_cloud)
        self._model, self._reserve = model, reserve
        pairs = model.pairs[~model.geometry.is_cloud].tolist()
        for first, second in pairs:
            self._geometry.addCollisionPair(pin.CollisionPair(first, second))
        self._geometry_data = pin.GeometryData(self._geometry)
        for request, pair in zip(self._geometry_data.collisionRequests, pairs, strict=True):
            growth = [model.bodies[k].core.radius + model.bodies[k].margin - skins[k] for k in pair]
            request.security_margin = sum(growth) + reserve
            request.enable_contact = False
        # The manager reads the security margins in its constructor.
        self._manager = pin.BroadPhaseManager_DynamicAABBTreeCollisionManager(
            self._robot, self._geometry, self._geometry_data
        )

    def collides(self, q: Array) -> bool:
        """Whether a pair of bodies is closer than allowed at q (nq,) [rad]."""
        chain = self._model.coupling.positions(q)
        if pin.computeCollisions(self._robot, self._data, self._manager, chain, True):
            return True
        return len(self._clouds) > 0 and self._hits_cloud(q)

    def _hits_cloud(self, q: Array) -> bool:
        """Whether a body is closer to a point cloud than allowed, by the tree of the cloud."""
        frames = self._model.frames(q[None])
        least = self._model.pair_distances(frames, self._clouds, self._reserve).distance.min()
        return bool(least < self._reserve)


def _add(geometry: pin.GeometryModel, name: str, body: Body) -> float:
    """Adds a body under a name, and returns the growth [m] of Coal's shape beyond the core."""
    T, skin = np.eye(4), 0.0
    shape: coal.CollisionGeometry
    if body.cloud is not None:
        # `_hits_cloud` checks clouds; this placeholder keeps the indices of the bodies.
        shape = coal.Sphere(COAL.skin)
    elif body.core.is_half_space:
        shape = coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
    else:
        shape, skin, transform = coal_shape(body.core)
        T[:3, :3], T[:3, 3] = transform.getRotation(), transform.getTranslation()
    # Pinocchio needs distinct names, and the names of bodies may repeat.
    placement = pin.SE3(body.T_link_core @ T)
    geometry.addGeometryObject(pin.GeometryObject(name, body.link, placement, shape))
    return skin
