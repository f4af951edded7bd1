"""What was seen while a log was read."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.identify.logs.effort import EffortReport


@dataclass(frozen=True)
class Channel:
    """A channel of a log: its `column` in the file (None if made from another one), `unit`, least
    and greatest value, and robust standard deviation of its `noise` above the filter's band."""

    name: str
    column: str | None
    unit: str
    min: float
    max: float
    noise: float


@dataclass(frozen=True)
class LogReport:
    """`rows` that were read and lines that were `dropped` for their length; `jitter` [s]: P5 and
    P95 of the time steps' deviation; `effort` is None where none was logged."""

    rows: int
    dropped: int
    jitter: tuple[float, float]
    channels: tuple[Channel, ...]
    effort: EffortReport | None
    warnings: tuple[str, ...]
