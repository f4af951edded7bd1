"""What the routes under `/answers` take and answer."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any

from pydantic import Field

from joulepath.app.schemas.common import NO_CONTROLS, Response, described, part
from joulepath.app.schemas.examples.values import ANSWER_ID, CREATED, JOB_ID, OPTIMIZE
from joulepath.app.schemas.lengths import LENGTHS
from joulepath.app.schemas.queries import (
    Name,
    NewName,
    Query,
    after_of,
    limit_of,
    next_of,
    search_in,
)

Pointer = Annotated[str, Field(max_length=LENGTHS.pointer, pattern=NO_CONTROLS)]
TypedNumber = Annotated[str, Field(max_length=LENGTHS.number, pattern=NO_CONTROLS)]
_TYPED = {"/payload/mass": "1,60"}


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
    """A stored answer in a list. Its figures are null in answers of an earlier version."""

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
    request: dict[str, Any] | None = described(
        "The request as it was sent. Null for a part of another answer, such as a motion of a "
        "cycle.",
        None,
        OPTIMIZE,
    )
    typed: dict[str, str] | None = described(
        "Texts in which its numbers were typed, see `PATCH /answers/{id}`.", None, _TYPED
    )


class AnswerName(NewName):
    """Another name of a stored answer, and how its request was typed."""

    typed: dict[Pointer, TypedNumber] | None = described(
        "Texts in which the numbers of its request were typed, by JSON pointers, for pages that "
        "show it again. Null: those that it has.",
        None,
        _TYPED,
        default=None,
        max_length=10_000,
    )


class AnswerList(Response):
    """Stored answers, newest first."""

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
