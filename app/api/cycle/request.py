"""Request of `POST /cycle`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, Self

from pydantic import Field, Tag, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.schemas.arm import ArmRequest, MoveLimits, Payload
from joulepath.app.schemas.common import NO_CONTROLS, PLAIN, Request, described
from joulepath.app.schemas.deadline import DeadlineSeconds
from joulepath.app.schemas.path import Line, StopPath
from joulepath.app.schemas.request import (
    SECONDS_OR_RANGE,
    Branch,
    DurationRange,
    Holding,
    Target,
    WhichCandidates,
    which_candidates,
)
from joulepath.optimizer.problem.cycle import CYCLE_RANGES
from joulepath.optimizer.problem.free_order import MOST_FREE_STOPS
from joulepath.optimizer.problem.names import LONGEST_NAME
from joulepath.optimizer.problem.problem import DURATIONS, MethodName
from joulepath.optimizer.problem.scene import SCENE_RANGES
from joulepath.optimizer.result.energy import Objective

PlainName = Annotated[str, Field(min_length=1, max_length=LONGEST_NAME, pattern=NO_CONTROLS), PLAIN]


class StopRequest(Request):
    """A stop: the arm comes to rest at the target, or at the end of a path, and may take up or put
    down a payload; or it passes through the target. It has exactly one of `target` and `path`."""

    name: PlainName | None = described(
        "Name of the stop, different from those of the others. Null: its number, from 1.",
        None,
        "pick",
        default=None,
    )
    target: Target | None = described(
        "Joint positions, a pose of the TCP, or one of several targets. The orientation of a "
        "single pose may be free in part: it is then chosen for the whole cycle, and the answer is "
        "`feasible`.",
        None,
        {"pose": {"position": [0.4, -0.2, 0.1], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
        default=None,
    )
    path: StopPath | None = described(
        "A path that the TCP follows, from rest at its first point to rest at its last. Null: "
        "none.",
        None,
        {
            "points": [
                {"position": [0.4, 0.0, 0.2], "quaternion": [0.0, 1.0, 0.0, 0.0]},
                {"position": [0.4, 0.3, 0.2], "quaternion": [0.0, 1.0, 0.0, 0.0]},
            ],
            "speed": 0.1,
        },
        default=None,
    )
    via: bool = described(
        "Whether the arm passes through the target without a rest, on its way to the next stop at "
        "which it rests. Then the stop has no `dwell`, `payload`, `path`, lines or "
        "`obstacles_ignored`, and the limits of all stops of this motion hold for all of it.",
        None,
        False,
        default=False,
    )
    dwell: float = described(
        "Time at rest at the stop; with a path, at its end.",
        "s",
        0.4,
        default=0.0,
        ge=0,
        le=DURATIONS.longest,
    )
    payload: Payload | None = described(
        "Payload from this stop on, dwell included; with a path, from its end on. Null: the "
        "payload is put down. If left out, it is unchanged.",
        None,
        {"mass": 2.0, "com": [0.0, 0.0, 0.1]},
        default=None,
    )
    branch: Branch | None = described(
        "Allowed branches of the arm configurations at this stop. Null: all branches.",
        None,
        {"elbow": "up"},
        default=None,
    )
    limits: MoveLimits = described(
        "Limits of the moves into this stop, its line and its path included. A limit has an effect "
        "if it is tighter than the limit of the request.",
        None,
        {"acceleration": 5.0, "tcp_speed": 0.5},
        default=MoveLimits(),
    )
    approach: Line | None = described(
        "Straight line of the TCP into the stop, or to the start of its path. The arm rests at its "
        "outer end. Null: none.",
        None,
        {"direction": [0.0, 0.0, 1.0], "distance": 0.08},
        default=None,
    )
    retreat: Line | None = described(
        "Straight line of the TCP out of the stop, or from the end of its path. The arm rests at "
        "its outer end. Null: none.",
        None,
        {"direction": [0.0, 0.0, -1.0], "distance": 0.08},
        default=None,
    )
    obstacles_ignored: Annotated[list[PlainName], Field(max_length=SCENE_RANGES.max_obstacles)] = (
        described(
            "Names of obstacles that are ignored at the stop, on its lines and its path, such "
            "as the part to grasp.",
            None,
            ["part"],
            default=[],
        )
    )

    @model_validator(mode="after")
    def _target_or_path(self) -> Self:
        if (self.target is None) == (self.path is None):
            raise PydanticCustomError(
                "target_or_path", "Give a stop exactly one of `target` and `path`"
            )
        return self


@dataclass(frozen=True)
class LongCycle:
    """Rules of cycles with many stops, so that their answers stay readable."""

    stops: int = 100
    """Most stops of an ordinary cycle."""
    deadline: float = 120.0
    """Default deadline above it [s]."""
    period: float = 1e-3
    """Least period of samples above it [s]."""


LONG_CYCLE = LongCycle()

LongTime = Annotated[float, Field(gt=0, le=CYCLE_RANGES.longest)]


class TimeRange(DurationRange):
    """Optional bounds on the duration of a cycle."""

    min: LongTime | None = described("Smallest duration. Null: no bound.", "s", 10.0, default=None)
    max: LongTime | None = described("Largest duration. Null: no bound.", "s", 12.0, default=None)


CycleTime = Annotated[
    Annotated[LongTime, Tag("seconds")] | Annotated[TimeRange, Tag("range")], SECONDS_OR_RANGE
]


class CycleRequest(ArmRequest):
    """A cycle of stops. `payload` is carried until the first stop with another payload."""

    start: Target = described(
        "Where the arm rests before the first move: joint positions, a pose of the TCP, or one of "
        "several targets.",
        None,
        {"q": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]},
    )
    stops: Annotated[list[StopRequest], Field(min_length=1, max_length=CYCLE_RANGES.max_stops)] = (
        described(
            "The stops; in the order in which they are visited, unless `order` is free.",
            None,
            [
                {
                    "name": "pick",
                    "target": {
                        "pose": {"position": [0.4, -0.2, 0.1], "quaternion": [0.0, 1.0, 0.0, 0.0]}
                    },
                    "payload": {"mass": 2.0, "com": [0.0, 0.0, 0.1]},
                },
                {
                    "name": "place",
                    "target": {
                        "pose": {"position": [0.1, 0.5, 0.2], "quaternion": [0.0, 1.0, 0.0, 0.0]}
                    },
                    "payload": None,
                },
            ],
        )
    )
    order: Literal["given", "free"] = described(
        "`given`: the stops are visited in the order of `stops`. `free`: in the order that "
        f"needs the least energy, for at most {MOST_FREE_STOPS} stops. The payload between "
        "groups of stops must then be that at the start.",
        None,
        "given",
        default="given",
    )
    before: Annotated[
        list[Annotated[list[PlainName], Field(min_length=2, max_length=2)]], Field(max_length=132)
    ] = described(
        "With a free order: pairs of stops, of which the first is visited earlier than the second.",
        None,
        [["pick", "inspect"]],
        default=[],
    )
    together: Annotated[
        list[Annotated[list[PlainName], Field(min_length=2, max_length=MOST_FREE_STOPS)]],
        Field(max_length=MOST_FREE_STOPS),
    ] = described(
        "With a free order: lists of stops that are visited directly one after another, in the "
        "listed order, such as the stops where a part is picked up and put down.",
        None,
        [["pick", "place"]],
        default=[],
    )
    closed: bool = described(
        "Whether the arm returns to the start after the last stop: to the same joint positions, "
        "full turns included.",
        None,
        True,
        default=True,
    )
    time: CycleTime | None = described(
        "Duration of the cycle, dwells and waiting included, or bounds on it. The time is "
        "divided among the moves for the least energy; the arm waits for the rest where this "
        "needs the least energy. Null: the optimiser chooses.",
        "s",
        12.0,
        default=None,
    )
    objective: Objective = described(
        "`electrical`: the energy drawn by the whole cycle. `mechanical`: the work of its "
        "moves, ∫ Σ |tau_j v_j| dt; slower moves need less work, so a `time` or a `time.max` is "
        "required.",
        None,
        "electrical",
        default="electrical",
    )
    hold: Holding = described(
        "How the arm is held while it dwells and waits.",
        None,
        {"hold": "brakes", "brake_delay": 0.5},
        default=Holding(),
    )
    wait: PlainName | None = described(
        "Where the arm waits for remaining time: `start`, or the name of a stop. Null: where "
        "this needs the least energy.",
        None,
        "start",
        default=None,
    )
    branch: Branch | None = described(
        "Allowed branches of the arm configurations at the start. Null: all branches.",
        None,
        {"shoulder": "left"},
        default=None,
    )
    method: MethodName = described(
        "How the moves are parametrised: see `POST /optimize`.", None, "bspline", default="bspline"
    )
    windings: bool = described(
        "Whether full-turn alternatives q + 2πk within the joint range are used at every stop. "
        "If not, each configuration has the joint positions nearest to the middle of the joint "
        "range.",
        None,
        True,
        default=True,
    )
    candidates: WhichCandidates = which_candidates()
    sample_period: float = described(
        f"Time between the samples of the answers of the moves. With more than {LONG_CYCLE.stops} "
        f"stops, at least {LONG_CYCLE.period:g} s.",
        "s",
        0.008,
        default=0.008,
        ge=DURATIONS.least_period,
        le=1,
    )
    deadline: DeadlineSeconds = described(
        "Wall time from the arrival of the request, including the wait for a worker. When it "
        "nears, the service returns the best certified cycle found so far. With more than "
        f"{LONG_CYCLE.stops} stops, the default is {LONG_CYCLE.deadline:g} s.",
        "s",
        60.0,
        default=60.0,
    )

    @field_validator("sample_period")
    @classmethod
    def _few_enough_samples(cls, period: float, info: ValidationInfo) -> float:
        if len(info.data.get("stops", ())) > LONG_CYCLE.stops and period < LONG_CYCLE.period:
            raise PydanticCustomError(
                "too_many_samples",
                "With more than {stops} stops, `sample_period` must be at least {least} s",
                {"stops": LONG_CYCLE.stops, "least": LONG_CYCLE.period},
            )
        return period

    @model_validator(mode="after")
    def _long_enough(self) -> Self:
        if "deadline" not in self.model_fields_set and len(self.stops) > LONG_CYCLE.stops:
            # still a default: it is no longer than the service allows
            object.__setattr__(self, "deadline", LONG_CYCLE.deadline)
        return self

    @model_validator(mode="after")
    def _order_is_free(self) -> Self:
        if self.order == "given" and (self.before or self.together):
            raise PydanticCustomError("order", "`before` and `together` need `order` to be free")
        return self
