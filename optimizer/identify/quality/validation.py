"""Rows that are held out of a fit, the errors of its figures on them, and their curves.

The split is by whole motions, never by single samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask, Robot
from joulepath.models.uncertainty.ranges import P95
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm, own_arm
from joulepath.optimizer.identify.errors import NothingHeldOut
from joulepath.optimizer.identify.estimates.grouped import IntArray
from joulepath.optimizer.identify.fits.fitting import FitResult
from joulepath.optimizer.identify.quality.interval import Spread, energy_sd
from joulepath.optimizer.identify.results import (
    ComparedEnergy,
    Curves,
    PowerErrors,
    Prediction,
    TorqueErrors,
    Validation,
)
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
    energies = [each for fold in folds for each in compared(fold, fold.rows.move).values()]
    half = [50 * (each.p95 - each.p5) / each.predicted for each in energies]
    return Validation(
        moves=sum(len(np.unique(fold.rows.move[~fold.rows.rest])) for fold in folds),
        fitted=_prediction([(fold.fitted.arm, fold.rows) for fold in folds], threshold),
        own=_prediction([(own, fold.rows) for fold in folds], threshold),
        constant=power_errors(
            [(fold.rows, np.full(len(fold.rows.q), fold.fitted.mean_power)) for fold in folds]
        )
        if power
        else None,
        coverage=float(np.mean([each.covered for each in energies])) if energies else None,
        half_width=float(np.mean(half)) if half else None,
        energies=_in_order(energies),
        cycles=_in_order(_of_cycles(folds)),
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
        (arm.logged_torque(rows), arm.measured_torque(rows), rows.v, rows.weight)
        for arm, rows in folds
    ]
    measured, predicted, v, weight = (np.concatenate(each) for each in zip(*parts, strict=True))
    use, logged = np.isfinite(measured), np.isfinite(measured).any(axis=0)
    moving = ((np.abs(v) > threshold) & use).astype(float)
    # joints without efforts are in no sum
    measured, predicted = np.where(use, measured, 0.0), np.where(use, predicted, 0.0)
    error = measured - predicted

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
        rmse=np.where(
            logged,
            np.sqrt((moving * error**2).sum(axis=0) / np.maximum(moving.sum(axis=0), 1)),
            np.nan,
        ),
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


def compared(fold: Fold, part: IntArray) -> dict[int, ComparedEnergy]:
    """Measured and predicted energies of the moving rows of a fold, by the number of their part.

    Args:
        fold: the held-out rows with their fit.
        part: number of the part of each row (n,), which is of one log; below 0 for no part.
    """
    measured = fold.fitted.arm.measured_power(fold.rows)
    use = ~fold.rows.rest & np.isfinite(measured) & (part >= 0)
    rows, measured, part = fold.rows.take(use), measured[use], part[use]
    found = dict[int, ComparedEnergy]()
    for number in np.unique(part).tolist():
        mask = part == number
        inside = rows.take(mask)
        energy, sd = energy_sd(fold.fitted, fold.spread, inside)
        found[number] = ComparedEnergy(
            log=int(inside.log[0]),
            start=float(inside.time[0]),
            end=float(inside.time[-1]),
            time=float(inside.weight.sum()),
            measured=float(inside.weight @ measured[mask]),
            predicted=energy,
            p5=energy - P95 * sd,
            p95=energy + P95 * sd,
        )
    return found


def _of_cycles(folds: Sequence[Fold]) -> list[ComparedEnergy]:
    """The energies of the cycles, whose moves may be in several folds.

    The fits of the folds share most of their rows, and so most of their errors: their deviations
    add up.
    """
    found = dict[int, ComparedEnergy]()
    for fold in folds:
        for number, each in compared(fold, fold.rows.cycle).items():
            found[number] = _together(found[number], each) if number in found else each
    return [*found.values()]


def _together(one: ComparedEnergy, other: ComparedEnergy) -> ComparedEnergy:
    """The energies of two parts of a cycle together."""
    names = ("time", "measured", "predicted", "p5", "p95")
    sums = {name: getattr(one, name) + getattr(other, name) for name in names}
    start, end = min(one.start, other.start), max(one.end, other.end)
    return ComparedEnergy(one.log, start, end, **sums)


def _in_order(energies: Sequence[ComparedEnergy]) -> tuple[ComparedEnergy, ...]:
    return tuple(sorted(energies, key=lambda each: (each.log, each.start)))


def held_out_masks(rows: Rows, fraction: float) -> list[Mask]:
    """Rows held out for validation, the same for the same input.

    Args:
        rows: rows of all logs.
        fraction: share of the moving time to hold out; 1 holds out one motion after another.

    Returns:
        Masks (n,), one for every fit.

    Raises:
        NothingHeldOut: there are fewer than two motions.
    """
    groups = rows.groups
    if len(groups) < 2:
        raise NothingHeldOut(len(np.unique(rows.move[~rows.rest])))
    if fraction == 1:
        return [rows.group == group for group in groups]
    time = np.array([rows.weight[(rows.group == group) & ~rows.rest].sum() for group in groups])
    order = np.random.default_rng(0).permutation(len(groups))
    time_before = np.cumsum(time[order]) - time[order]
    wanted = int((time_before < fraction * time.sum()).sum())
    # at least one motion on each side
    chosen = order[: max(1, min(wanted, len(groups) - 1))]
    return [np.isin(rows.group, groups[chosen])]


@dataclass(frozen=True)
class CurveSettings:
    """Settings of the curves."""

    max_rows: int = 1500
    """Rows of all parts together; every part may exceed its share by one row."""


CURVES = CurveSettings()


def curves_of(parts: Sequence[tuple[FittedArm, Rows, Mask]], threshold: float) -> Curves:
    """Measured and modelled curves of rows in motion.

    Args:
        parts: arm, rows and mask (n,) of the rows to show.
        threshold: speed above which the torque of a joint is modelled [rad/s].
    """
    allowed = [mask & ~rows.rest for _, rows, mask in parts]
    every = max(1, -(-sum(int(mask.sum()) for mask in allowed) // CURVES.max_rows))
    curves = list[Curves]()
    for (arm, rows, _), mask in zip(parts, allowed, strict=True):
        thinned = np.zeros_like(mask)
        thinned[np.flatnonzero(mask)[::every]] = True
        shown = rows.take(thinned)
        torque = arm.logged_torque(shown)
        moving = np.isfinite(torque) & (np.abs(shown.v) > threshold)
        curves.append(
            Curves(
                log=shown.log,
                move=shown.move,
                time=shown.time,
                torque=torque,
                modelled_torque=np.where(moving, arm.measured_torque(shown), np.nan),
                power=shown.power,
                modelled_power=np.where(np.isfinite(shown.power), arm.power(shown)[0], np.nan),
            )
        )
    return Curves(
        **{
            name: np.concatenate([getattr(part, name) for part in curves])
            for name in vars(curves[0])
        }
    )
