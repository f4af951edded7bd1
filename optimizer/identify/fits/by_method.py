"""The methods that can be asked for by name: what each needs of the logs, and how it fits them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from joulepath.models.robot import Robot
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.errors import MethodNotApplicable
from joulepath.optimizer.identify.fits.fitting import Fitted, fit_rows, motor_torque
from joulepath.optimizer.identify.fits.periodic import periods_of
from joulepath.optimizer.identify.fits.temperature import SETTINGS, at_reference, temperatures_of
from joulepath.optimizer.identify.fits.threshold import faster, thresholds_of
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.rows.fit_rows import Rows


def prepared(
    logs: Sequence[Log], options: IdentificationOptions
) -> tuple[list[Log], IdentificationOptions]:
    """The logs and options as the method takes them. Raises MethodNotApplicable and
    InvalidProblem."""
    missing = _missing(logs, options)
    if missing:
        raise MethodNotApplicable(options.method, missing)
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
        return [periods_of(log, options.period) for log in logs], options
    return [*logs], options


def fit_by_method(robot: Robot, rows: Rows, options: IdentificationOptions) -> Fitted:
    """Fits rows of prepared logs with the method of the options."""
    fitted = fit_rows(robot, rows, options)
    if options.method == "threshold_velocity":
        found = thresholds_of(fitted.arm, rows, motor_torque(fitted.arm, rows))
        thresholds = np.maximum(found, options.velocity_threshold)
        return replace(fit_rows(robot, faster(rows, thresholds), options), thresholds=thresholds)
    if options.method == "temperature":
        for _ in range(SETTINGS.passes):
            torque = motor_torque(fitted.arm, rows)
            warm = temperatures_of(
                rows, torque, fitted.arm, fitted.clusters, options.velocity_threshold
            )
            fitted = fit_rows(robot, at_reference(rows, fitted.arm, warm), options)
    return fitted


def _missing(logs: Sequence[Log], options: IdentificationOptions) -> str:
    """What the method needs and the logs do not have, as a sentence; empty if nothing."""
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
        case _ if any(log.effort is None for log in logs):
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
    if span < SETTINGS.least_span:
        return (
            f"the temperatures of its joints span {span:.2g} K, and at least "
            f"{SETTINGS.least_span:g} K are needed."
        )
    return ""
