"""Methods of identification by name: their requirements on the logs, and their fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from joulepath.models.robot import Robot
from joulepath.models.trust import trust_letters
from joulepath.models.uncertainty.ranges import ENGINEERING
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.errors import MethodNotApplicable
from joulepath.optimizer.identify.fits.fitting import FitResult, fit_rows
from joulepath.optimizer.identify.fits.periodic import cut_into_periods
from joulepath.optimizer.identify.fits.temperature import (
    TEMPERATURE,
    at_reference,
    temperatures_of,
)
from joulepath.optimizer.identify.fits.threshold import thresholds_of, without_slow_efforts
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.rows.fit_rows import Rows


def prepare(
    robot: Robot, logs: Sequence[Log], options: IdentificationOptions
) -> tuple[list[Log], IdentificationOptions]:
    """Prepare logs and options for the method of the options.

    With `refit` None, the links are refitted if the method is `automatic`, no payload is requested
    and a log has torques measured behind the gears. With `constants` None, torque constants are
    fitted if all logs have currents and a known payload, and the masses of the links have a source.

    Returns:
        The logs with the channels of the method, and the options without None in `refit` and
        `constants`.

    Raises:
        MethodNotApplicable: the logs lack a channel or a property required by the method.
        InvalidProblem: the options lack the period of the method `periodic`.
    """
    missing = _missing_requirement(logs, options)
    if missing:
        raise MethodNotApplicable(options.method, missing)
    if options.refit is None:
        keeps = options.method != "automatic" or "payload" in options.fit
        refit = not keeps and any(_behind_gears(log) for log in logs)
        options = replace(options, refit=refit)
    if options.constants is None:
        options = replace(options, constants=_constants_are_told(robot, logs, options))
    if options.method == "motor_current":
        return [*logs], replace(
            options, fit=tuple(dict.fromkeys((*options.fit, "torque_constant")))
        )
    if options.method == "electrical_power":
        return [replace(log, effort=None, effort_meaning=None) for log in logs], options
    if options.method == "periodic":
        if options.period is None:
            raise InvalidProblem(
                "period", "The method periodic needs the period of the motion: give `period` in s."
            )
        return [cut_into_periods(log, options.period) for log in logs], options
    return [*logs], options


def fit_by_method(robot: Robot, rows: Rows, options: IdentificationOptions) -> FitResult:
    """Fit the rows of prepared logs by the method of the options."""
    fitted = fit_rows(robot, rows, options)
    if options.method == "threshold_velocity":
        found = thresholds_of(fitted.arm, rows, fitted.arm.motor_torque(rows))
        thresholds = np.maximum(found, options.velocity_threshold)
        fast_rows = without_slow_efforts(rows, thresholds)
        return replace(fit_rows(robot, fast_rows, options), thresholds=thresholds)
    if options.method == "temperature":
        for _ in range(TEMPERATURE.passes):
            torque = fitted.arm.motor_torque(rows)
            warm = temperatures_of(
                rows, torque, fitted.arm, fitted.clusters, options.velocity_threshold
            )
            fitted = fit_rows(robot, at_reference(rows, fitted.arm, warm), options)
    return fitted


def _constants_are_told(robot: Robot, logs: Sequence[Log], options: IdentificationOptions) -> bool:
    """Whether to fit torque constants without a request."""
    links = trust_letters(
        {name: robot.figures["inertials"][name] for name in ("mass", "center_of_mass")}
    )
    return (
        options.method == "automatic"
        and "friction" in options.fit
        and not {"torque_constant", "payload"} & set(options.fit)
        and not (options.refit or options.couplings)
        and all(log.effort_meaning == "current" and log.payload_known for log in logs)
        # inertials without a source are less certain than the torque constants
        and ENGINEERING not in links
    )


def _behind_gears(log: Log) -> bool:
    return log.effort_meaning == "torque" and log.torque_side == "link"


def _missing_requirement(logs: Sequence[Log], options: IdentificationOptions) -> str:
    """Unmet requirement of the method on the logs, as a sentence; empty if all are met."""
    if options.method in ("threshold_velocity", "temperature") and any(map(_behind_gears, logs)):
        return (
            "it needs motor currents or torques of the motors in every log. Torques of sensors "
            "behind the gears do not contain the friction of motors and gears."
        )
    match options.method:
        case "automatic":
            return ""
        case "motor_current":
            if any(log.effort_meaning != "current" for log in logs):
                return "it needs motor currents in every log."
        case "electrical_power":
            if any(log.power is None for log in logs):
                return "it needs the power of the arm's bus in every log."
        case "base_wrench":
            if any(log.wrench is None for log in logs):
                return "it needs the force and the torque beneath the base in every log."
        case _ if not all(log.carries_weight for log in logs):
            return "it needs motor currents or torques in every log."
        case "temperature":
            return _missing_temperature(logs)
        case "periodic":
            if len(logs) > 1:
                return "it needs a single log, of a motion that is repeated."
            if options.held_out:
                return (
                    "all its periods are one motion, so that none can be held out. Name other "
                    "logs in `validate`."
                )
    return ""


def _missing_temperature(logs: Sequence[Log]) -> str:
    known = [log.temperature for log in logs if log.temperature is not None]
    if len(known) < len(logs):
        return "it needs the temperatures of the joints in every log."
    span = float(np.ptp(np.concatenate(known), axis=0).max())
    if span < TEMPERATURE.min_span:
        return (
            f"the temperatures of its joints span {span:.2g} K, and at least "
            f"{TEMPERATURE.min_span:g} K are needed."
        )
    return ""
