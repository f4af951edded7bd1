"""What `POST /cycle` takes and answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, Self

from pydantic import Field, Tag, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.answers.bounded_energy import EnergyAndBound
from joulepath.app.answers.declared import Shown
from joulepath.app.schemas.arm import ArmRequest
from joulepath.app.schemas.common import Answer, Response, described, part
from joulepath.app.schemas.examples.values import ANSWER_PATH
from joulepath.app.schemas.request import (
    SECONDS_OR_RANGE,
    Branch,
    DurationRange,
    Holding,
    Target,
    WhichCandidates,
    which_candidates,
)
from joulepath.app.schemas.stop import PlainName, StopRequest
from joulepath.app.schemas.wording import WARNINGS
from joulepath.app.settings import LONGEST_DEADLINE
from joulepath.optimizer.cycle.cycle_solution import CycleBaselineName
from joulepath.optimizer.declared import Joules, Seconds
from joulepath.optimizer.problem.cycle import LONGEST_ROUND, MOST_STOPS
from joulepath.optimizer.problem.free_order import MOST_FREE_STOPS
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.result.certificate import Clearance, WorstRatio
from joulepath.optimizer.result.energy import Objective, SavingInterval
from joulepath.optimizer.result.solution import Configuration

# of a cycle with more stops, the default deadline is longer, and samples are no closer: answers stay as large as before
_MANY_STOPS, _LONG_DEADLINE, _LEAST_PERIOD = 100, 120.0, 1e-3

LongTime = Annotated[float, Field(gt=0, le=LONGEST_ROUND)]


class TimeRange(DurationRange):
    """Bounds on the duration of a cycle; each is optional."""

    min: LongTime | None = described("Smallest duration. Null: no bound.", "s", 10.0, default=None)
    max: LongTime | None = described("Largest duration. Null: no bound.", "s", 12.0, default=None)


CycleTime = Annotated[Annotated[LongTime, Tag("seconds")] | Annotated[TimeRange, Tag("range")], SECONDS_OR_RANGE]


class CycleRequest(ArmRequest):
    """A cycle of stops. `payload` is what the arm carries to the first stop that changes it."""

    start: Target = described(
        "Where the arm rests before the first move: joint positions, a pose of the TCP, or one of several targets.",
        None,
        {"q": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]},
    )
    stops: Annotated[list[StopRequest], Field(min_length=1, max_length=MOST_STOPS)] = described(
        "The stops; in the order in which they are visited, unless `order` is free.",
        None,
        [
            {
                "name": "pick",
                "target": {"pose": {"position": [0.4, -0.2, 0.1], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
                "payload": {"mass": 2.0, "com": [0.0, 0.0, 0.1]},
            },
            {
                "name": "place",
                "target": {"pose": {"position": [0.1, 0.5, 0.2], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
                "payload": None,
            },
        ],
    )
    order: Literal["given", "free"] = described(
        "`given`: the stops are visited in the order of `stops`. `free`: in the order that needs the least energy, for "
        f"at most {MOST_FREE_STOPS} stops. The arm then carries the same between groups of stops as at the start.",
        None,
        "given",
        default="given",
    )
    before: Annotated[list[Annotated[list[PlainName], Field(min_length=2, max_length=2)]], Field(max_length=132)] = (
        described(
            "With a free order: pairs of stops, of which the first is visited earlier than the second.",
            None,
            [["pick", "inspect"]],
            default=[],
        )
    )
    together: Annotated[
        list[Annotated[list[PlainName], Field(min_length=2, max_length=MOST_FREE_STOPS)]],
        Field(max_length=MOST_FREE_STOPS),
    ] = described(
        "With a free order: lists of stops that are visited one directly after the other, as they are listed, like the "
        "one where a part is taken up and the one where it is put down.",
        None,
        [["pick", "place"]],
        default=[],
    )
    closed: bool = described(
        "Whether the arm returns to the start after the last stop: to the same joint positions, full turns included.",
        None,
        True,
        default=True,
    )
    time: CycleTime | None = described(
        "Duration of the cycle, dwells and waiting included, or bounds on it. Time is shared among the moves so that "
        "the energy is least; what is left over is waited out where that costs least. Null: the optimiser chooses.",
        "s",
        12.0,
        default=None,
    )
    objective: Objective = described(
        "`electrical`: the energy drawn by the whole cycle. `mechanical`: the work of its moves, ∫ Σ |tau_j v_j| dt; "
        "rests need none, and slower moves less, so it needs a `time` or a `time.max`.",
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
        "Where time that is left over is waited out: `start`, or the name of a stop. Null: where that costs least.",
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
        "Whether full-turn alternatives q + 2πk within the joint range count at every stop. If not, each configuration "
        "has the joint positions nearest to the middle of the joint range.",
        None,
        True,
        default=True,
    )
    candidates: WhichCandidates = which_candidates()
    sample_period: float = described(
        f"Time between the samples of the answers of the moves. With more than {_MANY_STOPS} stops, at least "
        f"{_LEAST_PERIOD:g} s.",
        "s",
        0.008,
        default=0.008,
        ge=1e-4,
        le=1,
    )
    deadline: float = described(
        "Wall time from the arrival of the request, including the wait for a worker. When it nears, the service "
        f"returns the best certified cycle found so far. With more than {_MANY_STOPS} stops, the default is "
        f"{_LONG_DEADLINE:g} s.",
        "s",
        60.0,
        default=60.0,
        ge=1e-3,
        le=LONGEST_DEADLINE,
    )

    @field_validator("sample_period")
    @classmethod
    def _few_enough_samples(cls, period: float, info: ValidationInfo) -> float:
        if len(info.data.get("stops", ())) > _MANY_STOPS and period < _LEAST_PERIOD:
            raise PydanticCustomError(
                "too_many_samples",
                "With more than {stops} stops, `sample_period` must be at least {least} s",
                {"stops": _MANY_STOPS, "least": _LEAST_PERIOD},
            )
        return period

    @model_validator(mode="after")
    def _long_enough(self) -> Self:
        if "deadline" not in self.model_fields_set and len(self.stops) > _MANY_STOPS:
            # still a default: it is no longer than the service allows
            object.__setattr__(self, "deadline", _LONG_DEADLINE)
        return self

    @model_validator(mode="after")
    def _order_is_free(self) -> Self:
        if self.order == "given" and (self.before or self.together):
            raise PydanticCustomError("order", "`before` and `together` need `order` to be free")
        return self


@dataclass(frozen=True, kw_only=True)
class CycleEnergy(EnergyAndBound):
    """Energy of the cycle: the moves, and dwells and waiting in `electrical.dwell`."""

    lower_bound: Joules
    """Lower bound of the objective: no cycle that rests at these stops, or goes through those with
    `via`, of any configurations, shapes and durations, needs less."""


@dataclass(frozen=True, kw_only=True)
class StopConfiguration(Configuration):
    """The arm configuration at a place of the cycle."""

    stop: str
    """Name of the stop; with `/approach` or `/retreat` at the outer end of its line, with `/entry` at
    the start of its path; `start` for the start."""


@dataclass(frozen=True, kw_only=True)
class Passed(StopConfiguration):
    """A stop that a move passes through, and in which arm configuration."""

    t: Seconds
    """When it passes, from the start of the move."""


class CycleLeg(Response):
    """A move from one place to the next, the dwell at a stop, or a wait."""

    kind: Literal["move", "line", "path", "dwell", "wait"] = described(
        "`move`; `line` into or out of a stop; `path` of a stop; `dwell` at a stop; `wait` there for what is left of "
        "the time.",
        None,
        "move",
    )
    start: Annotated[StopConfiguration, Shown] = part("Where it begins.")
    goal: Annotated[StopConfiguration, Shown] = part("Where it ends; of a dwell and a wait, where it began.")
    passes: list[Annotated[Passed, Shown]] = part("Stops that the move passes through, in their order.")
    t0: float = described("When it begins, from the start of the cycle.", "s", 1.42)
    duration: float = described("How long it takes.", "s", 0.91)
    electrical: float = described("Electrical energy drawn from the supply.", "J", 71.3)
    mechanical: float = described("Mechanical work.", "J", 30.2)
    lower_bound: float = described(
        "Lower bound of the objective between these configurations; of a rest, what it adds to the objective.",
        "J",
        64.0,
    )
    payload_mass: float = described("Mass of the payload that the arm carries.", "kg", 2.0)
    charge: float | None = described(
        "Charge of the energy storage on the bus when it ends; null without one.", "J", 5.3, default=None
    )
    answer: str | None = described(
        "Path of the complete answer of `POST /optimize` for this move; null for a rest.", None, ANSWER_PATH
    )


class CycleBaseline(Response):
    """The same stops with the same payloads and dwells, in another way, and in the `time` that is asked for."""

    name: CycleBaselineName = described(
        "`stopping`: the best cycle that rests at the stops with `via`, too; the others then rest there as well. "
        "`move_by_move`: at each stop the move that needs the least energy by itself, as successive calls of "
        "`POST /optimize` choose it. `controller_default`: to the nearest configuration each time, by the robot's own "
        "controller with its default speed and acceleration. Where `time` changes the cycle: `same_factor`, every move "
        "slowed or sped up alike; `fastest_then_wait`, the fastest cycle, in configurations of its own, and a wait. "
        "With a free order, where it is allowed: `given_order`, the best cycle in the order of `stops`. With an energy "
        "storage on the bus: `without_storage`, the best cycle on the same bus without it, beside `move_by_move` "
        "alone.",
        None,
        "move_by_move",
    )
    duration: float = described("Duration of this cycle.", "s", 9.9)
    electrical: float = described("Electrical energy of this cycle.", "J", 700.2)
    mechanical: float | None = described(
        "Mechanical work of its moves. Null in answers of an earlier version.", "J", 310.4, default=None
    )
    within_limits: bool = described(
        "Whether every move is within the limits; collisions are checked at sample points.", None, True
    )
    saving: float = described("1 - energy of the answer / energy of this cycle, of the objective.", "1", 0.15)
    saving_interval: Annotated[SavingInterval, Shown] | None = part(
        "How well the saving is known. Null for the objective `mechanical`, and in answers of an earlier version."
    )


@dataclass(frozen=True, kw_only=True)
class CycleClearance(Clearance):
    """Smallest clearance over all moves."""

    leg: int
    """Index in `legs`, from 0, of the move that comes so close."""


class CycleCertificate(Response):
    """The certificates of all moves, and how the moves fit together."""

    worst_ratio: Annotated[WorstRatio, Shown] = part("Largest value / limit over all moves, for each limit.")
    joins: float = described("Largest jump of a joint from the end of a move to the start of the next.", "rad", 0.0)
    pass_error: float = described(
        "Largest deviation of a joint from the configuration of a stop that a move passes through.", "rad", 0.0
    )
    energy_error: float = described("Largest `energy_error` of a move: see `POST /optimize`.", "1", 1e-6)
    balance_error: float = described(
        "Relative difference of the sum of the electrical parts of the cycle and the total.", "1", 1e-6
    )
    clearance: Annotated[CycleClearance, Shown] | None = part("Smallest clearance; null if `collisions` is false.")


class CycleSearch(Response):
    """Effort of the search."""

    pairs: int = described("Pairs of arm configurations, over all moves.", "1", 295296)
    distinct: int = described(
        "Of these, those that differ in more than full turns of both ends; each has a proven bound.", "1", 70368
    )
    solved: int = described("Of these, those for which a motion was sought.", "1", 22)
    wall_time: float = described("Wall time.", "s", 1.9)


class CycleResponse(Answer):
    """The cycle of least energy, its moves, and its certificate."""

    method: MethodName = described("How the moves are parametrised.", None, "bspline")
    objective: Objective = described("The energy that is minimised.", None, "electrical", default="electrical")
    order: list[str] = described("Names of the stops, as they are visited.", None, ["pick", "place"])
    duration: float = described("Duration of the cycle, dwells and waiting included.", "s", 8.3)
    status: Literal["optimal", "feasible"] = described(
        "`optimal`: every move converged, and no other chain of arm configurations has a lower bound below what was "
        "found. It does not say that no better cycle exists: see `optimality_gap`. `feasible`: the cycle is certified, "
        "but the search was not complete, or arm configurations may have been missed.",
        None,
        "optimal",
    )
    price_of_time: float = described(
        "What one more second would save; negative if it would cost energy. 0 if the cycle takes its own time.",
        "W",
        31.5,
    )
    energy: Annotated[CycleEnergy, Shown] = part("Energy and power of the cycle.")
    legs: Annotated[list[CycleLeg], Field(min_length=1)] = part("Moves and dwells in their order.")
    baselines: list[CycleBaseline] = part("The same cycle in other ways; without what was not found in time.")
    certificate: CycleCertificate = part("Independent check of all moves.")
    warnings: list[str] = described(f"{WARNINGS} Each names its move.", None, [])
    search: CycleSearch = part("Size and effort of the search for the cycle.")
    answer: str | None = described(
        "Path of this answer: `GET` returns it again. Null if it could not be kept.", None, ANSWER_PATH
    )
