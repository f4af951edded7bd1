"""What `POST /compare` takes and answers."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from app.schemas.common import Response, described, part
from app.schemas.request import MotionRequest
from app.schemas.response import Baseline, OptimizeResponse
from optimizer.problem.problem import MethodName

ALL: list[MethodName] = list(get_args(MethodName))
_PROBLEM = {"type": "/problems/duration-too-short", "title": "Duration too short", "status": 422}


def _different(methods: list[MethodName]) -> list[MethodName]:
    if len(set(methods)) < len(methods):
        raise PydanticCustomError("repeated", "Give each method once")
    return methods


class CompareRequest(MotionRequest):
    """A motion from rest at `start` to rest at `goal`, by several methods; `deadline` is for all of them together."""

    methods: Annotated[list[MethodName], Field(min_length=1), AfterValidator(_different)] = described(
        "Methods to compare; the table keeps their order.", None, ["bspline", "lagrange"], default=ALL
    )
    answers: bool = described(
        "Whether each row holds the whole answer that `POST /optimize` would give.", None, False, default=False
    )


class Row(Response):
    """One method: what it found, or, in `problem`, why nothing; then the other figures are null."""

    method: MethodName = described("The method.", None, "lagrange")
    status: Literal["optimal", "feasible"] | None = described("As `POST /optimize` answers it.", None, "optimal")
    duration: float | None = described("Length of the motion.", "s", 2.29)
    electrical: float | None = described("Energy drawn from the bus.", "J", 161.0)
    mechanical: float | None = described("Absolute mechanical work.", "J", 61.2)
    excess: float | None = described("Energy over that of the best method, less 1, of the objective.", "1", 0.004)
    optimality_gap: float | None = described("1 - lower_bound / energy, of the objective.", "1", 0.09)
    wall_time: float | None = described("What it took to compute, each method by itself on one core.", "s", 0.06)
    iterations: int | None = described("The method's own iterations: see `solver` of `POST /optimize`.", "1", 8)
    nlp_solves: int | None = described("Programmes solved.", "1", 1)
    valid: bool | None = described("Whether the certificate holds: motions that do not are not answered.", None, True)
    worst_ratio: float | None = described("The worst value / limit of the certificate.", "1", 0.998)
    problem: dict[str, Any] | None = described(
        "The problem that `POST /optimize` would answer, with its own fields; null where there is a motion.",
        None,
        _PROBLEM,
    )
    answer: OptimizeResponse | None = part("The whole answer, if asked for with `answers`.")


ROW_FIELDS = tuple(Row.model_fields)


class CompareResponse(Response):
    """A table of methods, and what they are compared with."""

    id: str = described(
        "The request's id, as in the `X-Request-ID` header.", None, "0b0f3b0e-4c4f-4a43-9d6b-1f6f2f1f6a55"
    )
    robot: str = described("Name of the robot.", None, "ur5e")
    objective: Literal["electrical", "mechanical"] = described("What was minimised.", None, "electrical")
    lower_bound: float = described(
        "Of the objective: no motion of any shape and any allowed duration between these targets needs less.",
        "J",
        146.6,
    )
    best: MethodName = described("The method of least energy.", None, "bspline")
    methods: Annotated[list[Row], Field(min_length=1)] = part("A row per method, in the order asked for.")
    baselines: Annotated[list[Baseline], Field(min_length=1)] = part("What others spend, against the best method.")
