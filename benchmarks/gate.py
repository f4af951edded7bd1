"""A measured figure of a benchmark, and its admissible range."""

from __future__ import annotations

from dataclasses import dataclass

GATED_RUNS = 200
"""Number of runs for which the limits of the gates hold."""
MARGIN = 2.0
"""Margin of fewer runs in standard errors [1]."""


@dataclass(frozen=True)
class Gate:
    """A measured figure and its admissible range."""

    what: str
    value: float
    least: float
    most: float

    @property
    def kept(self) -> bool:
        """Whether the value is within the range."""
        return self.least <= self.value <= self.most


def sampling_margin(sd: float, runs: int) -> float:
    """Margin of a mean over few runs: MARGIN times the excess of its standard error over the
    standard error of GATED_RUNS runs.

    Args:
        sd: standard deviation of one run.
        runs: number of runs.
    """
    return float(MARGIN * sd * max(0.0, runs**-0.5 - GATED_RUNS**-0.5))
