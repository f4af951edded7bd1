"""A dwell: the time from one start of the motion to the next, and how the arm is held at the goal
until then.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from joulepath.optimizer.exceptions import InvalidProblem

Hold = Literal["motors", "brakes"]


@dataclass(frozen=True)
class Dwell:
    """The `time` [s] from one start of the motion to the next, and how the arm is held at the goal
    until then.

    With `hold` "brakes" the motors hold for `brake_delay` [s] first. Then the arm draws
    `brake_power` [W] in all, electronics included (None: the power of the electronics with the
    brakes on).

    Raises InvalidProblem, with the field named.
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
