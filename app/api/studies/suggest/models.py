"""Query and answer of `GET /studies/{id}/suggest`."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from joulepath.app.schemas.common import Response, described, part
from joulepath.app.schemas.deadline import DeadlineSeconds
from joulepath.app.schemas.examples.values import OPTIMIZE, STUDY_ID
from joulepath.app.schemas.queries import Query
from joulepath.app.schemas.studies import IterationEnergy


class SuggestQuery(Query):
    """The iteration to start from, and the time for the computation."""

    DEFAULT_DEADLINE: ClassVar[float] = 10.0

    base: Literal["best", "last"] = described(
        "Iteration to start from: the one of least energy, or the last one.",
        None,
        "best",
        default="best",
    )
    deadline: DeadlineSeconds | None = described(
        "Wall time for all suggestions together; those without a result by then are in "
        f"`not_computed`. Null: {DEFAULT_DEADLINE:g} s, or the service's largest deadline if that "
        "is shorter.",
        "s",
        10.0,
        default=None,
    )


class _Proposal(Response):
    step: Literal["method", "branch", "orientation", "duration", "payload"] = described(
        "Property of the motion that is changed.", None, "branch"
    )
    summary: str = described(
        "The change in words.",
        None,
        "Reach the same pose in the arm configuration of least energy.",
    )
    request: dict[str, Any] = described(
        "Body for `POST /studies/{id}/iterations`.", None, {"optimize": OPTIMIZE}
    )


class Suggestion(_Proposal):
    """A change with its computed best motion."""

    energy: float = described(
        "Energy of the motion found for `request`, of the study's objective.", "J", 57.5
    )
    gain: float = described(
        "Energy of the base minus `energy`; a positive value is a saving.", "J", 38.6
    )
    duration: float = described("Duration of the motion.", "s", 1.33)
    status: Literal["optimal", "feasible"] = described(
        "`optimal`: posting `request` gives the same energy. `feasible`: the search was not "
        "complete; posting `request` with more time may give less energy.",
        None,
        "optimal",
    )
    threshold_met: bool = described(
        "Whether `energy` is at most the threshold of the study.", None, True
    )


class NotComputed(_Proposal):
    """A change without a motion."""

    problem: str = described(
        "Type of the error. `deadline-exceeded` and `busy`: no time or no free worker was left. "
        "Other types: the change is impossible.",
        None,
        "duration-too-short",
    )


class Suggestions(Response):
    """Changes to try next, in order of `gain`."""

    study: str = described("Id of the study.", None, STUDY_ID)
    base: IterationEnergy = part("The iteration that the suggestions start from.")
    suggestions: list[Suggestion] = part(
        "Computed changes, the largest `gain` first; negative gains come last."
    )
    not_computed: list[NotComputed] = part(
        "Changes without a motion, each with the type of its error."
    )
