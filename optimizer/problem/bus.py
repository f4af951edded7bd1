"""Power bus: exchange of power between joints and supply."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.scalars import check_number

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
        check_fields(self, "bus.")
        check_number("bus.efficiency", self.efficiency, most=1.0)
        check_number("bus.capacity", self.capacity, "joules")
        check_number("bus.power", self.power, "watts", positive=True, infinite=True)
        check_number("bus.initial", self.initial, "joules")
        if self.initial > self.capacity:
            raise InvalidProblem("bus.initial", "bus.initial must not exceed bus.capacity.")
