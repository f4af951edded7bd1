"""What `GET /studies/{id}/suggest` takes and answers."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from app.schemas.common import Response, described, part
from app.schemas.studies import Query, Reached, StudySummary

_REQUEST = {
    "optimize": {
        "start": {"q": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]},
        "goal": {"pose": {"position": [-0.35, 0.4, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
    }
}


class SuggestQuery(Query):
    """From where to go on, and how long to think."""

    DEFAULT_DEADLINE: ClassVar[float] = 10.0

    base: Literal["best", "last"] = described(
        "The iteration to start from: the one of least energy, or the last.", None, "best", default="best"
    )
    deadline: float | None = described(
        "Wall time for all suggestions; what is not computed by then is listed as such. Null: "
        f"{DEFAULT_DEADLINE:g} s, or the service's longest deadline if that is shorter.",
        "s",
        10.0,
        default=None,
        ge=1e-3,
        le=600,
    )


class _Proposal(Response):
    step: Literal["method", "branch", "orientation", "duration", "payload"] = described(
        "What it changes.", None, "branch"
    )
    summary: str = described(
        "The change in words.", None, "Reach the same pose in whichever arm configuration is best."
    )
    request: dict[str, Any] = described("Body for `POST /studies/{id}/iterations`.", None, _REQUEST)


class Suggestion(_Proposal):
    """A step that was computed."""

    energy: float = described("Its energy, in the study's objective: what the request will come to.", "J", 57.5)
    gain: float = described("Energy of the base less its own: below zero, it costs more.", "J", 38.6)
    duration: float = described("Length of the motion.", "s", 1.33)
    status: Literal["optimal", "feasible"] = described(
        "`feasible`: not everything was searched, and the request may come to less.", None, "optimal"
    )
    threshold_met: bool = described("Whether it meets the study's threshold.", None, True)


class NotComputed(_Proposal):
    """A step without an answer."""

    problem: str = described(
        "The type of problem: `deadline-exceeded` and `busy` where time or workers ran out, else why it cannot be.",
        None,
        "duration-too-short",
    )


class Suggestions(Response):
    """What to try next, ranked by gain."""

    study: str = described("The study's id.", None, StudySummary.EXAMPLE_ID)
    base: Reached = part("The iteration that they start from.")
    suggestions: list[Suggestion] = part("Computed steps, the greatest gain first; those that cost more come last.")
    not_computed: list[NotComputed] = part("Steps without an answer, and why.")
