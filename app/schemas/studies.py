"""What the routes under `/studies` take and answer."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, ConfigDict, Field, Tag
from pydantic_core import PydanticCustomError

from app.schemas.answers import KeptAnswer
from app.schemas.common import Request, Response, RobotName, by_field, described, part
from app.schemas.evaluate import EvaluateRequest
from app.schemas.lengths import KEY_LENGTH, NAME_LENGTH
from app.schemas.request import OptimizeRequest

_CREATED = "2025-03-14T09:26:53.589793Z"
_OPTIMIZE = {
    "start": {"q": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]},
    "goal": {"pose": {"position": [-0.35, 0.4, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
}
_EVALUATE = {
    "configurations": [[0.0, -1.57, 1.57, -1.57, -1.57, 0.0], [0.3, -1.4, 1.4, -1.5, -1.57, 0.2]],
    "time_per_segment": 1.5,
}


def _not_blank(name: str) -> str:
    if not name.strip():
        raise PydanticCustomError("blank", "The name must not be blank")
    return name


# no control characters: they do not show, and a database refuses some
Name = Annotated[
    str,
    Field(min_length=1, max_length=NAME_LENGTH, pattern=r"^[^\x00-\x1F\x7F-\x9F]+$"),
    AfterValidator(_not_blank),
]
IdempotencyKey = Annotated[str, Field(min_length=1, max_length=KEY_LENGTH, pattern=r"^[!-~]+$")]


class StudyRequest(Request):
    """A study: a motion to be improved step by step until its energy is low enough."""

    name: Name = described("What to call it.", None, "Pick and place, cell 4")
    robot: RobotName = described("The robot of all its iterations, from `GET /robots`.", None, "ur5e", default="ur5e")
    threshold: float = described("Energy that is low enough.", "J", 60.0, gt=0, le=1e9)
    objective: Literal["electrical", "mechanical"] = described(
        "The energy that is compared with the threshold, and that the iterations' optimisations minimise.",
        None,
        "electrical",
        default="electrical",
    )


class Query(Request):
    """The parameters of a query."""

    # what stands in a query is text
    model_config = ConfigDict(strict=False)


class StudyPage(Query):
    """Which studies to list."""

    limit: int = described("Most studies in the answer.", "1", 50, default=50, ge=1, le=200)
    after: str | None = described(
        "The `next` of the page before; leave it out for the first page.",
        None,
        "1741944413589793_5c0a0e0f-8d1f-4f1c-9a43-2f4a3ad0d1b7",
        default=None,
        pattern=r"^[0-9]{1,16}_[0-9a-f-]{36}$",
    )


class OptimizeStep(Request):
    """An iteration that optimises."""

    optimize: OptimizeRequest = described(
        "As for `POST /optimize`. `robot` and `objective`, where left out, are the study's.", None, _OPTIMIZE
    )


class EvaluateStep(Request):
    """An iteration that evaluates a given motion."""

    evaluate: EvaluateRequest = described(
        "As for `POST /evaluate`. `robot`, where left out, is the study's.", None, _EVALUATE
    )


IterationRequest = Annotated[
    Annotated[OptimizeStep, Tag("by optimize")] | Annotated[EvaluateStep, Tag("by evaluate")],
    by_field("optimize", "evaluate"),
]


class Iteration(Response):
    """One step of a study."""

    number: int = described("1 for the first, then counted on without gaps.", "1", 2)
    kind: Literal["optimize", "evaluate"] = described("The endpoint that answered.", None, "optimize")
    created: datetime = described("When, in UTC.", None, _CREATED)
    energy: float = described("Energy of the motion, in the study's objective.", "J", 57.5)
    electrical: float = described("Energy drawn from the bus.", "J", 57.5)
    mechanical: float = described("Absolute mechanical work.", "J", 31.9)
    duration: float = described("Length of the motion.", "s", 1.33)
    change_from_last: float | None = described(
        "Energy less that of the iteration before: below zero, it was saved. Null at the first.", "J", -38.6
    )
    change_from_best: float | None = described(
        "Energy less the least of all iterations before: below zero, this one is the best so far. Null at the first.",
        "J",
        -4.1,
    )
    threshold_met: bool = described("Whether the energy is at most the study's threshold.", None, True)
    answer: str = described(
        "The whole answer's id, for `GET /answers/{id}`: kept as long as the study is.", None, KeptAnswer.EXAMPLE_ID
    )


class Reached(Response):
    """An iteration and its energy."""

    number: int = described("The iteration's number.", "1", 2)
    energy: float = described("Its energy, in the study's objective.", "J", 57.5)


class StudySummary(Response):
    """A study and how far it has come."""

    EXAMPLE_ID: ClassVar[str] = "5c0a0e0f-8d1f-4f1c-9a43-2f4a3ad0d1b7"

    id: str = described("The study's id.", None, EXAMPLE_ID)
    name: str = described("What it is called.", None, "Pick and place, cell 4")
    robot: str = described("Its robot.", None, "ur5e")
    objective: Literal["electrical", "mechanical"] = described("The energy that counts.", None, "electrical")
    threshold: float = described("Energy that is low enough.", "J", 60.0)
    created: datetime = described("When it was made, in UTC.", None, _CREATED)
    iterations: int = described("How many there are.", "1", 2)
    last: Reached | None = part("The last iteration; null if there is none.")
    best: Reached | None = part("The iteration of least energy, the first of several; null if there is none.")
    threshold_met: bool = described("Whether any iteration meets the threshold.", None, True)
    threshold_met_by: int | None = described("The first iteration that does; null if none does.", "1", 2)


class Study(StudySummary):
    """A study with its history."""

    history: list[Iteration] = part("Its iterations, from the first to the last.")


class StudyList(Response):
    """Studies, newest first."""

    studies: list[StudySummary] = part("The studies.")
    next: str | None = described(
        "For the next page's `after`; null at the end.", None, "1741944413589793_5c0a0e0f-8d1f-4f1c-9a43-2f4a3ad0d1b7"
    )


class IterationDetail(Iteration):
    """One step of a study, and where the study then stood."""

    request: dict[str, Any] = described(
        "What was asked, ready to be sent again to `POST /studies/{id}/iterations`.", None, {"optimize": _OPTIMIZE}
    )
    best: Reached = part("The best iteration up to this one.")
    threshold: float = described("The study's threshold.", "J", 60.0)
    threshold_met_by: int | None = described(
        "The first iteration up to this one that meets it; null if none does.", "1", 2
    )
