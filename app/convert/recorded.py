"""Logs from the database or from the body of a request, and the settings of their reader."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from joulepath.app.api.logs.request import LogSettings
from joulepath.app.convert.arm import inertia_row, robot_named, to_payload
from joulepath.app.convert.items import item
from joulepath.app.exceptions.stored import UnknownLog
from joulepath.app.schemas.arm import Payload
from joulepath.app.schemas.evaluate import EvaluateCsvSettings, EvaluateRequest, EvaluateSettings
from joulepath.optimizer.exceptions import InvalidProblem, InvalidTable
from joulepath.optimizer.identify.errors import EffortNotUsable
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.logs.log_options import LogOptions
from joulepath.optimizer.identify.logs.reading import LogReading, check_header, read_log
from joulepath.optimizer.problem import arm as library

S = TypeVar("S", bound=EvaluateSettings)


def to_log_options(settings: LogSettings, most_bytes: int) -> LogOptions:
    """The options of the library for a file of at most `most_bytes` after unpacking. Raises
    InvalidProblem.
    """
    columns = settings.columns
    return LogOptions(
        payload=None if settings.payload is None else to_payload(settings.payload),
        gravity=settings.gravity,
        columns=None if columns is None else columns.model_dump(exclude_none=True),
        units=settings.units,
        current_units=settings.current_units,
        effort=settings.effort,
        torque_side=settings.torque_side,
        name=settings.name,
        tags=tuple(settings.tags),
        max_bytes=most_bytes,
    )


@dataclass(frozen=True)
class GivenLog:
    """A stored log: its id, the settings of its reader, and its packed file."""

    id: str
    settings: dict[str, Any]
    body: bytes

    @cached_property
    def reading(self) -> LogReading:
        """The log. Raises UnknownRobot if its robot is gone."""
        settings = LogSettings.model_validate(self.settings)
        # its size was checked when it was added
        return read_log(
            self.body, robot_named(settings.robot), to_log_options(settings, LogOptions.max_bytes)
        )


def stored_log(id: str) -> GivenLog:
    """The stored log of this id. Raises UnknownLog if the request did not bring it."""
    log: GivenLog | None = item(("log", id))
    if log is None:
        raise UnknownLog(id)
    return log


def reading_of(id: str) -> LogReading:
    """The content of a stored log. Raises UnknownLog, see `stored_log`."""
    return stored_log(id).reading


def as_logged(asked: EvaluateRequest) -> EvaluateRequest:
    """The request with robot, payload and gravity of its log. Raises UnknownLog or
    InvalidProblem."""
    return asked if asked.log is None else told_by(reading_of(asked.log).log, asked)


def read_csv(file: Path, asked: EvaluateCsvSettings, otherwise: InvalidTable) -> LogReading:
    """The log in a CSV file without the header of a motion.

    Unusable efforts are skipped with a remark, since the energy does not need them.

    Args:
        file: the CSV file.
        asked: settings of the request.
        otherwise: the error of reading the file as a motion.

    Raises:
        LogTooLarge: the log is too large.
        InvalidProblem: the settings are invalid.
        InvalidTable: the file is no log; `otherwise` if it has the columns of a motion or no
            header.
    """
    options = LogOptions(
        payload=to_payload(asked.payload) if "payload" in asked.model_fields_set else None,
        gravity=asked.gravity,
        columns=None if asked.columns is None else asked.columns.model_dump(exclude_none=True),
        units=asked.units,
        current_units=asked.current_units,
        effort=asked.effort,
        torque_side=asked.torque_side,
    )
    robot = robot_named(asked.robot)
    try:
        check_header(file, robot, options)
    except InvalidTable as error:
        raise otherwise if otherwise.column is not None or error.column is None else error from None
    try:
        return read_log(file, robot, options)
    except EffortNotUsable as error:
        reading = read_log(file, robot, replace(options, effort=None))
        return replace(
            reading, report=replace(reading.report, warnings=(*reading.report.warnings, str(error)))
        )


def told_by(log: Log, asked: S) -> S:
    """The request, completed by robot, payload and gravity of the log. Raises InvalidProblem."""
    given = asked.model_fields_set
    if "robot" in given and asked.robot != log.robot:
        raise InvalidProblem("robot", f"The log belongs to the robot {log.robot}: leave robot out.")
    own = {"robot": log.robot, "payload": _payload(log.payload), "gravity": log.gravity.tolist()}
    return asked.model_copy(
        update={name: value for name, value in own.items() if name not in given}
    )


def _payload(payload: library.Payload) -> Payload | None:
    if payload.mass == 0:
        return None
    return Payload(mass=payload.mass, com=payload.com.tolist(), inertia=inertia_row(payload))
