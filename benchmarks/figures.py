"""What becomes of many measurements: medians, percentiles, spread, and the exponent of a growth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np


@dataclass(frozen=True)
class Spread:
    """Count, least, quartiles, percentiles and greatest of a sample, in the sample's unit."""

    count: int
    least: float
    p25: float
    p50: float
    p75: float
    p90: float
    p95: float
    p99: float
    most: float

    @staticmethod
    def of(values: Sequence[float]) -> Spread:
        """All NaN where there are no values."""
        if not len(values):
            return Spread(0, *[math.nan] * 8)
        return Spread(len(values), *(float(np.percentile(values, p)) for p in (0, 25, 50, 75, 90, 95, 99, 100)))

    def times(self, factor: float) -> Spread:
        """The same in another unit."""
        return Spread(self.count, *(value * factor for value in list(asdict(self).values())[1:]))

    def told(self, unit: str = "", digits: int = 1) -> str:
        """Median, 95th percentile and middle half in one line."""
        numbers = {name: f"{value:.{digits}f}" for name, value in asdict(self).items()}
        return (
            f"p50 {numbers['p50']}{unit}, p95 {numbers['p95']}{unit} "
            f"(middle half {numbers['p25']} to {numbers['p75']}, most {numbers['most']}, n = {self.count})"
        )


def exponent(x: Sequence[float], y: Sequence[float]) -> float:
    """The power k of y = c xᵏ that fits best in logarithms."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])
