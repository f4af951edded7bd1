"""Queries and answers of the routes under `/logs`."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from joulepath.app.schemas.common import Response, described, part
from joulepath.app.schemas.examples.values import CREATED, LOG_ID
from joulepath.app.schemas.log_file import EffortMeaning
from joulepath.app.schemas.queries import Name, Query, after_of, limit_of, next_of, search_in


class LogChannel(Response):
    """A channel of a log."""

    name: str = described(
        "`q1`, `v1`, `a1`, `effort1`, `temperature1`, `wrench1`, … or `power`.", None, "effort2"
    )
    column: str | None = described(
        "Its column in the file; null if it was computed from another channel.", None, "i2"
    )
    unit: str = described("Its unit.", None, "A")
    min: float = described("Least value, in this unit.", "SI", -3.2)
    max: float = described("Greatest value.", "SI", 6.5)
    noise: float = described(
        "Robust standard deviation of the signal above the band of the filter.", "SI", 0.03
    )


class LogEffort(Response):
    """Meaning of the efforts of a log, and the evidence for it."""

    meaning: EffortMeaning = described("Assumed meaning of the efforts.", None, "current")
    confidence: float = described(
        "1 if the slopes match this meaning exactly; 0 if they match another meaning as well, or "
        "if the motion does not determine them.",
        "1",
        0.9,
    )
    slope: dict[str, float | None] = described(
        "Slope of the effort over the torque of the rigid model, from a fit with friction, at the "
        "two joints next to the base with the largest load. About 1 / torque constant: current; "
        "1: torque; 0: torque without gravity. Null: the motion does not determine the slope.",
        "1/A or 1",
        {"shoulder_lift_joint": 0.1, "elbow_joint": 0.1},
    )
    torque_side: Literal["motor", "link"] = described(
        "Place of the measurement: the `motor`, with rotor inertia and friction; or the `link`, "
        "behind the gear, without rotor inertia and friction. Currents are always of the motor.",
        None,
        "motor",
    )


class LogMove(Response):
    """A move or a rest in a log."""

    start: float = described("Start time, from the start of the log.", "s", 0.5)
    end: float = described("End time, from the start of the log.", "s", 2.1)
    at_rest: bool = described("Whether every joint rests.", None, False)


class LogSummary(Response):
    """A stored log."""

    id: str = described("Id of the log.", None, LOG_ID)
    name: str | None = described("Its name; null without one.", None, "Palletiser, morning")
    robot: str = described("Name of the robot.", None, "ur5e")
    tags: list[str] = described("Its tags.", None, ["cold"])
    created: datetime = described("Time of the upload, in UTC.", None, CREATED)
    owner: str | None = described(
        "Name of the API key of the upload; null without a key.", None, "press_shop"
    )
    size: int = described("Its size in the database, compressed.", "byte", 1_200_000)
    rows: int = described("Number of rows read.", "1", 15_000)
    duration: float = described("Time from the first row to the last.", "s", 30.0)


class LogDetail(LogSummary):
    """A stored log, with a report on its content. The samples themselves are not returned."""

    dropped: int = described(
        "Number of lines dropped because of too few or too many cells.", "1", 0
    )
    rate: float = described(
        "Rows per second of the uniform grid to which the log is resampled.", "Hz", 500.0
    )
    jitter: list[float] = described(
        "5th and 95th percentile of the deviation of a time step from 1 / rate.", "s", [-1e-4, 1e-4]
    )
    payload: float = described("Assumed mass of the carried payload.", "kg", 2.0)
    channels: list[LogChannel] = part("All channels.")
    effort: LogEffort | None = part("Meaning of the efforts; null without logged efforts.")
    moves: list[LogMove] = part(
        "Moves and rests, in order. A move of more than 8 s is divided into blocks of about 5 s, "
        "with 0.5 s between them left out."
    )
    warnings: list[str] = described(
        "Doubtful properties: gaps, constant or saturated channels, velocities that contradict the "
        "positions, an unknown payload, …",
        None,
        ["No payload is given or logged: the payload is assumed to be zero."],
    )


class LogPage(Query):
    """Filter and page of the list of logs."""

    search: Name | None = search_in("the name or the robot")
    limit: int = limit_of("logs")
    after: str | None = after_of(LOG_ID)


class LogList(Response):
    """Logs, newest first."""

    logs: list[LogSummary] = part("The logs.")
    next: str | None = next_of(LOG_ID)
