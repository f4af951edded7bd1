"""Whether an arm hits anything, one configuration at a time and quickly: the collision model handed to Pinocchio.

`CollisionModel` measures distances at many configurations at once, which a planner that asks one after the other cannot
use; Pinocchio and Coal answer yes or no in tens of microseconds.
"""

from __future__ import annotations

import math

import coal
import numpy as np
import pinocchio as pin

from models.robot import Array
from optimizer.collision.coal_distance import coal_shape
from optimizer.collision.model import CollisionModel
from optimizer.kinematics.tcp import T_last_tcp
from optimizer.problem.arm import Arm


class FreeSpace:
    """Where an arm's bodies are apart by their margins and `reserve` [m] more, and its tool is within its cone.

    `model` is the arm's own.
    """

    def __init__(self, arm: Arm, model: CollisionModel, reserve: float = 0.0) -> None:
        self._robot = arm.robot.model
        self._data = self._robot.createData()
        self._cone = arm.tool_cone
        # the cone's axis in the last link's frame
        self._axis = None if self._cone is None else T_last_tcp(arm)[:3, :3] @ self._cone.axis
        self._geometry = pin.GeometryModel()
        skins = []
        for number, body in enumerate(model.bodies):
            if body.core.plane:
                shape, skin, local = coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0), 0.0, np.eye(4)
            else:
                shape, skin, T = coal_shape(body.core)
                local = np.eye(4)
                local[:3, :3], local[:3, 3] = T.getRotation(), T.getTranslation()
            skins.append(skin)
            # names need only differ
            placed = pin.SE3(body.T_link_core @ local)
            self._geometry.addGeometryObject(pin.GeometryObject(str(number), body.link, placed, shape))
        for first, second in model.pairs.tolist():
            self._geometry.addCollisionPair(pin.CollisionPair(first, second))
        self._found = pin.GeometryData(self._geometry)
        for request, (first, second) in zip(self._found.collisionRequests, model.pairs.tolist(), strict=True):
            grown = [model.bodies[k].core.radius + model.bodies[k].margin - skins[k] for k in (first, second)]
            request.security_margin = sum(grown) + reserve
            request.enable_contact = False

    def free(self, q: Array) -> bool:
        """Whether q (nq,) [rad] is clear."""
        if pin.computeCollisions(self._robot, self._data, self._geometry, self._found, q, True):
            return False
        # the collisions left the links' places in the data
        if self._cone is None:
            return True
        pointing = self._data.oMi[self._robot.nq].rotation @ self._axis
        return bool(pointing @ self._cone.direction >= math.cos(self._cone.half_angle))
