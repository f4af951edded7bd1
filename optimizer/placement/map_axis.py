"""The free coordinates of a placement, and their values on its map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, prod

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.placement.placement import PLACEMENT_RANGES
from joulepath.optimizer.placement.region import Coordinate


@dataclass(frozen=True)
class MapSettings:
    """Settings of the map."""

    points: int = 100
    """Most places of a map without a given resolution."""
    most_points: int = 20_000
    """Most places of any map, whose answer stays readable."""
    lever: float = 0.15
    """Yaw per length that a step of the map counts alike, as a lever [m]: the yaw of a base turns
    the first joint alone, so a coarse step tells enough."""
    fixed: float = 1e-9
    """Length of a range up to which it is one value [m, rad]."""
    inside: float = 1e-9
    """Distance beyond a range that is rounding [m, rad]."""


MAP = MapSettings()


@dataclass(frozen=True)
class Axis:
    """A free coordinate of a body: its range and nominal value [m, rad]."""

    body: int
    name: Coordinate
    low: float
    high: float
    nominal: float

    @property
    def scale(self) -> float:
        """Change of the coordinate that counts as much as one metre [m, rad]."""
        return 1 / MAP.lever if self.name == "yaw" else 1.0

    def count(self, resolution: float) -> int:
        """Number of values of a map that are no farther apart than the resolution [m]."""
        steps = ceil((self.high - self.low) / (resolution * self.scale) - MAP.inside)
        return max(steps if self.is_turn else steps + 1, 2)

    def distance(self, count: int) -> float:
        """Distance of neighbouring values of a map [m, rad]."""
        return (self.high - self.low) / (count if self.is_turn else count - 1)

    def values(self, count: int) -> Array:
        """Values of a map, evenly spaced, shape (count,) [m, rad]."""
        # the end of a full turn repeats its beginning
        return np.linspace(self.low, self.high, count, endpoint=not self.is_turn)

    @property
    def is_turn(self) -> bool:
        """Whether the range is a full turn."""
        return self.name == "yaw" and abs(self.high - self.low - 2 * np.pi) < MAP.inside


def most_counts(axes: Sequence[Axis], choices: int) -> list[int]:
    """Number of values of every axis on a map without a given resolution.

    The axis with the largest distance gets one more value as long as the map has at most
    `MapSettings.points` places.

    Args:
        axes: the axes.
        choices: number of combinations of mounts and listed places, each with a map of its own.
    """
    counts, open_ = [2] * len(axes), set(range(len(axes)))

    def distance(k: int) -> float:
        return axes[k].distance(counts[k]) / axes[k].scale

    while open_:
        longest = max(open_, key=distance)
        counts[longest] += 1
        if choices * prod(counts) > MAP.points or distance(longest) < PLACEMENT_RANGES.finest:
            counts[longest] -= 1
            open_.remove(longest)
    return counts
