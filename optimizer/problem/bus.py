"""The power bus: how joints and supply exchange power."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from joulepath.optimizer.exceptions import InvalidProblem

BusMode = Literal["shared", "isolated", "recuperating", "storage"]


@dataclass(frozen=True)
class Bus:
    """How joints and supply exchange power; `capacity`, `power` and `initial` belong to the energy
    storage.

    `efficiency` [1] is that of feeding back (`recuperating`), or of charging and discharging
    together (`storage`). `capacity` and `initial` [J] are usable charge; `power` [W] limits both
    charging and discharging.

    Raises InvalidProblem, with the field named.
    """

    mode: BusMode = "shared"
    efficiency: float = 1.0
    capacity: float = 0.0
    power: float = np.inf
    initial: float = 0.0

    def __post_init__(self) -> None:
        if self.mode not in ("shared", "isolated", "recuperating", "storage"):
            raise InvalidProblem(
                "bus.mode", "bus.mode must be shared, isolated, recuperating or storage."
            )
        # written so that NaN, which compares false with everything, is refused
        if not 0 <= self.efficiency <= 1:
            raise InvalidProblem("bus.efficiency", "bus.efficiency must be a number from 0 to 1.")
        if not 0 <= self.capacity < np.inf:
            raise InvalidProblem(
                "bus.capacity", "bus.capacity must be a finite number of joules, zero or more."
            )
        if not self.power > 0:
            raise InvalidProblem("bus.power", "bus.power must be a positive number of watts.")
        if not 0 <= self.initial <= self.capacity:
            raise InvalidProblem(
                "bus.initial", "bus.initial must be a charge from 0 to bus.capacity."
            )
