"""Statistics of repeated measurements: quartiles and percentiles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np


@dataclass(frozen=True)
class Spread:
    """Size, minimum, quartiles, percentiles and maximum of a sample, in the unit of the sample.

    Values may be infinite, such as the gap to a lower bound that is not positive.
    """

    count: int
    minimum: float
    p25: float
    p50: float
    p75: float
    p90: float
    p95: float
    p99: float
    maximum: float

    @staticmethod
    def of(values: Sequence[float]) -> Spread:
        """The statistics of a sample; NaN for an empty sample."""
        if not len(values):
            return Spread(0, *[math.nan] * 8)
        ranks = (0, 25, 50, 75, 90, 95, 99, 100)
        with np.errstate(invalid="ignore"):
            found = np.percentile(values, ranks)
        # the interpolation beside an infinite value may be inf - inf or 0 · inf
        above = np.percentile(values, ranks, method="higher")
        return Spread(len(values), *np.where(np.isnan(found), above, found).tolist())

    def times(self, factor: float) -> Spread:
        """The same statistics in another unit."""
        return Spread(self.count, *(value * factor for value in list(asdict(self).values())[1:]))

    def formatted(self, unit: str = "", digits: int = 1) -> str:
        """Median, 95th percentile, quartiles, maximum and size in one line."""
        numbers = {name: f"{value:.{digits}f}" for name, value in asdict(self).items()}
        return (
            f"median {numbers['p50']}{unit}, 95th percentile {numbers['p95']}{unit} (quartiles "
            f"{numbers['p25']} and {numbers['p75']}, maximum {numbers['maximum']}, n = "
            f"{self.count})"
        )
