"""Uncertainty of the energy of a motion, from the possible errors of the figures of the arm.

The variance has three parts: the errors of the figures, through the gradient of the energy; the
model error of a motion, a mean power times its duration; and the day-to-day change of friction. See
`joulepath.models.uncertainty.spread`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.models.uncertainty.parameters import BASE_POWER
from joulepath.models.uncertainty.spread import Spread, spread_of
from joulepath.optimizer.problem.arm import INVERTER_COEFFICIENTS, Arm
from joulepath.optimizer.result.energy import Energy, EnergyInterval, SavingInterval, Sensitivity

MOTION_SOURCE = "move"
"""Name of the model error among the sources of the variance."""


@dataclass(frozen=True)
class MotionEnergy:
    """Energy [J] of a motion of `duration` [s], and its sensitivity."""

    energy: float
    sensitivity: Sensitivity
    duration: float

    def __add__(self, other: MotionEnergy) -> MotionEnergy:
        return MotionEnergy(
            self.energy + other.energy,
            self.sensitivity + other.sensitivity,
            self.duration + other.duration,
        )


def arm_spread(arm: Arm) -> Spread:
    """Possible errors of the figures of an arm, without the figures that the request gives
    itself.
    """
    known = tuple(
        f"inverter_{part}"
        for part in INVERTER_COEFFICIENTS
        if getattr(arm.inverter, part) is not None
    )
    return spread_of(arm.robot, arm.friction_law.name, known)


def with_interval(energy: Energy, sensitivity: Sensitivity, duration: float, arm: Arm) -> Energy:
    """The energy with the interval of its electrical total."""
    known = MotionEnergy(energy.electrical.total, sensitivity, duration)
    return replace(energy, electrical=replace(energy.electrical, interval=interval_of(known, arm)))


def interval_of(known: MotionEnergy, arm: Arm) -> EnergyInterval:
    """Percentiles 5 and 95, standard deviation [J], and share of every source in the variance."""
    spread, gradient = arm_spread(arm), known.sensitivity.gradient
    low, high = _percentiles(_energy_draws(spread, [known], 0))[:, 0].tolist()
    parts = {
        name: float(gradient @ covariance @ gradient)
        for name, covariance in spread.covariances.items()
    }
    if spread.move_sd:
        parts[MOTION_SOURCE] = (known.duration * spread.move_sd) ** 2
    total = sum(parts.values())
    shares = (
        {"idle_power" if n == BASE_POWER else n: part / total for n, part in parts.items()}
        if total
        else {}
    )
    return EnergyInterval(low, high, float(np.sqrt(total)), shares)


def saving_interval(ours: MotionEnergy, theirs: MotionEnergy, arm: Arm) -> SavingInterval:
    """Percentiles 5 and 95 and standard deviation of the saving 1 - ours / theirs, with errors
    common to both motions; the saving is 0 if theirs is 0.
    """
    return saving_intervals([ours], [theirs], arm)[0]


def saving_intervals(
    ours: Sequence[MotionEnergy], theirs: Sequence[MotionEnergy], arm: Arm
) -> list[SavingInterval]:
    """`saving_interval` for several pairs of energies."""
    if not theirs:
        return []
    spread = arm_spread(arm)
    first, second = _energy_draws(spread, ours, 0), _energy_draws(spread, theirs, 1)
    size = np.abs(second)
    savings = np.divide(second - first, size, out=np.zeros_like(size), where=size > 0)
    statistics = np.append(_percentiles(savings), savings.std(axis=0)[None], axis=0)
    return [SavingInterval(*column) for column in statistics.T.tolist()]


def _energy_draws(spread: Spread, known: Sequence[MotionEnergy], move: int) -> Array:
    """Random draws (n, m) of the energies [J] of m motions."""
    means = np.array([motion.energy + motion.sensitivity.shift for motion in known])
    gradients = np.stack([motion.sensitivity.gradient for motion in known], axis=1)
    durations = np.array([motion.duration for motion in known])
    return np.asarray(
        means + spread.draws @ gradients + np.outer(spread.move_draws[move], durations)
    )


def _percentiles(draws: Array) -> Array:
    """Percentiles 5 and 95 (2, m) of draws (n, m)."""
    return np.asarray(np.quantile(draws, [0.05, 0.95], axis=0))
