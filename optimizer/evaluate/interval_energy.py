"""Energy of an interval of a given motion, and sums over consecutive intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import reduce
from typing import TypeVar

from joulepath.optimizer.declared import Joules, Ratio, Seconds, Watts
from joulepath.optimizer.dynamics.losses import relative_error
from joulepath.optimizer.result.energy import Energy, StorageUse

Sum = TypeVar("Sum")


@dataclass(frozen=True)
class IntervalEnergy:
    """Energy of one segment of the motion, or of the whole motion."""

    start: Seconds
    """Time at which it starts, from the start of the motion."""
    end: Seconds
    """Time at which it ends, from the start of the motion."""
    energy: Energy
    """Energy and power."""
    mean_mechanical_power: Watts = field(init=False)
    """Mean of Σ_j |tau_j v_j|: mechanical energy / duration."""
    kinetic_start: Joules
    """Kinetic energy just after `start`, rotors included."""
    kinetic_end: Joules
    """Kinetic energy just before `end`, rotors included."""
    balance_error: Ratio = field(init=False)
    """|sum of the electrical parts - total| / total. It is large if the logged `v` and `a` do not
    fit
    `q`."""

    def __post_init__(self) -> None:
        electrical = self.energy.electrical
        mean_power = self.energy.mechanical.total / self.duration
        object.__setattr__(self, "mean_mechanical_power", mean_power)
        error = relative_error(electrical.parts_sum, electrical.total)
        object.__setattr__(self, "balance_error", error)

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return self.end - self.start


def join_intervals(parts: Sequence[IntervalEnergy]) -> IntervalEnergy:
    """Energy of consecutive intervals together."""
    first, last = parts[0], parts[-1]
    duration = last.end - first.start
    energies = [part.energy for part in parts]
    energy = replace(
        reduce(_sum, [replace(energy, storage=None) for energy in energies]),
        peak_power=max(energy.peak_power for energy in energies),
        mean_power=sum(part.energy.mean_power * part.duration for part in parts) / duration,
        storage=_storage_use([energy.storage for energy in energies if energy.storage is not None]),
    )
    return IntervalEnergy(first.start, last.end, energy, first.kinetic_start, last.kinetic_end)


def _storage_use(uses: Sequence[StorageUse]) -> StorageUse | None:
    """Use of the energy storage over consecutive intervals; None without energy storage."""
    if not uses:
        return None
    charged, discharged = (
        sum(getattr(use, name) for use in uses) for name in ("charged", "discharged")
    )
    return StorageUse(uses[0].initial, uses[-1].final, charged, discharged)


def _sum(one: Sum, other: Sum) -> Sum:
    """Sum of two numbers or arrays, or of two dataclasses field by field; None plus None is
    None."""
    if one is None:
        return one
    if is_dataclass(one) and not isinstance(one, type):
        sums = {
            each.name: _sum(getattr(one, each.name), getattr(other, each.name))
            for each in fields(one)
        }
        return type(one)(**sums)
    return one + other  # type: ignore[no-any-return, operator]
