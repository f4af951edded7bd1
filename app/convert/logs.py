"""Logs of arms: the options with which they are read, and readings of those that are stored."""

from __future__ import annotations

from typing import Any

from joulepath.app.api.logs.request import LogSettings
from joulepath.app.convert.arm import robot_named, to_payload
from joulepath.optimizer.identify.logs.reading import LogOptions, LogReading, read_log


def to_log_options(settings: LogSettings, most_bytes: int) -> LogOptions:
    """The options of the library for a file of at most `most_bytes` after unpacking. Raises InvalidProblem."""
    columns = settings.columns
    return LogOptions(
        payload=None if settings.payload is None else to_payload(settings.payload),
        gravity=settings.gravity,
        columns=None if columns is None else columns.model_dump(exclude_none=True),
        units=settings.units,
        current_units=settings.current_units,
        effort=settings.effort,
        name=settings.name,
        tags=tuple(settings.tags),
        most_bytes=most_bytes,
    )


def stored_reading(settings: dict[str, Any], body: bytes) -> LogReading:
    """A log from the database, by its settings and its packed file. Raises UnknownRobot if its robot is gone."""
    given = LogSettings.model_validate(settings)
    # its size was checked when it was added
    return read_log(body, robot_named(given.robot), to_log_options(given, LogOptions.most_bytes))
