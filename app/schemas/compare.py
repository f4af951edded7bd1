"""What `POST /compare` takes and answers."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from joulepath.app.answers.declared import Shown
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.schemas.common import Answer, Response, described, part
from joulepath.app.schemas.request import MotionRequest
from joulepath.app.schemas.wording import GAP, LOWER_BOUND, OBJECTIVE
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.result.energy import Objective
from joulepath.optimizer.result.solution import Baseline

ALL: list[MethodName] = list(get_args(MethodName))
_PROBLEM = {"type": "/problems/duration-too-short", "title": "Duration too short", "status": 422}


def _different(methods: list[MethodName]) -> list[MethodName]:
    if len(set(methods)) < len(methods):
        raise PydanticCustomError("repeated", "Give each method once")
    return methods


class CompareRequest(MotionRequest):
    """A motion from standstill at `start` to standstill at `goal`, by several methods. `deadline` is for all methods
    together."""

    methods: Annotated[list[MethodName], Field(min_length=1), AfterValidator(_different)] = described(
        "Methods to compare, each once; the rows of the answer keep this order.",
        None,
        ["bspline", "lagrange"],
        default=ALL,
    )
    answers: bool = described(
        "Whether each row contains the complete answer of `POST /optimize`.", None, False, default=False
    )


class MethodResult(Response):
    """Result of one method. If it found no motion, `problem` has the error, and all other fields except `method` are
    null."""

    method: MethodName = described("The method.", None, "lagrange")
    status: Literal["optimal", "feasible"] | None = described("Status as in `POST /optimize`.", None, "optimal")
    duration: float | None = described("Duration of the motion.", "s", 2.29)
    electrical: float | None = described("Energy drawn from the supply.", "J", 161.0)
    mechanical: float | None = described("Mechanical work.", "J", 61.2)
    excess: float | None = described("Energy / energy of the best method - 1, of the objective.", "1", 0.004)
    optimality_gap: float | None = described(GAP, "1", 0.09)
    wall_time: float | None = described("Wall time of this method, on one core.", "s", 0.06)
    iterations: int | None = described("Iterations, as in `solver` of `POST /optimize`.", "1", 8)
    nlp_solves: int | None = described("Nonlinear programs solved.", "1", 1)
    valid: bool | None = described("Whether the certificate is valid; other motions are not returned.", None, True)
    worst_ratio: float | None = described("Largest value / limit of the certificate.", "1", 0.998)
    problem: dict[str, Any] | None = described(
        "The error document that `POST /optimize` would return; null if there is a motion.",
        None,
        _PROBLEM,
    )
    answer: Annotated[OptimizeAnswer, Shown] | None = part(
        "The complete answer of `POST /optimize` if `answers` is true; else null."
    )


ROW_FIELDS = tuple(MethodResult.model_fields)


class CompareResponse(Answer):
    """The results of several methods, and the baselines."""

    objective: Objective = described(OBJECTIVE, None, "electrical")
    lower_bound: float = described(LOWER_BOUND, "J", 146.6)
    best: MethodName = described("Method of least energy.", None, "bspline")
    methods: Annotated[list[MethodResult], Field(min_length=1)] = part(
        "One row per method, in the order of the request."
    )
    baselines: Annotated[list[Annotated[Baseline, Shown]], Field(min_length=1)] = part("Baselines of the best method.")
