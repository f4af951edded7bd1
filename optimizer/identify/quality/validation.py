"""Errors of figures on rows that were not part of their fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.models.uncertainty.ranges import P95
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm, own_arm
from joulepath.optimizer.identify.arm.logged_torque import logged_torque, measured_power
from joulepath.optimizer.identify.fits.fitting import FitResult
from joulepath.optimizer.identify.quality.curves import curves_of
from joulepath.optimizer.identify.quality.interval import Spread, energy_sd
from joulepath.optimizer.identify.results import PowerErrors, Prediction, TorqueErrors, Validation
from joulepath.optimizer.identify.rows.fit_rows import Rows


@dataclass(frozen=True, eq=False)
class Fold:
    """Held-out rows, and a fit to other rows."""

    fitted: FitResult
    spread: Spread
    rows: Rows


def validate(robot: Robot, folds: Sequence[Fold], threshold: float) -> Validation:
    """Errors of fitted figures and of the robot's own figures.

    Args:
        robot: the robot with its own figures.
        folds: held-out rows with their fits.
        threshold: smallest speed of a moving joint [rad/s].
    """
    own, power = own_arm(robot), any(np.isfinite(fold.rows.power).any() for fold in folds)
    covered = [coverage(fold) for fold in folds]
    inside, half = (np.concatenate(each) for each in zip(*covered, strict=True))
    return Validation(
        moves=sum(len(np.unique(fold.rows.move[~fold.rows.rest])) for fold in folds),
        fitted=_prediction([(fold.fitted.arm, fold.rows) for fold in folds], threshold),
        own=_prediction([(own, fold.rows) for fold in folds], threshold),
        constant=power_errors(
            [(fold.rows, np.full(len(fold.rows.q), fold.fitted.mean_power)) for fold in folds]
        )
        if power
        else None,
        coverage=float(inside.mean()) if len(inside) else None,
        half_width=float(half.mean()) if len(half) else None,
        curves=curves_of(
            [(fold.fitted.arm, fold.rows, ~fold.rows.rest) for fold in folds], threshold
        ),
    )


def _prediction(folds: Sequence[tuple[FittedArm, Rows]], threshold: float) -> Prediction:
    torque = any(np.isfinite(rows.effort).any() for _, rows in folds)
    power = any(np.isfinite(rows.power).any() for _, rows in folds)
    return Prediction(
        torque=torque_errors(folds, threshold) if torque else None,
        power=power_errors([(rows, arm.power(rows)[0]) for arm, rows in folds]) if power else None,
    )


def torque_errors(folds: Sequence[tuple[FittedArm, Rows]], threshold: float) -> TorqueErrors:
    """Errors of predicted torques.

    Args:
        folds: arms with the rows to predict.
        threshold: smallest speed of a moving joint [rad/s].
    """
    parts = [
        (logged_torque(arm, rows), arm.measured_torque(rows), rows.v, rows.weight)
        for arm, rows in folds
    ]
    measured, predicted, v, weight = (np.concatenate(each) for each in zip(*parts, strict=True))
    use = np.isfinite(measured).all(axis=1)
    measured, predicted, v, weight = measured[use], predicted[use], v[use], weight[use]
    moving, error = (np.abs(v) > threshold).astype(float), measured - predicted

    def relative(chosen: Array) -> Array:
        size = np.sqrt((chosen * measured**2).sum(axis=0))
        return np.asarray(
            100 * np.sqrt((chosen * error**2).sum(axis=0)) / np.where(size > 0, size, np.nan)
        )

    # sensors behind the gears do not see the currents
    arm, of_motors = folds[0][0], not folds[0][1].link_side
    copper = arm.power_parameters.copper / arm.torque_constant**2
    work, predicted_work = (
        float(weight @ (each * v).sum(axis=1)) for each in (measured, predicted)
    )
    loss, predicted_loss = (
        float(weight @ (copper * each**2).sum(axis=1)) for each in (measured, predicted)
    )
    return TorqueErrors(
        rmse=np.sqrt((moving * error**2).sum(axis=0) / np.maximum(moving.sum(axis=0), 1)),
        relative=relative(moving),
        relative_all=relative(np.ones_like(v)),
        shaft_energy=100 * abs(predicted_work / work - 1) if work else np.nan,
        copper_energy=100 * abs(predicted_loss / loss - 1) if of_motors and loss else np.nan,
    )


def power_errors(folds: Sequence[tuple[Rows, Array]]) -> PowerErrors:
    """Errors of predicted power over rows in motion, and of the energy of each move.

    Args:
        folds: rows, with predicted powers (n,) [W].
    """
    errors, relative = list[Array](), list[Array]()
    for rows, predicted in folds:
        use = np.isfinite(rows.power) & ~rows.rest
        error, weight = (predicted - rows.power)[use], rows.weight[use]
        number = np.unique(rows.move[use], return_inverse=True)[1]
        errors.append(error)
        relative.append(
            100
            * np.abs(
                np.bincount(number, weight * error) / np.bincount(number, weight * rows.power[use])
            )
        )
    energies = np.concatenate(relative)
    return PowerErrors(
        rmse=float(np.sqrt(np.mean(np.concatenate(errors) ** 2))),
        energy_mean=float(energies.mean()),
        energy_p90=float(np.percentile(energies, 90)),
        energy_max=float(energies.max()),
    )


def coverage(fold: Fold) -> tuple[Array, Array]:
    """Intervals of the energies of the moves of a fold.

    Returns:
        Whether the measured energy of each move, by the logged power or else by the torques, lies
        between P5 and P95 (moves,), and half the width of the interval (moves,) [%].
    """
    inside, half_widths = list[bool](), list[float]()
    measured = measured_power(fold.fitted.arm, fold.rows)
    use = ~fold.rows.rest & np.isfinite(measured)
    rows, measured = fold.rows.take(use), measured[use]
    for move in np.unique(rows.move):
        part = rows.take(rows.move == move)
        energy, sd = energy_sd(fold.fitted, fold.spread, part)
        drawn = float(part.weight @ measured[rows.move == move])
        inside.append(abs(drawn - energy) <= P95 * sd)
        half_widths.append(100 * P95 * sd / energy)
    return np.array(inside), np.array(half_widths)
