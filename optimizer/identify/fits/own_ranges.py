"""How well the robot's own figures, and the parameters of its links, are known before the logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.models.trust import trust_letters
from joulepath.models.uncertainty.document import covariance_of
from joulepath.models.uncertainty.ranges import lognormal, range_of
from joulepath.optimizer.dynamics.link_regressor import PARAMETERS_PER_BODY, body_parameters
from joulepath.optimizer.identify.estimates.estimate import Name

_FRICTION = ("coulomb", "viscous", "curved")


def own_range(robot: Robot, name: str, section: str, figure: str) -> tuple[float, float]:
    """P5 and P95 of a factor on a figure of the robot."""
    return range_of(name, trust_letters(robot.figures.get(section, {}).get(figure)))


def friction_width(robot: Robot, name: str) -> float:
    """Relative standard deviation of the robot's own friction, common or joint by joint."""
    letters = trust_letters(robot.figures.get("friction_laws", {}).get(robot.friction.name))
    return lognormal(*range_of(name, letters))[1]


def rotor_width(robot: Robot) -> float:
    """Relative standard deviation of the robot's own rotor inertias."""
    return lognormal(*own_range(robot, "rotor_inertia", "drives", "rotor_inertia"))[1]


def own_deviations(robot: Robot, names: Sequence[Name], own: Array) -> Array:
    """Standard deviations (p,) of the robot's own friction and rotors; 0 of all other terms.

    Figures from earlier logs have the deviations of their document, all others those of the ranges
    for their trust letters.

    Args:
        robot: the robot with its own figures.
        names: names of the terms.
        own: the robot's own values (p,).
    """
    known, law = covariance_of(robot.figures), robot.friction.name
    told = dict[tuple[str, int] | None, float]()
    if known is not None:
        places = (known.place_of(name, law) for name in known.names)
        told = dict(zip(places, np.sqrt(np.diag(known.matrix)).tolist(), strict=True))
    friction = [friction_width(robot, each) for each in ("friction_common", "friction_joint")]
    widths = dict.fromkeys(_FRICTION, float(np.linalg.norm(friction)))
    widths["rotor_inertia"] = rotor_width(robot)
    return np.array(
        [
            told.get((term, -1 if joint is None else joint), widths[term] * value)
            if term in widths
            else 0.0
            for (term, joint), value in zip(names, own.tolist(), strict=True)
        ]
    )


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
