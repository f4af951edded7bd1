"""The errors of reading logs."""

from __future__ import annotations

from joulepath.optimizer.exceptions import JoulepathError


class LogTooLarge(JoulepathError):
    """A log has more than `limit` rows, or bytes after unpacking: `unit` says which."""

    def __init__(self, limit: int, unit: str) -> None:
        super().__init__(
            f"The log has more than {limit} {unit}: send it in parts, at a lower rate, or only the columns that count."
        )
        self.limit, self.unit = limit, unit


class EffortNotUsable(JoulepathError):
    """The efforts of a log are without gravity (`meaning` is external), or it is not clear what they are (None).

    `slope` is that of the effort against the torque of the rigid model, by the names of two joints; None for one that
    the log does not determine.
    """

    def __init__(self, message: str, meaning: str | None, slope: dict[str, float | None]) -> None:
        super().__init__(message)
        self.meaning, self.slope = meaning, slope
