"""Links with an inertia impossible for any body, as published by some makers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Robot

LINK = 4
# of link 4 in the maker's file of the Panda: the largest moment is 9 % above the sum of the others
TENSOR = np.array(
    [
        [0.00784585566, -0.00339591957, 0.00158704074],
        [-0.00339591957, 0.00649543136, -0.00181477884],
        [0.00158704074, -0.00181477884, 0.01003079917],
    ]
)


def with_impossible_link(robot: Robot) -> Robot:
    """The robot with an inertia of link 4 impossible for any body."""
    model = robot.model.copy()
    body = model.inertias[LINK]
    model.inertias[LINK] = pin.Inertia(body.mass, body.lever, TENSOR)
    return replace(robot, model=model)
