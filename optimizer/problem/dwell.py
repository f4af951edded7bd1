"""A dwell: time from one start of a motion to the next, with the arm held at the goal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from joulepath.optimizer.problem.scalars import check_choices, check_number

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
        check_number("dwell.time", self.time, "seconds", positive=True)
        check_choices(self, "dwell.")
        check_number("dwell.brake_delay", self.brake_delay, "seconds")
        check_number("dwell.brake_power", self.brake_power, "watts", optional=True)
