"""What the routes under `/logs` answer."""

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
        "Its column in the file; null if it was made from another.", None, "i2"
    )
    unit: str = described("Its unit.", None, "A")
    min: float = described("Least value, in this unit.", "SI", -3.2)
    max: float = described("Greatest value.", "SI", 6.5)
    noise: float = described(
        "Robust standard deviation of what is above the filter's band.", "SI", 0.03
    )


class LogEffort(Response):
    """What the efforts of a log are."""

    meaning: EffortMeaning = described("What they are taken for.", None, "current")
    confidence: float = described(
        "1 if the slopes are exactly those of this meaning, 0 if they could be another's or do not "
        "tell.",
        "1",
        0.9,
    )
    slope: dict[str, float | None] = described(
        "Slope of the effort against the torque of the rigid model, with friction beside it, at "
        "the two joints next to the base that carry most. About 1 / torque constant: current; 1: "
        "torque; 0: without gravity. Null: the motion does not tell.",
        "1/A or 1",
        {"shoulder_lift_joint": 0.1, "elbow_joint": 0.1},
    )
    torque_side: Literal["motor", "link"] = described(
        "Where they were measured: at the `motor`, with rotor and friction; or at the `link`, "
        "behind the gear, without them. Currents are always of the motor.",
        None,
        "motor",
    )


class LogMove(Response):
    """A part of a log."""

    start: float = described("Time at which it starts, from the start of the log.", "s", 0.5)
    end: float = described("Time at which it ends.", "s", 2.1)
    at_rest: bool = described("Whether every joint rests.", None, False)


class LogSummary(Response):
    """A stored log."""

    id: str = described("Id of the log.", None, LOG_ID)
    name: str | None = described("Its name; null without one.", None, "Palletiser, morning")
    robot: str = described("Name of the robot.", None, "ur5e")
    tags: list[str] = described("Its tags.", None, ["cold"])
    created: datetime = described("Time at which it was added, in UTC.", None, CREATED)
    owner: str | None = described(
        "Name of the API key that added it; null without one.", None, "press_shop"
    )
    size: int = described("Its size in the database, compressed.", "byte", 1_200_000)
    rows: int = described("Rows that were read.", "1", 15_000)
    duration: float = described("Time from the first row to the last.", "s", 30.0)


class LogDetail(LogSummary):
    """A stored log, and what was seen in it. The samples themselves are not returned."""

    dropped: int = described(
        "Lines that were dropped, because they have too few or too many cells.", "1", 0
    )
    rate: float = described(
        "Rows per second of the uniform grid on which the log is used.", "Hz", 500.0
    )
    jitter: list[float] = described(
        "5th and 95th percentile of the deviation of a time step from 1 / rate.", "s", [-1e-4, 1e-4]
    )
    payload: float = described("Mass that the arm is taken to have carried.", "kg", 2.0)
    channels: list[LogChannel] = part("All channels.")
    effort: LogEffort | None = part("What the efforts are; null if none were logged.")
    moves: list[LogMove] = part(
        "Moves and rests, in order. A move of more than 8 s is divided into blocks of about 5 s, "
        "with 0.5 s between them left out."
    )
    warnings: list[str] = described(
        "What is odd: gaps, constant or saturated channels, velocities that do not fit, an unknown "
        "payload, …",
        None,
        ["No payload is given or logged: the arm is taken to have carried nothing."],
    )


class LogPage(Query):
    """The part of the list of logs that is returned."""

    search: Name | None = search_in("the name or the robot")
    limit: int = limit_of("logs")
    after: str | None = after_of(LOG_ID)


class LogList(Response):
    """Logs, newest first."""

    logs: list[LogSummary] = part("The logs.")
    next: str | None = next_of(LOG_ID)
