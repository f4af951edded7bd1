"""The figure whose better measurement would reduce the uncertainty of energies most.

If a figure were known, the variance of the energy would fall by the share of their squared
correlation. Errors of figures compensate each other, so the term of a single figure in the variance
can exceed the whole variance and is no measure.

The standard deviation of a figure falls with the square root of the time in motion: halving it
takes four times the moves (Verdonck 2004, Radkhah 2007: the excitation determines how well a log
determines a figure).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.models.uncertainty.parameters import index
from joulepath.models.uncertainty.spread import spread_of
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.estimates.estimate import Name
from joulepath.optimizer.identify.fits.fitting import LINK_MASS_SCALE, FitResult
from joulepath.optimizer.identify.results import Advice
from joulepath.optimizer.identify.rows.fit_rows import Rows

_LOGGING_ADVICE = {
    "coulomb": "Log slow and fast moves of this joint, in both directions.",
    "viscous": "Log moves of this joint near its greatest speed.",
    "load": "Log slow moves of this joint with the arm stretched out and folded, or with a "
    "payload.",
    "curved": "Log moves of this joint at several constant speeds.",
    "rotor_inertia": "Log moves in which this joint speeds up as fast as it may.",
    "idle_power": "Log some seconds of rest, and the power of the arm's bus.",
    "copper": "Log the arm at rest stretched out and folded, with its power: the current that "
    "holds it differs.",
    LINK_MASS_SCALE: "Log moves that lift the arm and lower it, with its power; or its currents or "
    "torques.",
    "inverter_linear": "Log the arm at rest in poses of different load, with its power.",
}
_OF_DRIVES = ("coulomb", "viscous", "curved", "load", "rotor_inertia")
_BEHIND_GEARS = (
    "Log motor currents, or the power of the arm's bus: torques that were measured behind the "
    "gears contain neither friction nor rotors."
)


@dataclass(frozen=True)
class AdviceSettings:
    """Settings of the advice."""

    step: float = 1e-4
    """Step of a figure for finite differences of the energy [SI unit]."""


ADVICE = AdviceSettings()


def advice_of(robot: Robot, fitted: FitResult, rows: Rows) -> Advice | None:
    """The figure to measure better for motions like those of the rows; None without variance."""
    names, covariance = fitted.estimate.names, fitted.estimate.covariance
    of_links = rows.link_side and not np.isfinite(rows.power).any()
    if of_links:
        names, covariance = _own_errors(robot)
    known = [k for k, (name, _) in enumerate(names) if name in _LOGGING_ADVICE]
    gradient = np.array([energy_derivative(fitted.arm, rows, *names[k]) for k in known])
    part = covariance[np.ix_(known, known)]
    with_energy, total = part @ gradient, float(gradient @ part @ gradient)
    if not np.isfinite(total) or total <= 0:
        return None
    own = np.diag(part)
    shares = np.where(own > 0, with_energy**2 / np.where(own > 0, own * total, 1.0), 0.0)
    worst = int(np.argmax(shares))
    name, joint = names[known[worst]]
    do = _BEHIND_GEARS if of_links and name in _OF_DRIVES else _LOGGING_ADVICE[name]
    return Advice(name, joint, float(shares[worst]), do)


def _own_errors(robot: Robot) -> tuple[tuple[Name, ...], Array]:
    """Names of the figures that the links' torques do not identify, and the covariance (k, k) of
    the robot's own values."""
    figures = (*_OF_DRIVES, "copper", "inverter_linear")
    names: list[Name] = [("idle_power", None)]
    names += [(figure, joint) for figure in figures for joint in range(robot.nq)]
    at = [0 if joint is None else index(name, joint, robot.nq) for name, joint in names]
    parts = spread_of(robot, robot.friction.name).covariances.values()
    return tuple(names), np.asarray(sum(parts))[np.ix_(at, at)]


def energy_derivative(arm: FittedArm, rows: Rows, name: str, joint: int | None) -> float:
    """Derivative of the energy [J] of the rows by one figure, by finite differences."""
    changed = _changed(arm, name, joint, ADVICE.step)
    return (changed.energy(rows) - arm.energy(rows)) / ADVICE.step


def _changed(arm: FittedArm, name: str, joint: int | None, step: float) -> FittedArm:
    """The arm with one figure larger by a step."""
    figures = arm.power_parameters
    if name == LINK_MASS_SCALE:
        return replace(arm, link_scale=arm.link_scale + step)
    if joint is None:
        return replace(arm, power_parameters=replace(figures, idle=figures.idle + step))
    if name == "copper":
        copper = _increased(figures.copper, joint, step)
        return replace(arm, power_parameters=replace(figures, copper=copper))
    if name == "inverter_linear":
        inverter = _increased(figures.inverter, joint, step)
        return replace(arm, power_parameters=replace(figures, inverter=inverter))
    changed: dict[str, Any] = {name: _increased(getattr(arm, name), joint, step)}
    return replace(arm, **changed)


def _increased(values: Array, joint: int, step: float) -> Array:
    result = values.copy()
    result[joint] += step
    return result
