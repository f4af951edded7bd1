"""Logs of arms: from the settings of a request to the options of the library, and from a reading to its answer."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from joulepath.app.convert.arm import robot_named, to_payload
from joulepath.app.schemas.logs import LogSettings
from joulepath.optimizer.identify.logs.log import Log
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


def report_fields(reading: LogReading) -> dict[str, Any]:
    """What an answer says of a log beside its name and owner."""
    log, report = reading.log, reading.report
    return {
        "rows": report.rows,
        "duration": log.duration,
        "dropped": report.dropped,
        "rate": log.rate,
        "jitter": list(report.jitter),
        "payload": log.payload.mass,
        "channels": [asdict(channel) for channel in report.channels],
        "effort": None if report.effort is None else asdict(report.effort),
        "moves": [
            {"start": move.start / log.rate, "end": move.end / log.rate, "at_rest": move.at_rest} for move in log.moves
        ],
        "warnings": list(report.warnings),
    }


def stored_log(settings: dict[str, Any], body: bytes) -> Log:
    """A log from the database, by its settings and its packed file. Raises UnknownRobot if its robot is gone."""
    given = LogSettings.model_validate(settings)
    # its size was checked when it was added
    options = to_log_options(given, LogOptions.most_bytes)
    return read_log(body, robot_named(given.robot), options).log
