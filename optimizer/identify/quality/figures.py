"""Identified figures, completed by the robot's own, with their covariance."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.models.uncertainty.parameters import LINKS
from joulepath.optimizer.dynamics.link_regressor import PARAMETERS_PER_BODY, body_parameters
from joulepath.optimizer.identify.estimates.estimate import Name
from joulepath.optimizer.identify.fits.fitting import LINK_MASS_SCALE, FitResult
from joulepath.optimizer.identify.fits.whole_fit import LINK, LINK_NAMES
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.quality.interval import Spread
from joulepath.optimizer.identify.quality.structure import inertials_of
from joulepath.optimizer.identify.results import IdentifiedFigures

FRICTION_LAW = ("coulomb", "viscous", "load", "curved")
"""Figures of the friction law: given for all joints, or not at all."""


def figures_of(
    robot: Robot,
    fitted: FitResult,
    spread: Spread,
    options: IdentificationOptions,
    logs: tuple[str, ...],
) -> IdentifiedFigures:
    """Figures of a fit.

    Args:
        robot: the robot with its own figures.
        fitted: the fit.
        spread: errors of moves and days.
        options: options of the fit.
        logs: names of the logs.
    """
    values = _values(robot, fitted, options)
    # figures that the logs determine only together with others are part of the covariance, too
    rows = {
        name: row
        for name, row in _covariance_rows(robot, fitted)
        if name[0] in values or name[0] in LINK_NAMES
    }
    matrix = np.array([*rows.values()])
    covariance = matrix @ fitted.estimate.covariance @ matrix.T
    known = np.flatnonzero(np.diag(covariance) > 0)
    return IdentifiedFigures(
        robot=robot.name,
        values=values,
        parameters=tuple([*rows][k] for k in known.tolist()),
        sd=np.sqrt(np.diag(covariance)[known]),
        covariance=covariance[np.ix_(known, known)],
        session_sd=spread.session_sd,
        move_sd=spread.move_sd,
        logs=logs,
    )


def _values(robot: Robot, fitted: FitResult, options: IdentificationOptions) -> dict[str, Array]:
    """Values of all figures with a fitted part, by name."""
    arm = fitted.arm
    names_fitted = {figure for figure, _ in fitted.estimate.names}
    names = [
        name for name in (*FRICTION_LAW, "rotor_inertia", "torque_constant") if name in names_fitted
    ]
    if names_fitted & set(FRICTION_LAW):
        names += [name for name in (*FRICTION_LAW, "speed") if name not in names]
    values = {name: np.array(getattr(arm, name)) for name in names}
    if "idle_power" in names_fitted:
        power = arm.power_parameters
        values |= {"idle_power": np.array(power.idle), "copper": power.copper}
        values["inverter_linear"] = power.inverter
    if LINK_MASS_SCALE in names_fitted:
        values |= inertials_of(robot, (arm.link_scale - 1) * body_parameters(robot.model))
    if arm.link_change is not None and not options.reduced:
        values |= inertials_of(robot, arm.link_change)
    return values


def _covariance_rows(robot: Robot, fitted: FitResult) -> Iterator[tuple[Name, Array]]:
    """Names of the figures, each with its row (p,) of derivatives by the estimate (p,)."""
    names = fitted.estimate.names
    for name, row in zip(names, np.eye(len(names)), strict=True):
        if name[0] != LINK_MASS_SCALE:
            yield name, row
            continue
        bodies = body_parameters(robot.model).reshape(-1, PARAMETERS_PER_BODY).tolist()
        for joint, body in enumerate(bodies):
            for part, own in zip(LINKS, body, strict=True):
                yield (LINK + part, joint), own * row
