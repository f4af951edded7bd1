"""Report on the reading of a log."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.identify.logs.effort import EffortReport


@dataclass(frozen=True)
class Channel:
    """A channel of a log."""

    name: str
    column: str | None
    """Column of the file; None for a channel computed from another one."""
    unit: str
    min: float
    max: float
    noise: float
    """Robust standard deviation of the part above the band of the filter."""


@dataclass(frozen=True)
class LogReport:
    """Findings of the reading of a log."""

    rows: int
    """Number of rows."""
    dropped: int
    """Number of lines dropped for their number of cells."""
    jitter: tuple[float, float]
    """5th and 95th percentile of the deviation of a time step [s]."""
    channels: tuple[Channel, ...]
    effort: EffortReport | None
    """Meaning of the efforts; None if no efforts were logged."""
    warnings: tuple[str, ...]
