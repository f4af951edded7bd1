"""Fits to torques that sensors measure behind the gears.

Such torques carry links and load, but neither rotors nor the friction of motors and gears. They
identify links, and what the sensors themselves add: an offset, and the small friction of the
bearings behind them. Friction and rotors of the drives stay the robot's own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from joulepath.models.robot import FrictionLaw, Robot
from joulepath.optimizer.identify.arm.fitted_arm import LinkSensor
from joulepath.optimizer.identify.choices import Term
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name
from joulepath.optimizer.identify.fits.block import own_value, terms_of
from joulepath.optimizer.identify.options import IdentificationOptions

SENSOR = "sensor_"
"""Prefix of the friction that sensors behind the gears see."""
SENSOR_TERMS: tuple[Term, ...] = ("coulomb", "viscous", "offset")
BEHIND_GEARS = (
    "The torques were measured behind the gears, where rotors and the friction of motors and gears "
    "do not act: log motor currents, or the power of the arm's bus."
)


def seen_behind_gears(robot: Robot) -> Robot:
    """The robot as sensors behind its gears see it: without friction and rotors."""
    zero = np.zeros(robot.nq)
    law = FrictionLaw("sensor", zero, zero, np.ones(robot.nq), zero, robot.friction.knee)
    return replace(
        robot,
        friction_laws={law.name: law},
        drives=replace(robot.drives, rotor_inertia=zero),
    )


def sensor_options(options: IdentificationOptions) -> IdentificationOptions:
    """The options of a fit to torques behind the gears."""
    return replace(options, fit=("friction",), terms=SENSOR_TERMS, couplings=())


def as_sensor_terms(found: Estimate) -> Estimate:
    """The estimate with the friction of the sensors named as such."""
    names = tuple(
        (SENSOR + term if term in SENSOR_TERMS[:2] else term, joint) for term, joint in found.names
    )
    return replace(found, names=names)


def sensor_of(nq: int, names: tuple[Name, ...], value: np.ndarray) -> LinkSensor:
    """What sensors see beside the bodies, from fitted terms with values (p,)."""
    parts = {term: np.zeros(nq) for term in SENSOR_TERMS}
    for (name, joint), found in zip(names, value.tolist(), strict=True):
        term = name.removeprefix(SENSOR)
        if term in parts and joint is not None:
            parts[term][joint] = found
    return LinkSensor(**parts)


def kept_drives(robot: Robot, clusters: int, options: IdentificationOptions) -> Estimate:
    """Requested friction and rotors at the robot's own values, with the reason."""
    terms = [term for term in terms_of(options) if term != "offset"]
    names: tuple[Name, ...] = tuple((term, joint) for joint in range(robot.nq) for term in terms)
    value = np.array([own_value(robot, name) for name in names])
    return Estimate(
        names=names,
        value=value,
        replicates=np.tile(value, (clusters, 1)),
        reasons=(BEHIND_GEARS,) * len(names),
        prior_covariance=np.zeros((len(names),) * 2),
    )
