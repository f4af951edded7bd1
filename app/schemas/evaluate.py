"""What `POST /evaluate` takes and answers."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.answers.declared import Shown
from joulepath.app.schemas.arm import ArmRequest, one_or_each
from joulepath.app.schemas.common import JointPositions, MotionAnswer, Request, Response, described, part
from joulepath.app.schemas.examples.values import LOG_ID
from joulepath.app.schemas.examples.values import PAPER_HOME as _HOME
from joulepath.app.schemas.examples.values import PAPER_POSE as _THERE
from joulepath.app.schemas.lengths import ID_LENGTH
from joulepath.app.schemas.log_file import LogFile
from joulepath.app.schemas.request import Seconds
from joulepath.app.schemas.wording import BODIES, WARNINGS
from joulepath.optimizer.evaluate.limit_report import LimitName
from joulepath.optimizer.evaluate.sampler import MOST_SAMPLES
from joulepath.optimizer.problem.problem import LONGEST_DURATION
from joulepath.optimizer.result.energy import Energy
from joulepath.optimizer.result.solution import Samples

MAX_ROWS = 100_000
"""Largest number of rows of a motion sent as JSON; a CSV file may have more."""

Rows = Annotated[list[JointPositions], Field(min_length=2, max_length=MAX_ROWS)]
_Rates = Annotated[list[Annotated[float, Field(ge=-1e7, le=1e7)]], Field(min_length=1, max_length=16)]
RateRows = Annotated[list[_Rates], Field(min_length=2, max_length=MAX_ROWS)]
Times = Annotated[list[Annotated[float, Field(ge=-1e12, le=1e12)]], Field(min_length=2, max_length=MAX_ROWS)]
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
    """Joint positions over time, from a log or from the answer of `POST /optimize`; arrays are [sample][joint]."""

    t: Times = described(
        "Time of each sample; each later than the previous one by 1 µs or more.", "s", [0.0, 0.008, 0.016]
    )
    q: Rows = described("Joint positions.", "rad", [_HOME, _HOME, _HOME])
    v: RateRows | None = described(
        "Joint velocities. Null: the derivative of the cubic spline through `q`.",
        "rad/s",
        [[0.0] * 6] * 3,
        default=None,
    )
    a: RateRows | None = described(
        "Joint accelerations. Null: the derivative of the cubic spline through the velocities. Noise is not smoothed: "
        "an error e in `q` at a period h becomes an error of up to 12 e / h² here.",
        "rad/s²",
        [[0.0] * 6] * 3,
        default=None,
    )

    @model_validator(mode="after")
    def _same_length(self) -> Self:
        logged = [rows for rows in (self.q, self.v, self.a) if rows is not None]
        if any(len(rows) != len(self.t) for rows in logged):
            raise PydanticCustomError("lengths", "`t`, `q`, `v` and `a` must have the same number of samples")
        if any(
            rows is not None and len(row) != len(self.q[0]) for rows in (self.q, self.v, self.a) for row in rows or []
        ):
            raise PydanticCustomError("lengths", "Every row of `q`, `v` and `a` must have one number per joint")
        return self


class EvaluateSettings(ArmRequest):
    """The arm, and how to interpret the motion."""

    time_per_segment: SecondsPerSegment | None = described(
        "Duration from each configuration to the next: one number, or one per segment. Required with `configurations`.",
        "s",
        1.5,
        default=None,
    )
    interpolation: Literal["linear", "trapezoid", "quintic", "spline"] = described(
        "Motion through `configurations`. `linear`: constant joint velocity within each segment; the velocity has a "
        "step where segments meet. `trapezoid`: trapezoidal velocity with standstill at both ends of every segment. "
        "`quintic`: polynomial of degree 5 with standstill at both ends of every segment. `spline`: one smooth curve "
        "through all configurations, with standstill at the start and at the end.",
        None,
        "linear",
        default="quintic",
    )
    sample_period: float | None = described(
        "Time between the returned samples; the last sample is at the end. Null: no samples. At most "
        f"{MOST_SAMPLES} samples.",
        "s",
        0.05,
        default=None,
        ge=1e-4,
        le=3600,
    )
    deadline: float | None = described(
        "Wall time from the end of the upload, including the wait for a worker. Null: the longest that the service "
        "allows.",
        "s",
        10.0,
        default=None,
        ge=1e-3,
        le=LONGEST_DURATION,
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
    log: Annotated[str, Field(max_length=ID_LENGTH)] | None = described(
        "Id of a stored log, from `POST /logs`: the motion that the arm has made. `robot`, `payload` and `gravity` are "
        "those of the log where they are left out.",
        None,
        LOG_ID,
        default=None,
    )

    @model_validator(mode="after")
    def _one_motion(self) -> Self:
        motions = {"configurations", "trajectory", "log"}
        if sum(getattr(self, name) is not None for name in motions) != 1:
            raise PydanticCustomError("exactly_one", "Give exactly one of `configurations`, `trajectory` and `log`")
        if self.configurations is not None and self.time_per_segment is None:
            raise PydanticCustomError("times", "`configurations` require `time_per_segment`")
        given = self.model_fields_set & {"time_per_segment", "interpolation"}
        if self.configurations is None and given:
            raise PydanticCustomError(
                "contradiction",
                "A `trajectory` and a `log` have their own times: leave out `time_per_segment` and `interpolation`",
            )
        return self


class EvaluateCsvSettings(EvaluateSettings, LogFile):
    """The query parameters of a CSV body."""


class MeasuredEnergy(Response):
    """Electrical energy by what was measured during this part of a log."""

    electrical: float | None = described(
        "Integral of the logged power of the arm's bus. Null if the log has none.", "J", 61.2
    )
    by_efforts: float | None = described(
        "Integral of the power that the motors take by their logged currents or torques, with the losses of the "
        "robot's drives and its idle power. Null if the log has none.",
        "J",
        59.8,
    )


class IntervalEnergy(Response):
    """Energy of one segment of the motion, or of the whole motion."""

    start: float = described("Time at which it starts, from the start of the motion.", "s", 0.0)
    end: float = described("Time at which it ends, from the start of the motion.", "s", 1.5)
    energy: Annotated[Energy, Shown] = part("Energy and power.")
    mean_mechanical_power: float = described("Mean of Σ_j |tau_j v_j|: mechanical energy / duration.", "W", 14.3)
    kinetic_start: float = described("Kinetic energy just after `start`, rotors included.", "J", 6.9)
    kinetic_end: float = described("Kinetic energy just before `end`, rotors included.", "J", 6.2)
    balance_error: float = described(
        "|sum of the electrical parts - total| / total. It is large if the logged `v` and `a` do not fit `q`.",
        "1",
        1e-9,
    )
    measured: MeasuredEnergy | None = part("What was measured meanwhile; null without a log of power or efforts.")


class LimitCheck(Response):
    """One limit, at the instant of the motion with the largest value / limit."""

    limit: LimitName = described(
        "The limit. `tool_cone`, `tcp_speed` and `elbow_speed` only if the request limits them.", None, "velocity"
    )
    held: bool = described("Whether the motion is within this limit.", None, True)
    worst_ratio: float | None = described(
        "|value| / limit; for positions: distance from the middle of the range / half of the range. Null if the value"
        " is infinite.",
        "1",
        0.42,
    )
    joint: str | None = described(
        "Name of the joint; null for `tool_cone`, `tcp_speed` and `elbow_speed`.", None, "wrist_2_joint"
    )
    t: float = described("Time of this instant, from the start of the motion.", "s", 0.75)
    value: float | None = described(
        "Value at this instant, in the unit of the limit: rad, rad/s, rad/s², rad/s³, N·m or m/s. Null if it is "
        "infinite: the acceleration at a velocity step, the jerk at an acceleration step.",
        "SI",
        1.31,
    )
    bound: float = described("Value of the limit, in the same unit.", "SI", 3.1416)


class SampledClearance(Response):
    """Smallest distance between two bodies at sample points. It proves nothing between two samples."""

    distance: float = described(
        "Distance minus the obstacle's `margin`; if negative, the two bodies are too close or overlap.", "m", 0.031
    )
    pair: list[str] = described(BODIES, None, ["table", "tool"])
    time: float = described("Time of this sample, from the start of the motion.", "s", 0.62)
    spacing: float = described("Largest time between two samples.", "s", 0.01)


class EvaluateResponse(MotionAnswer):
    """The energy of a given motion, and the limits that it violates."""

    duration: float = described("Duration of the motion.", "s", 3.0)
    total: IntervalEnergy = part("The whole motion.")
    segments: list[IntervalEnergy] = part(
        "Segments between configurations. A trajectory is one segment, and a log has one for each move and each rest. "
        "Empty if there are more than 10,000."
    )
    segment_count: int = described("Number of segments.", "1", 2)
    speed_jumps: int = described(
        "Number of velocity steps inside the motion. A step contributes no energy, because its power is not defined.",
        "1",
        1,
    )
    within_limits: bool = described(
        "Whether the motion is within every limit; collisions are in `collides`.", None, False
    )
    limits: list[LimitCheck] = part("One entry per limit.")
    collides: bool | None = described(
        "Whether a clearance is negative at a sample; null if `collisions` is false.", None, False
    )
    nearest: SampledClearance | None = part("Smallest clearance at sample points; null if `collisions` is false.")
    warnings: list[str] = described(WARNINGS + " Of a log, also what `POST /logs` says of it.", None, [])
    samples: Annotated[Samples, Shown] | None = part("Samples of the motion; null without `sample_period`.")
