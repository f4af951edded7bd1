"""Fits to torques measured by sensors behind the gears.

Such torques contain the dynamics of the links and the load, but neither the rotors nor the friction
of motors and gears. They identify the links and three terms of the sensors: an offset, a gain, and
the small friction of the bearings behind the sensors. Friction and rotors of the drives keep the
values of the robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from joulepath.models.robot import Array, FrictionLaw, Robot
from joulepath.optimizer.identify.arm.fitted_arm import LinkSensor
from joulepath.optimizer.identify.arm.friction_columns import (
    SENSOR_COULOMB,
    SENSOR_GAIN,
    SENSOR_VISCOUS,
)
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name
from joulepath.optimizer.identify.estimates.grouped import solve_bounded
from joulepath.optimizer.identify.fits.block import moving_rows, own_value, terms_of
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.rows.fit_rows import Rows

BEHIND_GEARS = (
    "The torques were measured behind the gears, where rotors and the friction of motors and gears "
    "do not act: log motor currents, or the power of the arm's bus."
)
LIKE_DRIVES = (
    "It is {:.0%} of the Coulomb friction of motor and gears: the torques seem to be those of "
    "the motors. If so, give `torque_side`."
)


@dataclass(frozen=True)
class LinkSideSettings:
    """Settings of the doubts about the place of the measurement."""

    max_bearing_share: float = 0.7
    """Coulomb friction of the bearings behind a sensor over that of motor and gears, above which
    the torque was rather measured at the motor [1]; 0.03 to 0.3 on real Pandas."""


LINK_SIDE = LinkSideSettings()


@dataclass(frozen=True, kw_only=True)
class SensorOptions(IdentificationOptions):
    """Options of a fit to torques behind the gears. No fitted term is a figure of the robot."""

    best_reversal: int
    """Index, among the candidates of the rows, of the distance in which the friction reverses."""

    @property
    def reversal(self) -> int:
        """Index of the best distance."""
        return self.best_reversal

    @property
    def joint_terms(self) -> tuple[str, ...]:
        """Terms of the sensors. The gain is identifiable only with a prior on the links."""
        gain = (SENSOR_GAIN,) if self.refit else ()
        return (SENSOR_COULOMB, SENSOR_VISCOUS, "offset", *gain)

    @property
    def nuisances(self) -> frozenset[str]:
        """All terms."""
        return frozenset(self.joint_terms)


def seen_behind_gears(robot: Robot) -> Robot:
    """The robot without friction and rotors, as observed by sensors behind the gears."""
    zero = np.zeros(robot.nq)
    law = FrictionLaw("sensor", zero, zero, np.ones(robot.nq), zero, robot.friction.knee)
    return replace(
        robot,
        friction_laws={law.name: law},
        drives=replace(robot.drives, rotor_inertia=zero),
    )


def sensor_options(rows: Rows, torque: Array, options: IdentificationOptions) -> SensorOptions:
    """The options of a fit to torques (n, nq) [N·m] behind the gears."""
    given = {each.name: getattr(options, each.name) for each in fields(options)}
    given |= {"fit": ("friction",), "terms": ("offset",), "couplings": ()}
    return SensorOptions(**given, best_reversal=_best_reversal(rows, torque, options))


def _best_reversal(rows: Rows, torque: Array, options: IdentificationOptions) -> int:
    """Index of the distance of reversal with the greatest likelihood of the torques of all joints.

    The links are fitted per joint as well, so that errors of the robot's own inertials do not bias
    the choice.
    """
    assert rows.drags is not None
    cost = np.zeros(rows.drags.shape[2])
    for joint in range(torque.shape[1]):
        use = moving_rows(rows, torque, joint, options.velocity_threshold, ())
        bodies = (
            rows.rigid[use, joint, None] if rows.regressor is None else rows.regressor[use, joint]
        )
        shared = [bodies, rows.v[use, joint, None], np.ones((int(use.sum()), 1))]
        columns, values = np.hstack([*shared, rows.drags[use, joint]]), torque[use, joint]
        gram, moment = columns.T @ columns, columns.T @ values
        count = columns.shape[1] - len(cost)
        for k in range(len(cost)):
            at = [*range(count), count + k]
            found = solve_bounded(gram[np.ix_(at, at)], moment[at])
            error = float(np.sum((values - columns[:, at] @ found) ** 2))
            cost[k] += len(values) * np.log(max(error, np.finfo(float).tiny))
    return int(np.argmin(cost))


def sensor_of(nq: int, names: Sequence[Name], value: Array, reversal: int) -> LinkSensor:
    """Terms of the sensors, from the names and values (p,) of the fitted terms."""
    terms = (SENSOR_COULOMB, SENSOR_VISCOUS, SENSOR_GAIN, "offset")
    parts = {term: np.zeros(nq) for term in terms}
    for (name, joint), found in zip(names, value.tolist(), strict=True):
        if name in parts and joint is not None:
            parts[name][joint] = found
    return LinkSensor(**parts, reversal=reversal)


def with_doubts_about_side(found: Estimate, robot: Robot) -> Estimate:
    """The estimate, with remarks on sensors that measure as much friction as drives have."""
    law, remarks = robot.friction, list(found.remarks or ("",) * len(found.names))
    for k, (name, joint) in enumerate(found.names):
        if name == SENSOR_COULOMB and joint is not None:
            share = float(found.value[k] / max(law.coulomb[joint] + law.curved[joint], 1e-300))
            remarks[k] = LIKE_DRIVES.format(share) if share > LINK_SIDE.max_bearing_share else ""
    return replace(found, remarks=tuple(remarks))


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
