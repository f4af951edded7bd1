"""A dwell: time from one start of a motion to the next, with the arm held at the goal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from joulepath.optimizer.problem.scalars import check_choice, check_number

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
        check_holding("dwell", self.hold, self.brake_delay, self.brake_power)


def check_holding(field: str, hold: object, brake_delay: object, brake_power: object) -> None:
    """Check how an arm is held at rest, as by the attributes of `Dwell`.

    Raises:
        InvalidProblem: a value is out of range; names it as a part of `field`.
    """
    check_choice(f"{field}.hold", hold, Hold)
    check_number(f"{field}.brake_delay", brake_delay, "seconds")
    check_number(f"{field}.brake_power", brake_power, "watts", optional=True)
