"""What the routes under `/answers` take and answer."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any

from pydantic import Field

from joulepath.app.schemas.common import Response, described, part
from joulepath.app.schemas.examples.values import ANSWER_ID, CREATED, JOB_ID
from joulepath.app.schemas.lengths import LENGTHS
from joulepath.app.schemas.naming import Name, search_in
from joulepath.app.schemas.queries import Query, after_of, limit_of, next_of


class KeptAnswer(Response):
    """A kept answer without its document."""

    id: str = described("Id of the answer.", None, ANSWER_ID)
    name: str | None = described("Its name, see `PATCH /answers/{id}`.", None, "Night cell")
    kind: str = described(
        "Endpoint of the answer, for example `optimize` or `cycle`.", None, "optimize"
    )
    created: datetime = described("Time at which it was computed, in UTC.", None, CREATED)
    owner: str | None = described(
        "Name of the API key that asked for it; null without one.", None, "press_shop"
    )


class AnswerSummary(KeptAnswer):
    """A kept answer in a list. Its figures are null in answers of an earlier version."""

    robot: str | None = described("Name of the robot.", None, "ur5e")
    energy: float | None = described(
        "Energy of the motion or cycle, of its objective (electrical for `evaluate`). Null for "
        "other kinds.",
        "J",
        57.5,
    )
    duration: float | None = described(
        "Duration of that motion or cycle; null as `energy`.", "s", 1.33
    )
    status: str | None = described("`status` of the answer; null if it has none.", None, "optimal")


class StoredAnswer(KeptAnswer):
    """A complete answer, referenced by another answer."""

    answer: dict[str, Any] = described(
        "The answer, with the fields that this endpoint documents.",
        None,
        {"robot": "ur5e", "duration": 1.8, "status": "optimal"},
    )


class AnswerList(Response):
    """Kept answers, newest first."""

    answers: list[AnswerSummary] = part("The answers.")
    next: str | None = next_of(ANSWER_ID)


class AnswerPage(Query):
    """A page of the list of answers."""

    whole: bool = described(
        "Whether to leave out what belongs to something else: the motions of cycles, fronts and "
        "what-ifs, and the answers of jobs and studies.",
        None,
        True,
        default=False,
    )
    job: Annotated[str, Field(max_length=LENGTHS.id)] | None = described(
        "Id of a job: only its answers. Null: those of all.", None, JOB_ID, default=None
    )
    search: Name | None = search_in("the name, the robot or the kind")
    limit: int = limit_of("answers")
    after: str | None = after_of(ANSWER_ID)
