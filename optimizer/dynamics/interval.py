"""How well a motion's energy is known, from the errors that the figures of the arm may have.

The variance has three parts: that of the figures, by the gradient of the energy; what the model
cannot express of a motion, a mean power times its duration; and the friction of another day. See
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

MOVE = "move"


@dataclass(frozen=True)
class Known:
    """The energy [J] of a motion of `duration` [s], and its sensitivity."""

    energy: float
    sensitivity: Sensitivity
    duration: float


def arm_spread(arm: Arm) -> Spread:
    """The errors that the figures of an arm may have. What the request gives itself is known."""
    known = tuple(
        f"inverter_{part}"
        for part in INVERTER_COEFFICIENTS
        if getattr(arm.inverter, part) is not None
    )
    return spread_of(arm.robot, arm.friction_law.name, known)


def with_interval(energy: Energy, sensitivity: Sensitivity, duration: float, arm: Arm) -> Energy:
    """The energy with the interval of its electrical total."""
    known = Known(energy.electrical.total, sensitivity, duration)
    return replace(energy, electrical=replace(energy.electrical, interval=interval_of(known, arm)))


def interval_of(known: Known, arm: Arm) -> EnergyInterval:
    """P5, P95, standard deviation [J], and each source's share of the variance."""
    spread, gradient = arm_spread(arm), known.sensitivity.gradient
    low, high = _ends(_drawn(spread, [known], 0))[:, 0].tolist()
    parts = {
        name: float(gradient @ covariance @ gradient)
        for name, covariance in spread.covariances.items()
    }
    if spread.move_sd:
        parts[MOVE] = (known.duration * spread.move_sd) ** 2
    total = sum(parts.values())
    shares = (
        {"idle_power" if n == BASE_POWER else n: part / total for n, part in parts.items()}
        if total
        else {}
    )
    return EnergyInterval(low, high, float(np.sqrt(total)), shares)


def saving_interval(ours: Known, theirs: Known, arm: Arm) -> SavingInterval:
    """P5, P95 and standard deviation of 1 - ours / theirs, with errors that both motions share; 0
    where theirs is 0.
    """
    return saving_intervals(ours, [theirs], arm)[0]


def saving_intervals(ours: Known, theirs: Sequence[Known], arm: Arm) -> list[SavingInterval]:
    """The `saving_interval` to each of several energies."""
    if not theirs:
        return []
    spread = arm_spread(arm)
    first, second = _drawn(spread, [ours], 0), _drawn(spread, theirs, 1)
    size = np.abs(second)
    savings = np.divide(second - first, size, out=np.zeros_like(size), where=size > 0)
    found = np.append(_ends(savings), savings.std(axis=0)[None], axis=0)
    return [SavingInterval(*each) for each in found.T.tolist()]


def _drawn(spread: Spread, known: Sequence[Known], move: int) -> Array:
    """Draws (n, m) of the energies [J] of m motions."""
    means = np.array([each.energy + each.sensitivity.shift for each in known])
    gradients = np.stack([each.sensitivity.gradient for each in known], axis=1)
    durations = np.array([each.duration for each in known])
    return np.asarray(
        means + spread.draws @ gradients + np.outer(spread.move_draws[move], durations)
    )


def _ends(draws: Array) -> Array:
    """P5 and P95 (2, m) of draws (n, m)."""
    return np.asarray(np.quantile(draws, [0.05, 0.95], axis=0))
