"""How far the robot's own links may be from the real ones, before any log."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.dynamics.link_regressor import BODY, body_parameters

# standard deviations of a link: of mass over mass, of the centre of mass [m], of inertia over
# inertia
LINK_MASS, LINK_COM, LINK_INERTIA = 0.1, 0.02, 0.3
# of any parameter, at least [SI]
LEAST = 1e-6


def link_deviations(robot: Robot) -> Array:
    """Standard deviations (10 nq,) of the parameters of the moving bodies, in Pinocchio's order."""
    deviations = list[Array]()
    for body in body_parameters(robot.model).reshape(-1, BODY):
        inertia = (body[4] + body[6] + body[9]) / 2 + LINK_COM**2 * body[0]
        parts = [LINK_MASS * body[0]], [LINK_COM * body[0]] * 3, [LINK_INERTIA * inertia] * 6
        deviations.append(np.maximum(np.concatenate(parts), LEAST))
    return np.concatenate(deviations)
