"""Errors of the robot's own link parameters before any log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.dynamics.link_regressor import PARAMETERS_PER_BODY, body_parameters


@dataclass(frozen=True)
class LinkErrorSettings:
    """Assumed standard deviations of the robot's own link parameters."""

    mass: float = 0.1
    """Standard deviation of a mass over the mass [1]."""
    center_of_mass: float = 0.02
    """Standard deviation of a centre of mass [m]."""
    inertia: float = 0.3
    """Standard deviation of an inertia over the inertia [1]."""
    floor: float = 1e-6
    """Smallest standard deviation of a parameter [SI unit]."""


LINK_ERRORS = LinkErrorSettings()


def link_deviations(robot: Robot, settings: LinkErrorSettings = LINK_ERRORS) -> Array:
    """Standard deviations (10 nq,) of the parameters of the moving bodies, in Pinocchio's order."""
    deviations = list[Array]()
    for body in body_parameters(robot.model).reshape(-1, PARAMETERS_PER_BODY):
        mass = body[0]
        inertia = (body[4] + body[6] + body[9]) / 2 + settings.center_of_mass**2 * mass
        of_body = np.concatenate(
            [
                [settings.mass * mass],
                [settings.center_of_mass * mass] * 3,
                [settings.inertia * inertia] * 6,
            ]
        )
        deviations.append(np.maximum(of_body, settings.floor))
    return np.concatenate(deviations)
