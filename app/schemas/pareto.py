"""What `POST /pareto` takes and answers."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from joulepath.app.schemas.common import Answer, Response, described, part
from joulepath.app.schemas.examples.values import ANSWER_PATH, LABEL
from joulepath.app.schemas.request import DurationRange, OptimizeRequest
from joulepath.app.schemas.wording import OBJECTIVE
from joulepath.app.settings import LONGEST_DEADLINE
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.result.energy import Objective


class ParetoRequest(OptimizeRequest):
    """A motion whose Pareto front of duration and energy is requested."""

    points: int = described("Largest number of durations to solve.", "1", 12, default=12, ge=2, le=100)
    duration: DurationRange | None = described(
        "Bounds on the durations of the front. Null: from the shortest feasible duration to the duration of least "
        "energy. The objective `mechanical` needs a `max` or a `cycle`.",
        "s",
        {"max": 3.0},
        default=None,
    )
    deadline: float = described(
        "Wall time for the whole front, including the wait for a worker. When it passes, the service returns the front "
        "found so far.",
        "s",
        30.0,
        default=30.0,
        ge=1e-3,
        le=LONGEST_DEADLINE,
    )


class ParetoPoint(Response):
    """A motion of the front: no other motion found is better in both duration and energy."""

    duration: float = described("Duration of the motion.", "s", 0.7462)
    energy: float = described("Energy of the motion, of the objective.", "J", 45.5)
    start: str = described("Branch at the start.", None, LABEL)
    goal: str = described("Branch at the goal.", None, LABEL)
    electrical: float = described("Energy drawn from the supply.", "J", 45.5)
    mechanical: float = described("Mechanical work.", "J", 21.3)
    mean_power: float = described("Mean power drawn from the supply.", "W", 61.0)
    peak_power: float = described("Largest power drawn from the supply.", "W", 183.0)
    lower_bound: float = described("Lower bound of the objective: no motion of this duration needs less.", "J", 39.8)
    status: Literal["optimal", "feasible"] = described(
        "Status as `POST /optimize` returns it for this duration.", None, "optimal"
    )
    certified: bool = described(
        "Whether the certificate is valid: always true, because other motions are not returned.", None, True
    )
    worst_ratio: float = described("Largest value / limit over all limits.", "1", 0.9999)
    answer: str = described("Path of the complete answer of `POST /optimize`.", None, ANSWER_PATH)


class ParetoDropped(Response):
    """A duration that was solved and is not a point of the front."""

    duration: float = described("The duration.", "s", 0.787)
    energy: float | None = described(
        "Energy of the motion found, of the objective; null if none was found.", "J", 45.98
    )
    reason: str = described(
        "Why it is not a point.", None, "dominated: the motion of 0.7765 s is no slower and needs no more energy"
    )


class ParetoSolver(Response):
    """Effort of the computation of the whole front."""

    wall_time: float = described("Wall time.", "s", 2.4)
    nlp_solves: int = described("Nonlinear programs solved.", "1", 49)


class ParetoResponse(Answer):
    """The Pareto front of duration and energy."""

    method: MethodName = described("How the motions are parametrised.", None, "bspline")
    objective: Objective = described(OBJECTIVE, None, "electrical")
    status: Literal["optimal", "feasible"] = described(
        "`optimal`: every chosen duration was solved, and every point is `optimal`. `feasible`: every point is "
        "certified, but the deadline passed or some point is not `optimal`.",
        None,
        "optimal",
    )
    shortest: float = described("Duration of the fastest motion found, over all candidates.", "s", 0.7462)
    points: Annotated[list[ParetoPoint], Field(min_length=1)] = part("Points of the front, in order of duration.")
    dropped: list[ParetoDropped] = part("Durations that were solved and are not points of the front.")
    solver: ParetoSolver = part("Effort of the computation.")
