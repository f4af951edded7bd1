"""Fits to torques that sensors measure behind the gears.

Such torques carry links and load, but neither rotors nor the friction of motors and gears. They
identify links, and what the sensors themselves add: an offset, a gain, and the small friction of
the bearings behind them. Friction and rotors of the drives stay the robot's own.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from joulepath.models.robot import FrictionLaw, Robot
from joulepath.optimizer.identify.arm.fitted_arm import LinkSensor
from joulepath.optimizer.identify.arm.friction_columns import (
    SENSOR_COULOMB,
    SENSOR_GAIN,
    SENSOR_VISCOUS,
)
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name
from joulepath.optimizer.identify.fits.block import own_value, terms_of
from joulepath.optimizer.identify.options import IdentificationOptions

BEHIND_GEARS = (
    "The torques were measured behind the gears, where rotors and the friction of motors and gears "
    "do not act: log motor currents, or the power of the arm's bus."
)


@dataclass(frozen=True, kw_only=True)
class SensorOptions(IdentificationOptions):
    """Options of a fit to torques behind the gears, none of whose terms is a figure of the
    robot."""

    @property
    def joint_terms(self) -> tuple[str, ...]:
        """Terms of the sensors. Only the robot's own links tell their gains from other links."""
        gain = (SENSOR_GAIN,) if self.refit else ()
        return (SENSOR_COULOMB, SENSOR_VISCOUS, "offset", *gain)

    @property
    def nuisances(self) -> frozenset[str]:
        """All terms."""
        return frozenset(self.joint_terms)


def seen_behind_gears(robot: Robot) -> Robot:
    """The robot as sensors behind its gears see it: without friction and rotors."""
    zero = np.zeros(robot.nq)
    law = FrictionLaw("sensor", zero, zero, np.ones(robot.nq), zero, robot.friction.knee)
    return replace(
        robot,
        friction_laws={law.name: law},
        drives=replace(robot.drives, rotor_inertia=zero),
    )


def sensor_options(options: IdentificationOptions) -> SensorOptions:
    """The options of a fit to torques behind the gears."""
    given = {each.name: getattr(options, each.name) for each in fields(options)}
    return SensorOptions(**given | {"fit": ("friction",), "terms": ("offset",), "couplings": ()})


def sensor_of(nq: int, names: tuple[Name, ...], value: np.ndarray) -> LinkSensor:
    """What sensors see beside the bodies, from fitted terms with values (p,)."""
    parts = {each.name: np.zeros(nq) for each in fields(LinkSensor)}
    for (name, joint), found in zip(names, value.tolist(), strict=True):
        if name in parts and joint is not None:
            parts[name][joint] = found
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
