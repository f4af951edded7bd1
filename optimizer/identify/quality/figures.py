"""Identified figures, completed by the robot's own, with their covariance; and all parameters that
were sought, beside the robot's own values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet

import numpy as np

from joulepath.models.robot import Array, Mask, Robot
from joulepath.optimizer.dynamics.link_regressor import PARAMETERS_PER_BODY, body_parameters
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm, own_arm
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name
from joulepath.optimizer.identify.fits.base_fit import BaseTerms
from joulepath.optimizer.identify.fits.block import own_value
from joulepath.optimizer.identify.fits.fitting import LINK_MASS_SCALE, FitResult
from joulepath.optimizer.identify.fits.whole_fit import LINK_NAMES
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.quality.interval import Spread
from joulepath.optimizer.identify.quality.structure import inertials_of
from joulepath.optimizer.identify.results import IdentifiedFigures, IdentifiedParameter

DRY = ("coulomb", "viscous", "load", "curved")
LAW = (*DRY, "speed")
"""Figures of the friction law: given for all joints, or not at all."""
INERTIALS = ("mass", "center_of_mass", "inertia")


def figures_of(
    robot: Robot,
    fitted: FitResult,
    spread: Spread,
    options: IdentificationOptions,
    parameters: Sequence[IdentifiedParameter],
    logs: tuple[str, ...],
) -> IdentifiedFigures:
    """Build the figures of a fit, without figures unchanged from the robot's own for all joints.

    Args:
        robot: the robot with its own figures.
        fitted: the fit.
        spread: errors of moves and days.
        options: options of the fit.
        parameters: the parameters, with whether they are identified.
        logs: names of the logs.
    """
    told = {(each.figure, each.joint) for each in parameters if each.identified}
    own, values = _own(robot), _values(robot, fitted, options)
    fitted_names = {figure for figure, _ in fitted.estimate.names}
    identified = {
        name: _identified(
            robot.nq, name, told, name in LAW and name not in fitted_names and value != own[name]
        )
        for name, value in values.items()
    }
    same = {
        name
        for name, value in values.items()
        if name in own and not identified[name].any() and np.array_equal(value, own[name])
    }
    if not same >= set(LAW):
        same -= {*LAW}
    values = {name: value for name, value in values.items() if name not in same}
    if options.knee is not None and "coulomb" in values:
        values["knee"], identified["knee"] = np.array(fitted.arm.knee), np.array(True)
    rows = _told_rows(robot, fitted, parameters, values)
    matrix = np.array([*rows.values()]).reshape(-1, len(fitted.estimate.names))
    covariance = matrix @ fitted.estimate.covariance @ matrix.T
    known = np.flatnonzero(np.diag(covariance) > 0)
    return IdentifiedFigures(
        robot=robot.name,
        values=values,
        identified=identified,
        parameters=tuple([*rows][k] for k in known.tolist()),
        sd=np.sqrt(np.diag(covariance)[known]),
        covariance=covariance[np.ix_(known, known)],
        session_sd=spread.session_sd,
        move_sd=spread.move_sd,
        logs=logs,
    )


def _told_rows(
    robot: Robot,
    fitted: FitResult,
    parameters: Sequence[IdentifiedParameter],
    values: Mapping[str, Array],
) -> dict[Name, Array]:
    """Rows of the map from the errors of the estimate to the errors of the figures.

    Figures kept at the robot's own values have no row. Figures determined only in combination with
    others do have one.
    """
    kept = {
        (each.figure, each.joint)
        for each in parameters
        if not each.identified and each.value == each.previous
    }
    return {
        name: row
        for name, row in _covariance_rows(robot, fitted)
        if (name[0] in values or name[0] in LINK_NAMES) and name not in kept
    }


def _own(robot: Robot) -> dict[str, Array]:
    """The robot's own values of figures of joints and of the idle power."""
    law = {name: getattr(own_arm(robot), name) for name in LAW}
    return law | vars(robot.drives) | {"idle_power": np.array(robot.electronics.idle_power)}


def _values(robot: Robot, fitted: FitResult, options: IdentificationOptions) -> dict[str, Array]:
    """Values of all figures with a fitted part, by name."""
    arm = fitted.arm
    names_fitted = {figure for figure, _ in fitted.estimate.names}
    names: list[str] = [*{"rotor_inertia", "torque_constant"} & names_fitted]
    if names_fitted & set(DRY):
        names += LAW
    values: dict[str, Array] = {name: np.array(getattr(arm, name)) for name in names}
    if "idle_power" in names_fitted:
        values |= _powers(robot, arm)
    if LINK_MASS_SCALE in names_fitted:
        values |= inertials_of(robot, (arm.link_scale - 1) * body_parameters(robot.model))
    if arm.link_change is not None and not options.reduced:
        values |= inertials_of(robot, arm.link_change)
    return values


def _powers(robot: Robot, arm: FittedArm) -> dict[str, Array]:
    """Idle power, and the losses of windings and inverters.

    The power determines only the sum of the idle power and the inverters' constant losses, and the
    sum of all losses with the square of the current: the robot's own inverter keeps its share.
    """
    power, drives = arm.power_parameters, robot.drives
    constants = float(drives.inverter_constant.sum())
    share = min(1.0, power.idle / constants) if constants else 1.0
    quadratic = np.minimum(drives.inverter_quadratic, power.copper)
    return {
        "idle_power": np.array(power.idle - share * constants),
        "inverter_constant": share * drives.inverter_constant,
        "copper": power.copper - quadratic,
        "inverter_quadratic": quadratic,
        "inverter_linear": power.inverter,
    }


def _identified(nq: int, name: str, told: AbstractSet[Name], replaced: Mask | bool) -> Mask:
    """Whether the logs identify a figure, by joint (nq,) or for the whole arm ().

    Args:
        nq: number of joints.
        name: name of the figure.
        told: names of the identified parameters.
        replaced: whether the fitted friction law lacks the figure and thus replaces it by 0.
    """
    if name == "idle_power":
        return np.array((name, None) in told)
    parts = set(LINK_NAMES) if name in INERTIALS else {name}
    found = np.array([any((part, joint) in told for part in parts) for joint in range(nq)])
    if name in INERTIALS:
        return np.asarray(found | ((LINK_MASS_SCALE, None) in told))
    law = np.array([any((part, joint) in told for part in DRY) for joint in range(nq)])
    return np.asarray(found | (law & replaced))


def _covariance_rows(robot: Robot, fitted: FitResult) -> Iterator[tuple[Name, Array]]:
    """Names of the figures, with their derivatives by the estimate, shape (p,)."""
    names = fitted.estimate.names
    for name, row in zip(names, np.eye(len(names)), strict=True):
        if name[0] != LINK_MASS_SCALE:
            yield name, row
            continue
        bodies = body_parameters(robot.model).reshape(-1, PARAMETERS_PER_BODY).tolist()
        for joint, body in enumerate(bodies):
            for part, own in zip(LINK_NAMES, body, strict=True):
                yield (part, joint), own * row


def parameters_of(
    robot: Robot, estimate: Estimate, options: IdentificationOptions
) -> tuple[IdentifiedParameter, ...]:
    """Parameters of an estimate, with a reason for every unidentified parameter."""
    base = BaseTerms.of(robot, [], options) if options.reduced else None
    own = {} if base is None else dict(zip(base.names, base.own.tolist(), strict=True))
    deviations = np.sqrt(np.diag(estimate.covariance)).tolist()
    values, remarks = estimate.value.tolist(), estimate.remarks or ("",) * len(estimate.names)
    previous = [own[n] if n in own else _own_value(robot, n) for n in estimate.names]
    return tuple(
        IdentifiedParameter(name[0], name[1], value, sd, before, not reason, reason or remark)
        for name, value, sd, before, reason, remark in zip(
            estimate.names, values, deviations, previous, estimate.reasons, remarks, strict=True
        )
    )


def _own_value(robot: Robot, name: Name) -> float:
    """The robot's own value of any figure."""
    figure, joint = name
    if figure in LINK_NAMES:
        assert joint is not None
        own = body_parameters(robot.model).reshape(-1, PARAMETERS_PER_BODY)
        return float(own[joint, LINK_NAMES[figure]])
    if figure == LINK_MASS_SCALE:
        return 1.0
    if figure == "idle_power":
        return float(robot.electronics.idle_power)
    return own_value(robot, name)
