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
from optimizer.arm import Arm
from optimizer.collision import CollisionModel
from optimizer.convex import coal_shape


class FreeSpace:
    """Where an arm's bodies are apart by their margins and `reserve` [m] more, and its tool is within its cone.

    `model` is the arm's own.
    """

    def __init__(self, arm: Arm, model: CollisionModel, reserve: float = 0.0) -> None:
        self._robot = arm.robot.model
        self._data = self._robot.createData()
        self._cone = arm.tool_cone
        if self._cone is not None:
            self._cone = self._cone.seen_from((arm.robot.T_last_flange @ arm.T_flange_tcp)[:3, :3])
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
        cone = self._cone
        if cone is None:
            return True
        pointing = self._data.oMi[self._robot.nq].rotation @ cone.axis
        return bool(pointing @ cone.direction >= math.cos(cone.half_angle))
