"""A straight line of the TCP into or out of a stop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arrays import frozen
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.scalars import check_number, check_speed

LineFrame = Literal["tcp", "base"]


@dataclass(frozen=True)
class LineRanges:
    """Ranges of lines of the TCP."""

    least_distance: float = 1e-4
    """Least length of a line [m]."""
    greatest_distance: float = 2.0
    """Greatest length of a line [m]."""


LINE_RANGES = LineRanges()


@dataclass(frozen=True, kw_only=True)
class Line:
    """Straight motion of the TCP with a constant orientation.

    Attributes:
        direction: direction of any length, shape (3,).
        distance: length of the line [m].
        frame: frame of the direction: "tcp" at the stop, or "base".
        speed: speed limit of the TCP on the line [m/s]; None without one.

    Raises:
        InvalidProblem: a value is malformed; names the field.
    """

    direction: Array
    distance: float
    frame: LineFrame = "tcp"
    speed: float | None = None

    def __post_init__(self) -> None:
        direction = frozen(self.direction, (3,), "direction")
        object.__setattr__(self, "direction", direction)
        if not np.linalg.norm(direction) > 1e-9:
            raise InvalidProblem(
                "direction",
                "direction must not be zero: give the vector along which the TCP moves.",
            )
        least, most = LINE_RANGES.least_distance, LINE_RANGES.greatest_distance
        check_number("distance", self.distance, "metres", least=least, most=most)
        check_fields(self)
        check_speed("speed", self.speed)

    def shift(self, T_base_tcp: Array) -> Array:
        """Displacement (3,) [m] of the TCP in the base frame, at a stop with pose T_base_tcp (4,
        4).
        """
        along = self.direction / np.linalg.norm(self.direction) * self.distance
        return np.asarray(T_base_tcp[:3, :3] @ along if self.frame == "tcp" else along)
