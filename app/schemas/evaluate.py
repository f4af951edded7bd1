"""What `POST /evaluate` takes and answers."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from app.schemas.arm import ArmRequest, by_shape
from app.schemas.common import JointPositions, Request, Response, described, part
from app.schemas.request import MAX_SAMPLES, Seconds
from app.schemas.response import ElectricalEnergy, JointEnergy, JointSamples, MechanicalEnergy, Samples, Storage
from optimizer.replay.limit_report import LimitName

MAX_ROWS = 100_000
"""Most rows of a motion sent as JSON; a CSV holds more."""
_HOME = [0.0, -1.5708, 1.5708, -1.5708, 3.1416, 0.0]
_THERE = [-0.1243, -0.9639, 1.6165, -2.2211, 4.7124, 0.1251]

Rows = Annotated[list[JointPositions], Field(min_length=2, max_length=MAX_ROWS)]
_Rates = Annotated[list[Annotated[float, Field(ge=-1e7, le=1e7)]], Field(min_length=1, max_length=16)]
RateRows = Annotated[list[_Rates], Field(min_length=2, max_length=MAX_ROWS)]
Times = Annotated[list[Annotated[float, Field(ge=-1e12, le=1e12)]], Field(min_length=2, max_length=MAX_ROWS)]
SecondsPerSegment = Annotated[
    Annotated[Seconds, Tag("one")]
    | Annotated[Annotated[list[Seconds], Field(min_length=1, max_length=MAX_ROWS)], Tag("each")],
    Discriminator(
        by_shape, custom_error_type="one_or_each", custom_error_message="Give one number or a list, one per segment"
    ),
]


class LoggedTrajectory(Request):
    """Joint positions over time, as logged or as answered by `POST /optimize`; arrays are [sample][joint]."""

    t: Times = described("Time of each sample: each later than the one before.", "s", [0.0, 0.008, 0.016])
    q: Rows = described("Joint positions.", "rad", [_HOME, _HOME, _HOME])
    v: RateRows | None = described(
        "Joint velocities. Null: the derivative of a cubic spline through `q`.", "rad/s", [[0.0] * 6] * 3, default=None
    )
    a: RateRows | None = described(
        "Joint accelerations. Null: the derivative of the velocity's spline. Nothing is smoothed: noise e in `q` at "
        "steps h becomes noise of up to 12 e / h² here.",
        "rad/s²",
        [[0.0] * 6] * 3,
        default=None,
    )

    @model_validator(mode="after")
    def _same_length(self) -> Self:
        logged = [rows for rows in (self.q, self.v, self.a) if rows is not None]
        if any(len(rows) != len(self.t) for rows in logged):
            raise PydanticCustomError("lengths", "`t`, `q`, `v` and `a` must have one entry per sample each")
        if any(
            rows is not None and len(row) != len(self.q[0]) for rows in (self.q, self.v, self.a) for row in rows or []
        ):
            raise PydanticCustomError("lengths", "Every row of `q`, `v` and `a` must have one number per joint")
        return self


class EvaluateSettings(ArmRequest):
    """The arm, and how a given motion is to be read."""

    time_per_segment: SecondsPerSegment | None = described(
        "Time from each configuration to the next: one number, or one per segment. Needed with `configurations`.",
        "s",
        1.5,
        default=None,
    )
    interpolation: Literal["linear", "trapezoid", "quintic", "spline"] = described(
        "How the arm goes through `configurations`. `linear`: at constant joint speed, which jumps where segments "
        "meet; `trapezoid` (of speed), `quintic`: from rest to rest in every segment; `spline`: one smooth curve "
        "through all, at rest at both ends.",
        None,
        "linear",
        default="quintic",
    )
    sample_period: float | None = described(
        "Time between the samples to return; the last one lies on the end. Null: none are returned. At most "
        f"{MAX_SAMPLES} samples.",
        "s",
        0.05,
        default=None,
        ge=1e-4,
        le=3600,
    )


class EvaluateRequest(EvaluateSettings):
    """A given motion: exactly one of `configurations` and `trajectory`."""

    configurations: Rows | None = described(
        "Joint positions to go through, one after the other.", "rad", [_HOME, _THERE, _HOME], default=None
    )
    trajectory: LoggedTrajectory | None = described(
        "A logged trajectory.", None, {"t": [0.0, 1.5, 3.0], "q": [_HOME, _THERE, _HOME]}, default=None
    )

    @model_validator(mode="after")
    def _one_motion(self) -> Self:
        if (self.configurations is None) == (self.trajectory is None):
            raise PydanticCustomError("exactly_one", "Give exactly one of `configurations` and `trajectory`")
        if self.configurations is not None and self.time_per_segment is None:
            raise PydanticCustomError("missing", "`configurations` need `time_per_segment`")
        given = self.model_fields_set & {"time_per_segment", "interpolation"}
        if self.trajectory is not None and given:
            raise PydanticCustomError(
                "contradiction", "A `trajectory` has its own times: leave `time_per_segment` and `interpolation` out"
            )
        return self


class EvaluateCsvSettings(EvaluateSettings):
    """The query parameters of a CSV upload."""

    units: Literal["rad", "deg"] = described(
        "Of all joint columns: positions, velocities, accelerations.", None, "deg", default="rad"
    )


class MotionEnergy(Response):
    """Energy of a motion or a part of it."""

    electrical: ElectricalEnergy = part("Energy drawn from the bus.")
    mechanical: MechanicalEnergy = part("Absolute mechanical work.")
    per_joint: JointEnergy = part("The same, joint by joint.")
    storage: Storage | None = part("The bus' store; null without one.")
    peak_power: float = described("Greatest power drawn from the supply.", "W", 86.1)
    mean_power: float = described("Mean power drawn from the supply.", "W", 51.0)


class IntervalEnergy(Response):
    """A segment of the motion, or all of it."""

    start: float = described("When it starts, from the motion's start.", "s", 0.0)
    end: float = described("When it ends.", "s", 1.5)
    energy: MotionEnergy = part("What it costs.")
    mean_mechanical_power: float = described("Mean of Σ |tau v|: mechanical energy over the duration.", "W", 14.3)
    kinetic_start: float = described("Kinetic energy just after the start, rotors included.", "J", 6.9)
    kinetic_end: float = described("Kinetic energy just before the end.", "J", 6.2)
    balance_error: float = described(
        "|sum of the electrical parts - total| / total: the quadrature's error, and how badly logged `v` and `a` fit "
        "the logged `q`.",
        "1",
        1e-9,
    )


class LimitCheck(Response):
    """Where the motion comes nearest to a limit, or breaks it most."""

    limit: LimitName = described("Which; of the last three those that were asked for.", None, "velocity")
    held: bool = described("Whether the motion holds it.", None, True)
    worst_ratio: float | None = described(
        "|value| / limit; for positions the distance from the middle of the range over half of it. Null where the "
        "value is not finite.",
        "1",
        0.42,
    )
    joint: str | None = described("Joint; null for tool_cone, tcp_speed and elbow_speed.", None, "wrist_2_joint")
    t: float = described("When, from the motion's start.", "s", 0.75)
    value: float | None = described(
        "Its value, in the limit's unit: rad, rad/s, rad/s², rad/s³, N·m, m/s. Null where it is not finite: "
        "acceleration where speed jumps, jerk where acceleration jumps.",
        "SI",
        1.31,
    )
    bound: float = described("The limit, in the same unit.", "SI", 3.1416)


class Nearest(Response):
    """What came nearest to what, by samples: no proof, between two of them the arm may come nearer."""

    distance: float = described(
        "Least distance met, less the obstacle's margin; below zero they overlap by that much.", "m", 0.031
    )
    pair: list[str] = described("Which: links, `tool`, `payload`, obstacles.", None, ["table", "tool"])
    time: float = described("When, from the motion's start.", "s", 0.62)
    spacing: float = described("Greatest time between two samples.", "s", 0.01)


class EvaluatedSamples(Response):
    """The motion, sampled; arrays are [sample][joint]."""

    t: Samples = described("Time of each sample, from the motion's start.", "s", [0.0, 0.05, 0.1])
    q: JointSamples = described("Joint positions.", "rad", [_HOME])
    v: JointSamples = described("Joint velocities; where they jump, the later ones.", "rad/s", [[0.0] * 6])
    a: JointSamples = described("Joint accelerations; where they jump, the later ones.", "rad/s²", [[0.0] * 6])
    tau: JointSamples = described(
        "Torque of rigid body and rotor, without friction.", "N·m", [[0.0, -38.1, -16.4, -1.2, 0.0, 0.0]]
    )
    tau_motor: JointSamples = described(
        "Motor torque at the joint, friction included.", "N·m", [[0.0, -38.1, -16.4, -1.2, 0.0, 0.0]]
    )
    power: Samples = described("Power drawn from the supply.", "W", [42.5, 43.1, 45.0])
    charge: Samples | None = described(
        "Charge of the energy storage on the bus; null without one.", "J", [0.0, 2.1, 5.3]
    )


class EvaluateResponse(Response):
    """What a given motion costs, and which limits it holds."""

    id: str = described(
        "The request's id, as in the `X-Request-ID` header.", None, "0b0f3b0e-4c4f-4a43-9d6b-1f6f2f1f6a55"
    )
    robot: str = described("Name of the robot.", None, "ur5e")
    duration: float = described("Duration of the motion.", "s", 3.0)
    total: IntervalEnergy = part("The motion as a whole.")
    segments: list[IntervalEnergy] = part(
        "Its segments from configuration to configuration, or the whole of a trajectory; empty where there are more "
        "than ten thousand."
    )
    segment_count: int = described("How many segments there are.", "1", 2)
    speed_jumps: int = described(
        "Instants within the motion at which speed jumps: the energy there is left out, for acceleration is not "
        "finite.",
        "1",
        1,
    )
    within_limits: bool = described("Whether every limit is held.", None, False)
    limits: list[LimitCheck] = part("Every limit, one entry each.")
    collides: bool | None = described("Whether two bodies overlap at a sample; null without comparison.", None, False)
    nearest: Nearest | None = part("What came nearest to what; null where `collisions` is false.")
    samples: EvaluatedSamples | None = part("Samples, where `sample_period` was given; else null.")
