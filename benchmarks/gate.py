"""A measured figure of a benchmark, and the range it must lie in."""

from __future__ import annotations

from dataclasses import dataclass

GATED_RUNS = 200
"""Runs of the gates of shares."""
MARGIN = 2.0
"""Further standard errors that fewer runs have as a margin."""


@dataclass(frozen=True)
class Gate:
    """A measured figure and the range it must lie in."""

    what: str
    value: float
    least: float
    most: float

    @property
    def kept(self) -> bool:
        """Whether it does."""
        return self.least <= self.value <= self.most


def sampling_margin(sd: float, runs: int) -> float:
    """Margin of a mean over few runs: the standard errors beyond those of `GATED_RUNS` runs.

    Args:
        sd: standard deviation of one run.
        runs: number of runs.
    """
    return float(MARGIN * sd * max(0.0, runs**-0.5 - GATED_RUNS**-0.5))
