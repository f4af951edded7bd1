"""State validity checks for the path planner: one configuration at a time, by Pinocchio and Coal.

`CollisionModel` computes distances at many configurations at once. A planner checks one
configuration after the other and only needs its validity: this takes tens of microseconds here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import coal
import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Body
from joulepath.optimizer.collision.coal_distance import COAL, coal_shape
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.kinematics.tcp import T_last_tcp
from joulepath.optimizer.problem.arm import Arm


class StateValidityChecker:
    """Checks that all bodies keep their margins and an additional `reserve` [m], and that the tool
    axis is within its cone.

    `model` is the collision model of the arm.
    """

    def __init__(self, arm: Arm, model: CollisionModel, reserve: float = 0.0) -> None:
        self._robot = arm.robot.model
        self._data = self._robot.createData()
        self._cone = arm.tool_cone
        # Tool axis in the frame of the last link.
        self._axis = None if self._cone is None else T_last_tcp(arm)[:3, :3] @ self._cone.axis
        self._geometry = pin.GeometryModel()
        skins = [self._add(number, body) for number, body in enumerate(model.bodies)]
        self._clouds, self._model, self._reserve = (
            np.flatnonzero(model.geometry.is_cloud),
            model,
            reserve,
        )
        pairs = model.pairs[~model.geometry.is_cloud].tolist()
        for first, second in pairs:
            self._geometry.addCollisionPair(pin.CollisionPair(first, second))
        self._geometry_data = pin.GeometryData(self._geometry)
        for request, pair in zip(self._geometry_data.collisionRequests, pairs, strict=True):
            growth = [model.bodies[k].core.radius + model.bodies[k].margin - skins[k] for k in pair]
            request.security_margin = sum(growth) + reserve
            request.enable_contact = False
        # Of hundreds of pairs a few are near, and a tree of the bodies' bounding boxes leaves out
        # the others. It reads the security margins when it is built.
        self._manager = pin.BroadPhaseManager_DynamicAABBTreeCollisionManager(
            self._robot, self._geometry, self._geometry_data
        )

    def is_valid(self, q: Array) -> bool:
        """Whether q (nq,) [rad] is collision-free with its margins, and within the tool cone."""
        chain = self._model.coupling.positions(q)
        if pin.computeCollisions(self._robot, self._data, self._manager, chain, True):
            return False
        if len(self._clouds) and self._hits_cloud(q):
            return False
        if self._cone is None:
            return True
        # computeCollisions has updated the joint placements.
        tool_axis = self._data.oMi[self._robot.nq].rotation @ self._axis
        return bool(tool_axis @ self._cone.direction >= math.cos(self._cone.half_angle))

    def _hits_cloud(self, q: Array) -> bool:
        """Whether a body is nearer to a part of a cloud than allowed, by the cloud's own tree."""
        frames = self._model.frames(q[None])
        least = self._model.pair_distances(frames, self._clouds, self._reserve).distance.min()
        return bool(least < self._reserve)

    def _add(self, number: int, body: Body) -> float:
        """Adds a body to the geometry, and returns the growth [m] of Coal's shape beyond the
        core.
        """
        T, skin = np.eye(4), 0.0
        shape: coal.CollisionGeometry
        if body.cloud is not None:
            # The cloud's own tree checks it; this placeholder keeps the number of the body.
            shape = coal.Sphere(COAL.skin)
        elif body.core.is_half_space:
            shape = coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
        else:
            shape, skin, transform = coal_shape(body.core)
            T[:3, :3], T[:3, 3] = transform.getRotation(), transform.getTranslation()
        # Pinocchio needs distinct names, but names of bodies may repeat.
        placement = pin.SE3(body.T_link_core @ T)
        self._geometry.addGeometryObject(
            pin.GeometryObject(str(number), body.link, placement, shape)
        )
        return skin


@dataclass(frozen=True)
class ValidityCheckers:
    """Checkers of an arm by their reserves, each built on first use, since this takes
    milliseconds.
    """

    arm: Arm
    model: CollisionModel
    _made: dict[float, StateValidityChecker] = field(default_factory=dict, repr=False)

    def __getitem__(self, reserve: float) -> StateValidityChecker:
        if reserve not in self._made:
            self._made[reserve] = StateValidityChecker(self.arm, self.model, reserve)
        return self._made[reserve]
