"""A dwell: time from one start of a motion to the next, with the arm held at the goal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from joulepath.optimizer.exceptions import InvalidProblem

Hold = Literal["motors", "brakes"]


@dataclass(frozen=True)
class Dwell:
    """Rest at the goal until the next start of the motion.

    Attributes:
        time: time from one start of the motion to the next [s].
        hold: "motors", or "brakes" after a delay.
        brake_delay: time on the motors before the brakes engage [s].
        brake_power: total power on the brakes, electronics included [W]; None for the power of the
            electronics with the brakes on.

    Raises:
        InvalidProblem: a value is out of range; names the field.
    """

    time: float
    hold: Hold = "motors"
    brake_delay: float = 0.0
    brake_power: float | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.time) and self.time > 0):
            raise InvalidProblem("dwell.time", "dwell.time must be a positive number of seconds.")
        if self.hold not in ("motors", "brakes"):
            raise InvalidProblem("dwell.hold", "dwell.hold must be motors or brakes.")
        if not (np.isfinite(self.brake_delay) and self.brake_delay >= 0):
            raise InvalidProblem(
                "dwell.brake_delay", "dwell.brake_delay must be a number of seconds, zero or more."
            )
        if self.brake_power is not None and not (
            np.isfinite(self.brake_power) and self.brake_power >= 0
        ):
            raise InvalidProblem(
                "dwell.brake_power", "dwell.brake_power must be a number of watts, zero or more."
            )
