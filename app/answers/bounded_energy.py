"""An energy with its proven lower bound."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Self

from joulepath.optimizer.declared import Joules, Ratio
from joulepath.optimizer.result.energy import Energy, Objective


def optimality_gap(bound: float, energy: float) -> float:
    """1 - bound / energy; 0 if the energy is not positive."""
    return 1 - bound / energy if energy > 0 else 0.0


@dataclass(frozen=True, kw_only=True)
class EnergyAndBound(Energy):
    """Energy and power of the motion, and the possible saving of other motions."""

    lower_bound: Joules
    """Lower bound of the objective: no motion of any shape and any allowed duration between these
    targets needs less."""
    optimality_gap: Ratio
    """1 - lower_bound / energy of the objective; 0 if this energy is not positive."""

    @classmethod
    def bounded(cls, energy: Energy, lower_bound: float, objective: Objective) -> Self:
        """An energy, and the lower bound of its minimised part [J]."""
        parts = {part.name: getattr(energy, part.name) for part in fields(Energy)}
        gap = optimality_gap(lower_bound, energy.of(objective))
        return cls(**parts, lower_bound=lower_bound, optimality_gap=gap)
