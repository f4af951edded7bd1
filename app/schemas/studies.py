"""Requests and responses of the routes under `/studies`."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, RootModel, Tag

from joulepath.app.schemas.common import (
    FiguresId,
    Request,
    Response,
    RobotName,
    by_field,
    described,
    part,
)
from joulepath.app.schemas.evaluate import EvaluateRequest
from joulepath.app.schemas.examples.figures import FIGURES_ID
from joulepath.app.schemas.examples.values import ANSWER_ID, CREATED, EVALUATE, OPTIMIZE, STUDY_ID
from joulepath.app.schemas.lengths import LENGTHS
from joulepath.app.schemas.queries import Name, Query, after_of, limit_of, next_of, search_in
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.optimizer.result.energy import Objective

KEY_PATTERN = r"^[!-~]+$"
IdempotencyKey = Annotated[str, Field(min_length=1, max_length=LENGTHS.key, pattern=KEY_PATTERN)]


class StudyRequest(Request):
    """A study: the stepwise improvement of a motion to an energy at or below a threshold."""

    name: Name = described("Name of the study.", None, "Pick and place, cell 4")
    robot: RobotName = described(
        "Robot of all iterations: a name from `GET /robots`.", None, "ur5e", default="ur5e"
    )
    figures: FiguresId | None = described(
        "Id of the identified figures of all iterations, from `GET /figures`. Null: the robot's "
        "own figures.",
        None,
        FIGURES_ID,
        default=None,
    )
    threshold: float = described(
        "Energy of the objective at or below which the study has reached its aim.",
        "J",
        60.0,
        gt=0,
        le=1e9,
    )
    objective: Objective = described(
        "Energy minimised by the iterations and compared with the threshold.",
        None,
        "electrical",
        default="electrical",
    )


class StudyName(Request):
    """Another name of a study."""

    name: Name = described("The name.", None, "Pick and place, cell 5")


class StudyPage(Query):
    """The requested part of the list of studies."""

    search: Name | None = search_in("the name or the robot")
    limit: int = limit_of("studies")
    after: str | None = after_of(STUDY_ID)


class OptimizeStep(Request):
    """An iteration that optimises a motion."""

    optimize: OptimizeRequest = described(
        "A body of `POST /optimize`. The defaults of `robot`, `figures` and `objective` are the "
        "values of the study.",
        None,
        OPTIMIZE,
    )


class EvaluateStep(Request):
    """An iteration that evaluates a given motion."""

    evaluate: EvaluateRequest = described(
        "A body of `POST /evaluate`. The defaults of `robot` and `figures` are the values of the "
        "study.",
        None,
        EVALUATE,
    )


IterationRequest = Annotated[
    Annotated[OptimizeStep, Tag("by optimize")] | Annotated[EvaluateStep, Tag("by evaluate")],
    by_field("optimize", "evaluate"),
]


class IterationBody(RootModel[IterationRequest]):
    """An iteration: exactly one of the requests."""

    model_config = ConfigDict(frozen=True)


class Iteration(Response):
    """One iteration of a study."""

    number: int = described("Number of the iteration: 1, 2, 3, … without gaps.", "1", 2)
    kind: Literal["optimize", "evaluate"] = described(
        "Endpoint that computed the iteration.", None, "optimize"
    )
    created: datetime = described("Time at which it was added, in UTC.", None, CREATED)
    energy: float = described("Energy of the motion, of the study's objective.", "J", 57.5)
    electrical: float = described("Energy drawn from the supply.", "J", 57.5)
    mechanical: float = described("Mechanical work.", "J", 31.9)
    duration: float = described("Duration of the motion.", "s", 1.33)
    change_from_last: float | None = described(
        "Energy minus the energy of the previous iteration; a negative value is a saving. Null for "
        "the first iteration.",
        "J",
        -38.6,
    )
    change_from_best: float | None = described(
        "Energy minus the least energy of all previous iterations; negative if this iteration is "
        "the best so far. Null for the first iteration.",
        "J",
        -4.1,
    )
    threshold_met: bool = described(
        "Whether the energy is at most the study's threshold.", None, True
    )
    answer: str = described(
        "Id of the complete answer, for `GET /answers/{id}`. It is stored as long as the study.",
        None,
        ANSWER_ID,
    )


class IterationEnergy(Response):
    """An iteration and its energy."""

    number: int = described("Number of the iteration.", "1", 2)
    energy: float = described("Energy of its motion, of the study's objective.", "J", 57.5)


class StudySummary(Response):
    """A study and its progress."""

    id: str = described("Id of the study.", None, STUDY_ID)
    name: str = described("Name of the study.", None, "Pick and place, cell 4")
    robot: str = described("Robot of all iterations.", None, "ur5e")
    figures: str | None = described(
        "Id of the figures of all iterations; null: the robot's own.", None, FIGURES_ID
    )
    objective: Objective = described(
        "Energy minimised by the iterations and compared with the threshold.",
        None,
        "electrical",
    )
    threshold: float = described(
        "Energy of the objective at or below which the study has reached its aim.", "J", 60.0
    )
    created: datetime = described("Time at which the study was created, in UTC.", None, CREATED)
    owner: str | None = described(
        "Name of the API key that created it; null without one.", None, "press_shop"
    )
    iterations: int = described("Number of iterations.", "1", 2)
    last: IterationEnergy | None = part("The last iteration; null without iterations.")
    best: IterationEnergy | None = part(
        "The iteration of least energy, the first of equals; null without iterations."
    )
    threshold_met: bool = described(
        "Whether the energy of an iteration is at most the threshold.", None, True
    )
    threshold_met_by: int | None = described(
        "Number of the first such iteration; null if there is none.", "1", 2
    )


class Study(StudySummary):
    """A study with its history."""

    history: list[Iteration] = part("All iterations, from the first to the last.")


class StudyList(Response):
    """Studies, newest first."""

    studies: list[StudySummary] = part("The studies.")
    next: str | None = next_of(STUDY_ID)


class IterationDetail(Iteration):
    """One iteration of a study, and the state of the study after it."""

    request: dict[str, Any] = described(
        "The request, ready to be sent again to `POST /studies/{id}/iterations`.",
        None,
        {"optimize": OPTIMIZE},
    )
    best: IterationEnergy = part("The iteration of least energy up to this one.")
    threshold: float = described("Threshold of the study.", "J", 60.0)
    threshold_met_by: int | None = described(
        "Number of the first iteration up to this one with an energy of at most the threshold; "
        "null if there is none.",
        "1",
        2,
    )
