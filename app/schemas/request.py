"""Request of `POST /optimize`, and the fields shared by all requests for a motion."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

from pydantic import Field, Tag, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.schemas.arm import ArmRequest
from joulepath.app.schemas.common import (
    JointPositions,
    Request,
    by_field,
    described,
    number_or_object,
)
from joulepath.app.schemas.deadline import DeadlineSeconds
from joulepath.app.schemas.examples.values import HOME
from joulepath.app.schemas.orientation import TargetPose
from joulepath.app.schemas.path import Path
from joulepath.optimizer.evaluate.recording import MOTION_LIMITS
from joulepath.optimizer.problem.problem import DURATIONS, MethodName, RequestedBound
from joulepath.optimizer.result.energy import Objective

Seconds = Annotated[float, Field(ge=1e-3, le=DURATIONS.longest)]


WhichCandidates = Literal["all", "computed", "none"]


def which_candidates() -> Any:
    """The field `candidates` of a request."""
    return described(
        "Candidates that the answer lists. `computed`: those for which a motion was computed, "
        "found or not (`solved`, `failed`, and `pruned` during the search). `all`: also those that "
        "were ruled out or not reached, thousands for two poses. `none`: no candidates. "
        "`candidate_counts` counts all of them in any case.",
        None,
        "all",
        default="computed",
    )


class JointTarget(Request):
    """A target as joint positions."""

    q: JointPositions = described(
        "Joint positions, from base to flange.", "rad", [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
    )


class PoseTarget(Request):
    """A target as a pose of the TCP. All configurations of the arm at this pose are candidates."""

    pose: TargetPose = described(
        "Pose of the TCP in the robot's base frame, or in its `frame`. The orientation of a goal "
        "may be free in part, and that of a start with a `path`.",
        None,
        {"position": [0.4, -0.2, 0.3], "quaternion": [0, 1, 0, 0]},
    )


SingleTarget = Annotated[
    Annotated[JointTarget, Tag("by q")] | Annotated[PoseTarget, Tag("by pose")],
    by_field("q", "pose", example={"q": HOME}),
]


class AnyOfTarget(Request):
    """Several targets. The answer moves to the target of least energy."""

    any_of: list[SingleTarget] = described(
        "Joint positions and poses, mixed. Targets that the arm cannot reach are in `unreachable` "
        "of the answer.",
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
    by_field("q", "pose", "any_of", example={"q": HOME}),
]


class DurationRange(Request):
    """Bounds on the duration. Both are optional."""

    min: Seconds | None = described("Smallest duration. Null: no bound.", "s", 1.0, default=None)
    max: Seconds | None = described("Largest duration. Null: no bound.", "s", 3.0, default=None)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.min is not None and self.max is not None and self.min > self.max:
            raise PydanticCustomError("range", "`min` must not exceed `max`")
        return self


SECONDS_OR_RANGE = number_or_object(
    "seconds", "duration", "Give null, a number of seconds, or an object with `min`, `max` or both"
)

Duration = Annotated[
    Annotated[Seconds, Tag("seconds")] | Annotated[DurationRange, Tag("range")], SECONDS_OR_RANGE
]


class Branch(Request):
    """Allowed branches. A part with the value null is unrestricted."""

    shoulder: Literal["left", "right"] | None = described(
        "Side of the first axis on which the plane of the arm lies, seen along the reach.",
        None,
        "left",
        default=None,
    )
    elbow: Literal["up", "down"] | None = described(
        "`up`: the elbow is above the line from shoulder to wrist, if the arm reaches forward.",
        None,
        "up",
        default=None,
    )
    wrist: Literal["flip", "no_flip"] | None = described(
        "`no_flip`: sin(q5) < 0, as with the tool pointing down in a usual posture.",
        None,
        "no_flip",
        default=None,
    )


class Holding(Request):
    """How the arm is held during a wait: by the motors or by the brakes."""

    hold: Literal["motors", "brakes"] = described(
        "`motors`: the motors hold the arm during the wait. `brakes`: the motors hold it for "
        "`brake_delay`, then the brakes.",
        None,
        "brakes",
        default="motors",
    )
    brake_delay: float = described(
        "Time between the end of the motion and the brakes.",
        "s",
        0.5,
        default=0.0,
        ge=0,
        le=DURATIONS.longest,
    )
    brake_power: Annotated[float, Field(ge=0, le=1e4)] | None = described(
        "Power drawn while the brakes hold, electronics included. Null: the power of the "
        "electronics.",
        "W",
        20.0,
        default=None,
    )


class Dwell(Holding):
    """The wait at the goal: when it ends, and whether motors or brakes hold the arm."""

    time: Seconds = described(
        "Time from the start of the motion until the arm is needed again. The motion takes no "
        "longer.",
        "s",
        6.0,
    )


class MotionRequest(ArmRequest):
    """A motion from standstill at `start` to standstill at `goal`."""

    start: Target = described(
        "Start of the motion: joint positions, a pose of the TCP, or one of several targets.",
        None,
        {"q": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]},
    )
    goal: Target = described(
        "End of the motion: joint positions, a pose of the TCP, or one of several targets.",
        None,
        {"pose": {"position": [0.4, -0.2, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
    )
    objective: Objective = described(
        "Energy that is minimised. `electrical`: energy drawn from the supply. `mechanical`: work "
        "of the joints without friction, ∫ Σ_j |tau_j v_j| dt.",
        None,
        "electrical",
        default="electrical",
    )
    duration: Duration | None = described(
        "Duration, or bounds on it. Null: the optimiser chooses the duration. The objective "
        "`mechanical` needs a number, a `max` or a `dwell`, because a slower motion needs less "
        f"work. The duration is at most {DURATIONS.longest:g} s and at most "
        f"{MOTION_LIMITS.max_samples} times `sample_period`.",
        "s",
        {"max": 3.0},
        default=None,
    )
    dwell: Dwell | None = described(
        "The arm waits at the goal until the end of the dwell, and the energy includes the wait. "
        "Null: no wait.",
        None,
        {"time": 6.0, "hold": "brakes", "brake_delay": 0.5, "brake_power": 20.0},
        default=None,
    )
    branch: Branch | None = described(
        "Allowed branches of the arm configurations that reach a pose, at both ends. Null: all "
        "branches.",
        None,
        {"shoulder": "left", "elbow": "up", "wrist": "no_flip"},
        default=None,
    )
    windings: bool = described(
        "Whether full-turn alternatives q + 2πk within the joint range are separate candidates.",
        None,
        True,
        default=True,
    )
    candidates: WhichCandidates = which_candidates()
    sample_period: float = described(
        "Time between the returned samples. The last sample is at the end of the motion.",
        "s",
        0.008,
        default=0.008,
        ge=DURATIONS.least_period,
        le=1,
        validate_default=True,
    )
    deadline: DeadlineSeconds = described(
        "Wall time from the arrival of the request, including the wait for a worker. When it "
        "passes, the service returns the best certified motion found so far.",
        "s",
        10.0,
        default=10.0,
    )

    @field_validator("sample_period")
    @classmethod
    def _few_enough_samples(cls, period: float, info: ValidationInfo) -> float:
        duration = info.data.get("duration")
        longest = duration.max or duration.min if isinstance(duration, DurationRange) else duration
        if longest is not None and longest > period * MOTION_LIMITS.max_samples:
            least = math.ceil(longest / MOTION_LIMITS.max_samples * 1e4) / 1e4
            raise PydanticCustomError(
                "too_many_samples",
                "An answer has at most {most} samples: for a `duration` of up to {longest} s, "
                "`sample_period` must be at least {least} s",
                {"most": MOTION_LIMITS.max_samples, "longest": longest, "least": least},
            )
        return period


class OptimizeRequest(MotionRequest):
    """A motion from standstill at `start` to standstill at `goal`, by one method."""

    method: MethodName = described(
        "How the motion is parametrised. `bspline`: one B-spline per joint. `time_scaling`: the "
        "straight line in joint space with an optimised time scaling. `lagrange`: one "
        "polynomial per joint, given by its values at Chebyshev nodes. `uniform_scaling`: the "
        "time-optimal motion, uniformly slowed down. `polynomial_ga`: one polynomial per joint, "
        "found by a genetic algorithm for at most three candidates; it takes seconds, and its "
        "`status` is never `optimal`. Every method avoids obstacles; where their own path "
        "collides, `time_scaling` and `uniform_scaling` follow a planned path.",
        None,
        "bspline",
        default="bspline",
    )
    path: Path | None = described(
        "Path of the TCP from `start` to `goal`, each of which must then be joint positions or "
        "one pose. The orientation of either may be `free_about` the axis `tolerance.about`. "
        "`method` and `windings` have no effect. Null: the motion is free.",
        None,
        {"tolerance": {"position": 1e-4}},
        default=None,
    )
    bound: RequestedBound = described(
        "Effort for `lower_bound`. `tight`: the candidates whose bound is below the energy of the "
        "answer get a second, greater one, which takes the copper loss of holding against gravity "
        "into account. It takes some tenths of a second per candidate, lowest bound first, and "
        "ends before the `deadline`. For the objective `electrical`. The bound of a free "
        "orientation gets more effort, too. For the objective `mechanical`, candidates that differ "
        "by full turns of the outer joints are all solved, unless their bounds rule them out.",
        None,
        "normal",
        default="normal",
    )
