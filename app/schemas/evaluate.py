"""What `POST /evaluate` takes."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.schemas.arm import ArmRequest, one_or_each
from joulepath.app.schemas.common import JointPositions, Request, described
from joulepath.app.schemas.deadline import DeadlineSeconds
from joulepath.app.schemas.examples.values import LOG_ID
from joulepath.app.schemas.examples.values import PAPER_HOME as _HOME
from joulepath.app.schemas.examples.values import PAPER_POSE as _THERE
from joulepath.app.schemas.lengths import LENGTHS
from joulepath.app.schemas.log_file import LogFile
from joulepath.app.schemas.request import Seconds
from joulepath.optimizer.evaluate.recording import MOTION_LIMITS
from joulepath.optimizer.problem.problem import DURATIONS

MAX_ROWS = 100_000
"""Largest number of rows of a motion sent as JSON; a CSV file may have more."""

Rows = Annotated[list[JointPositions], Field(min_length=2, max_length=MAX_ROWS)]
_Rates = Annotated[
    list[Annotated[float, Field(ge=-1e7, le=1e7)]], Field(min_length=1, max_length=16)
]
RateRows = Annotated[list[_Rates], Field(min_length=2, max_length=MAX_ROWS)]
Times = Annotated[
    list[Annotated[float, Field(ge=-1e12, le=1e12)]], Field(min_length=2, max_length=MAX_ROWS)
]
SecondsPerSegment = Annotated[
    Annotated[Seconds, Tag("one")]
    | Annotated[Annotated[list[Seconds], Field(min_length=1, max_length=MAX_ROWS)], Tag("each")],
    Discriminator(
        one_or_each,
        custom_error_type="one_or_each",
        custom_error_message="Give one number, or a list with one per segment",
    ),
]


class LoggedTrajectory(Request):
    """Joint positions over time, from a log or from the answer of `POST /optimize`; arrays are
    `[sample][joint]`.
    """

    t: Times = described(
        "Time of each sample; each later than the previous one by 1 µs or more.",
        "s",
        [0.0, 0.008, 0.016],
    )
    q: Rows = described("Joint positions.", "rad", [_HOME, _HOME, _HOME])
    v: RateRows | None = described(
        "Joint velocities. Null: the derivative of the cubic spline through `q`.",
        "rad/s",
        [[0.0] * 6] * 3,
        default=None,
    )
    a: RateRows | None = described(
        "Joint accelerations. Null: the derivative of the cubic spline through the velocities. "
        "Noise is not smoothed: an error e in `q` at a period h becomes an error of up to 12 e / "
        "h² here.",
        "rad/s²",
        [[0.0] * 6] * 3,
        default=None,
    )

    @model_validator(mode="after")
    def _same_length(self) -> Self:
        logged = [rows for rows in (self.q, self.v, self.a) if rows is not None]
        if any(len(rows) != len(self.t) for rows in logged):
            raise PydanticCustomError(
                "lengths", "`t`, `q`, `v` and `a` must have the same number of samples"
            )
        if any(
            rows is not None and len(row) != len(self.q[0])
            for rows in (self.q, self.v, self.a)
            for row in rows or []
        ):
            raise PydanticCustomError(
                "lengths", "Every row of `q`, `v` and `a` must have one number per joint"
            )
        return self


class EvaluateSettings(ArmRequest):
    """The arm, and how to interpret the motion."""

    time_per_segment: SecondsPerSegment | None = described(
        "Duration from each configuration to the next: one number, or one per segment. Required "
        "with `configurations`.",
        "s",
        1.5,
        default=None,
    )
    interpolation: Literal["linear", "trapezoid", "quintic", "spline"] = described(
        "Motion through `configurations`. `linear`: constant joint velocity within each segment; "
        "the velocity has a step where segments meet. `trapezoid`: trapezoidal velocity with "
        "standstill at both ends of every segment. `quintic`: polynomial of degree 5 with "
        "standstill at both ends of every segment. `spline`: one smooth curve through all "
        "configurations, with standstill at the start and at the end.",
        None,
        "linear",
        default="quintic",
    )
    sample_period: float | None = described(
        "Time between the returned samples; the last sample is at the end. Null: no samples. At "
        f"most {MOTION_LIMITS.max_samples} samples.",
        "s",
        0.05,
        default=None,
        ge=DURATIONS.least_period,
        le=3600,
    )
    deadline: DeadlineSeconds | None = described(
        "Wall time from the end of the upload, including the wait for a worker. Null: the longest "
        "that the service allows.",
        "s",
        10.0,
        default=None,
    )


class EvaluateRequest(EvaluateSettings):
    """A given motion, as exactly one of `configurations`, `trajectory` and `log`."""

    configurations: Rows | None = described(
        "Joint positions, passed in this order.", "rad", [_HOME, _THERE, _HOME], default=None
    )
    trajectory: LoggedTrajectory | None = described(
        "Joint positions over time, for example a log.",
        None,
        {"t": [0.0, 1.5, 3.0], "q": [_HOME, _THERE, _HOME]},
        default=None,
    )
    log: Annotated[str, Field(max_length=LENGTHS.id)] | None = described(
        "Id of a stored log, from `POST /logs`: the motion that the arm has made. `robot`, "
        "`payload` and `gravity` are those of the log where they are left out.",
        None,
        LOG_ID,
        default=None,
    )

    @model_validator(mode="after")
    def _one_motion(self) -> Self:
        motions = {"configurations", "trajectory", "log"}
        if sum(getattr(self, name) is not None for name in motions) != 1:
            raise PydanticCustomError(
                "exactly_one", "Give exactly one of `configurations`, `trajectory` and `log`"
            )
        if self.configurations is not None and self.time_per_segment is None:
            raise PydanticCustomError("times", "`configurations` require `time_per_segment`")
        given = self.model_fields_set & {"time_per_segment", "interpolation"}
        if self.configurations is None and given:
            raise PydanticCustomError(
                "contradiction",
                "A `trajectory` and a `log` have their own times: leave out `time_per_segment` and "
                "`interpolation`",
            )
        return self


class EvaluateCsvSettings(EvaluateSettings, LogFile):
    """The query parameters of a CSV body."""
