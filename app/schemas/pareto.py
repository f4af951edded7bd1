"""What `POST /pareto` takes and answers."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from app.schemas.answers import KeptAnswer
from app.schemas.common import Response, described, part
from app.schemas.request import MAX_DURATION, DurationRange, OptimizeRequest
from optimizer.problem.problem import MethodName

_HOME = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
_LABEL = "left/up/no_flip"


class ParetoRequest(OptimizeRequest):
    """A motion whose energy is wanted over its duration."""

    points: int = described("Durations to solve for, at most.", "1", 12, default=12, ge=2, le=100)
    duration: DurationRange | None = described(
        "Bounds on the durations. Null: from the shortest to the one of least energy (`mechanical` needs a `max`).",
        "s",
        {"max": 3.0},
        default=None,
    )
    deadline: float = described(
        "Wall time, waiting included, after which the front found so far is returned.",
        "s",
        30.0,
        default=30.0,
        ge=1e-3,
        le=MAX_DURATION,
    )


class ParetoPoint(Response):
    """A motion that none beats in both duration and energy."""

    duration: float = described("Its duration.", "s", 0.7462)
    energy: float = described("Its energy, of the objective.", "J", 45.5)
    start: str = described("Branch at the start.", None, _LABEL)
    goal: str = described("Branch at the goal.", None, _LABEL)
    electrical: float = described("Energy drawn from the supply.", "J", 45.5)
    mechanical: float = described("Absolute mechanical work.", "J", 21.3)
    mean_power: float = described("Mean power drawn from the bus.", "W", 61.0)
    peak_power: float = described("Greatest power drawn from the bus.", "W", 183.0)
    lower_bound: float = described("What no motion of this duration can go below, of the objective.", "J", 39.8)
    status: Literal["optimal", "feasible"] = described(
        "`optimal`: converged, every other candidate solved or ruled out for this duration.", None, "optimal"
    )
    certified: bool = described("Whether its certificate holds: always, or it would not be here.", None, True)
    worst_ratio: float = described("Worst value / limit over all limits.", "1", 0.9999)
    answer: str = described(
        "Path of the whole answer, as of `POST /optimize`.", None, f"/answers/{KeptAnswer.EXAMPLE_ID}"
    )


class ParetoDropped(Response):
    """A duration that was tried and is no point of the front."""

    duration: float = described("The duration.", "s", 0.787)
    energy: float | None = described("Energy of the motion found, of the objective; null if none was.", "J", 45.98)
    reason: str = described("Why.", None, "the motion of 0.7765 s is no slower and needs no more")


class ParetoSolver(Response):
    """What the front cost to compute."""

    wall_time: float = described("Wall time.", "s", 2.4)
    nlp_solves: int = described("Nonlinear programmes solved.", "1", 49)


class ParetoResponse(Response):
    """Energy over duration: the motions of which none beats another, fastest first."""

    id: str = described(
        "The request's id, as in the `X-Request-ID` header.", None, "0b0f3b0e-4c4f-4a43-9d6b-1f6f2f1f6a55"
    )
    robot: str = described("Name of the robot.", None, "ur5e")
    method: MethodName = described("How the motions are parametrised.", None, "bspline")
    objective: Literal["electrical", "mechanical"] = described("Whose energy it is.", None, "electrical")
    status: Literal["optimal", "feasible"] = described(
        "`optimal`: every duration chosen was solved, every point is optimal. `feasible`: verified, but cut short.",
        None,
        "optimal",
    )
    shortest: float = described("The least feasible duration, over all candidates.", "s", 0.7462)
    points: Annotated[list[ParetoPoint], Field(min_length=1)] = part("The front, by duration.")
    dropped: list[ParetoDropped] = part("Durations that were tried and are no points of it.")
    solver: ParetoSolver = part("What it cost to compute.")
