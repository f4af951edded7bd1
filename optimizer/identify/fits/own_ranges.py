"""How well the robot's own figures are known before the logs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.models.trust import trust_letters
from joulepath.models.uncertainty.document import covariance_of
from joulepath.models.uncertainty.ranges import lognormal, range_of
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
