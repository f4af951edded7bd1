"""A motion that is asked for: what `POST /optimize` takes."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from app.schemas.arm import ArmRequest
from app.schemas.common import JointPositions, Request, by_field, described
from app.schemas.orientation import TargetPose
from optimizer.problem.problem import MethodName

MAX_DURATION = 600.0
"""Longest motion [s]."""
MAX_SAMPLES = 100_000
"""Most samples that an answer holds."""

Seconds = Annotated[float, Field(ge=1e-3, le=MAX_DURATION)]


class JointTarget(Request):
    """A target in joint space."""

    q: JointPositions = described("Joint positions from base to flange.", "rad", [0.0, -1.57, 1.57, -1.57, -1.57, 0.0])


class PoseTarget(Request):
    """A target in space: every arm configuration that reaches it is a candidate."""

    pose: TargetPose = described(
        "Pose of the TCP in the robot's base frame. A goal's orientation may be free in part.",
        None,
        {"position": [0.4, -0.2, 0.3], "quaternion": [0, 1, 0, 0]},
    )


SingleTarget = Annotated[
    Annotated[JointTarget, Tag("by q")] | Annotated[PoseTarget, Tag("by pose")], by_field("q", "pose")
]


class AnyOfTarget(Request):
    """Several targets: the one that costs least is taken."""

    any_of: list[SingleTarget] = described(
        "The targets, joints or poses, in any mixture. Those out of reach are listed in the answer's `unreachable`.",
        None,
        [
            {"pose": {"position": [0.4, -0.2, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
            {"q": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]},
        ],
        min_length=1,
        max_length=64,
    )


Target = Annotated[
    Annotated[JointTarget, Tag("by q")]
    | Annotated[PoseTarget, Tag("by pose")]
    | Annotated[AnyOfTarget, Tag("by any_of")],
    by_field("q", "pose", "any_of"),
]


class DurationRange(Request):
    """Bounds on the duration; either may be left out."""

    min: Seconds | None = described("Shortest duration.", "s", 1.0, default=None)
    max: Seconds | None = described("Longest duration.", "s", 3.0, default=None)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.min is not None and self.max is not None and self.min > self.max:
            raise PydanticCustomError("range", "`min` must not exceed `max`")
        return self


def _by_kind(value: Any) -> str | None:
    if isinstance(value, bool):
        return None
    if isinstance(value, int | float):
        return "seconds"
    return "range" if isinstance(value, dict | DurationRange) else None


Duration = Annotated[
    Annotated[Seconds, Tag("seconds")] | Annotated[DurationRange, Tag("range")],
    Discriminator(
        _by_kind,
        custom_error_type="duration",
        custom_error_message="Give null, a number of seconds, or an object with `min`, `max` or both",
    ),
]


class Branch(Request):
    """Arm configurations to keep to; a part left out is free."""

    shoulder: Literal["left", "right"] | None = described(
        "Side of the shoulder that the arm is on.", None, "left", default=None
    )
    elbow: Literal["up", "down"] | None = described("Elbow above or below.", None, "up", default=None)
    wrist: Literal["flip", "no_flip"] | None = described("Wrist flipped or not.", None, "no_flip", default=None)


class Cycle(Request):
    """When the arm is needed again after the motion's start, and how it is held still until then."""

    time: Seconds = described(
        "From the start of the motion to the end of the wait: the motion takes no longer.", "s", 6.0
    )
    hold: Literal["motors", "brakes"] = described(
        "Whether the motors hold the arm all the time, or the brakes after `brake_delay`.",
        None,
        "brakes",
        default="motors",
    )
    brake_delay: float = described(
        "Time from the motion's end until the brakes hold.", "s", 0.5, default=0.0, ge=0, le=MAX_DURATION
    )
    brake_power: Annotated[float, Field(ge=0, le=1e4)] | None = described(
        "What the arm draws on its brakes, electronics included. Null: what the electronics draw.",
        "W",
        20.0,
        default=None,
    )


class MotionRequest(ArmRequest):
    """A motion from rest at `start` to rest at `goal`."""

    start: Target = described(
        "Where the motion starts: joints, a pose, or any of several.",
        None,
        {"q": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]},
    )
    goal: Target = described(
        "Where it ends: joints, a pose, or any of several.",
        None,
        {"pose": {"position": [0.4, -0.2, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
    )
    objective: Literal["electrical", "mechanical"] = described(
        "What is minimised: energy drawn from the bus, or the joints' absolute mechanical work.",
        None,
        "electrical",
        default="electrical",
    )
    duration: Duration | None = described(
        "Duration, or its bounds. Null lets the optimiser choose (`mechanical` then needs a number or a `max`: it has "
        f"no best duration of its own). At most {MAX_DURATION:g} s, and {MAX_SAMPLES} times `sample_period`.",
        "s",
        {"max": 3.0},
        default=None,
    )
    cycle: Cycle | None = described(
        "Wait at the goal until the cycle is over; the energy then includes the wait. Null: the motion alone.",
        None,
        {"time": 6.0, "hold": "brakes", "brake_delay": 0.5, "brake_power": 20.0},
        default=None,
    )
    branch: Branch | None = described(
        "Arm configurations to keep to. Null: try them all.",
        None,
        {"shoulder": "left", "elbow": "up", "wrist": "no_flip"},
        default=None,
    )
    windings: bool = described(
        "Whether to also try goals a full turn away, where the joint range allows.", None, True, default=True
    )
    sample_period: float = described(
        "Time between the returned samples; the last sample lies on the end.", "s", 0.008, default=0.008, ge=1e-4, le=1
    )
    deadline: float = described(
        "Wall time, waiting included, after which the best verified result so far is returned.",
        "s",
        10.0,
        default=10.0,
        ge=1e-3,
        le=MAX_DURATION,
    )

    @model_validator(mode="after")
    def _few_enough_samples(self) -> Self:
        longest = self.duration.max or self.duration.min if isinstance(self.duration, DurationRange) else self.duration
        if longest is not None and longest > self.sample_period * MAX_SAMPLES:
            raise PydanticCustomError(
                "too_many_samples",
                "`duration` divided by `sample_period` must be at most {most}: lengthen `sample_period`",
                {"most": MAX_SAMPLES},
            )
        return self


class OptimizeRequest(MotionRequest):
    """A motion from rest at `start` to rest at `goal`, by one method."""

    method: MethodName = described(
        "How the motion is parametrised. `bspline`: every joint a free B-spline. `time_scaling`: the straight line in "
        "joint space with an optimised time law. `lagrange`: every joint one polynomial, by its values at Chebyshev "
        "nodes. `uniform_scaling`: the time-optimal motion slowed evenly. `polynomial_ga`: one polynomial each, bred "
        "by a genetic algorithm over the three likeliest candidates: seconds, and never `optimal`.",
        None,
        "bspline",
        default="bspline",
    )
