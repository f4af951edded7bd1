"""Power bus: exchange of power between joints and supply."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from joulepath.optimizer.exceptions import InvalidProblem

BusMode = Literal["shared", "isolated", "recuperating", "storage"]


@dataclass(frozen=True)
class Bus:
    """Exchange of power between joints and supply.

    Attributes:
        mode: "shared", "isolated", "recuperating" or "storage".
        efficiency: efficiency of feeding back (`recuperating`), or of charging and discharging
            together (`storage`) [1].
        capacity: usable capacity of the energy storage [J].
        power: limit of charging and of discharging the storage [W].
        initial: usable charge of the storage at the start [J].

    Raises:
        InvalidProblem: a value is out of range; names the field.
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
        # negated comparisons refuse NaN
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
