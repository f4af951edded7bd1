"""How well figures predict rows that no fit has seen."""

from __future__ import annotations

import numpy as np

from models.robot import Array, Robot
from optimizer.identification.fit_rows import Rows
from optimizer.identification.fitted_arm import FittedArm, own_arm
from optimizer.identification.fitting import Fitted, motor_torque
from optimizer.identification.grouped import P95
from optimizer.identification.interval import Spread, energy_sd
from optimizer.identification.results import PowerErrors, Prediction, TorqueErrors, Validation


def validate(robot: Robot, fitted: Fitted, spread: Spread, rows: Rows, threshold: float) -> Validation:
    """Errors of the fitted and of the robot's own figures on rows, of which none may be in the fit."""
    own = own_arm(robot)
    measured = np.isfinite(rows.power)
    moves = np.unique(rows.move[~rows.rest])
    constant, inside, half = None, None, None
    if measured.any():
        level = np.full(len(rows.power), fitted.mean_power)
        constant = power_errors(rows, level)
        inside, half = coverage(fitted, spread, rows)
    return Validation(
        moves=len(moves),
        fitted=prediction(fitted.arm, rows, threshold),
        own=prediction(own, rows, threshold),
        constant=constant,
        coverage=inside,
        half_width=half,
    )


def prediction(arm: FittedArm, rows: Rows, threshold: float) -> Prediction:
    """Errors of an arm's figures on rows."""
    torque = motor_torque(arm, rows)
    return Prediction(
        torque=torque_errors(arm, rows, torque, threshold) if np.isfinite(torque).any() else None,
        power=power_errors(rows, arm.power(rows)[0]) if np.isfinite(rows.power).any() else None,
    )


def torque_errors(arm: FittedArm, rows: Rows, torque: Array, threshold: float) -> TorqueErrors:
    """Errors of predicted torques; `threshold` [rad/s] is the speed above which a joint moves."""
    use = np.isfinite(torque).all(axis=1)
    measured, predicted = torque[use], arm.torque(rows)[use]
    v, weight = rows.v[use], rows.weight[use]
    moving = np.abs(v) > threshold
    error = measured - predicted

    def relative(chosen: Array) -> Array:
        size = np.sqrt((chosen * measured**2).sum(axis=0))
        return np.asarray(100 * np.sqrt((chosen * error**2).sum(axis=0)) / np.where(size > 0, size, np.nan))

    copper = arm.electrics.copper / arm.torque_constant**2
    work, predicted_work = (float(weight @ (each * v).sum(axis=1)) for each in (measured, predicted))
    loss, predicted_loss = (float(weight @ (copper * each**2).sum(axis=1)) for each in (measured, predicted))
    return TorqueErrors(
        rmse=np.sqrt((moving * error**2).sum(axis=0) / np.maximum(moving.sum(axis=0), 1)),
        relative=relative(moving.astype(float)),
        relative_all=relative(np.ones_like(v)),
        shaft_energy=100 * abs(predicted_work / work - 1) if work else np.nan,
        copper_energy=100 * abs(predicted_loss / loss - 1) if loss else np.nan,
    )


def power_errors(rows: Rows, predicted: Array) -> PowerErrors:
    """Errors of predicted power (n,) [W]: of rows in motion, and of the energy of each move."""
    use = np.isfinite(rows.power) & ~rows.rest
    error = (predicted - rows.power)[use]
    number = np.unique(rows.move[use], return_inverse=True)[1]
    energy = np.bincount(number, rows.weight[use] * rows.power[use])
    relative = 100 * np.abs(np.bincount(number, rows.weight[use] * error) / energy)
    return PowerErrors(
        rmse=float(np.sqrt(np.mean(error**2))),
        energy_mean=float(relative.mean()),
        energy_p90=float(np.percentile(relative, 90)),
        energy_max=float(relative.max()),
    )


def coverage(fitted: Fitted, spread: Spread, rows: Rows) -> tuple[float, float]:
    """Share [1] of the moves whose measured energy lies between P5 and P95, and half the interval's mean width [%]."""
    inside, half = list[bool](), list[float]()
    for move in np.unique(rows.move[~rows.rest & np.isfinite(rows.power)]):
        part = rows.take((rows.move == move) & ~rows.rest & np.isfinite(rows.power))
        energy, sd = energy_sd(fitted, spread, part)
        inside.append(abs(float(part.weight @ part.power) - energy) <= P95 * sd)
        half.append(100 * P95 * sd / energy)
    return float(np.mean(inside)), float(np.mean(half))
