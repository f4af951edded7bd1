"""Common parameters and headers of several routes."""

from __future__ import annotations

from typing import Annotated, Literal, Protocol

from fastapi import Depends, Header, Path, Request, Response

from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.http.event_stream import EVENT_STREAM
from joulepath.app.http.handlers import CACHE_HEADER
from joulepath.app.http.weights import is_wanted
from joulepath.app.schemas.common import KEY_HEADER
from joulepath.app.schemas.deadline import too_long
from joulepath.app.schemas.examples.values import STUDY_ID
from joulepath.app.schemas.studies import IdempotencyKey


class WithDeadline(Protocol):
    """A request with an optional deadline [s]."""

    @property
    def deadline(self) -> float:
        """Wall time from its arrival [s]."""

    @property
    def model_fields_set(self) -> set[str]:
        """Names of the given fields."""


def deadline_of(body: WithDeadline, longest: float) -> float:
    """The deadline of a request [s]. If it has none, the default, but at most `longest`. Raises
    InvalidRequest.
    """
    given = body.deadline if "deadline" in body.model_fields_set else None
    return allowed_deadline(given, body.deadline, longest)


def allowed_deadline(
    given: float | None, default: float, longest: float, where: str = "body"
) -> float:
    """Apply the default and the limit of a deadline.

    Args:
        given: deadline of the request [s]; None for the default.
        default: default deadline [s], reduced to `longest` if it is longer.
        longest: longest admissible deadline [s].
        where: part of the request, for the error.

    Returns:
        The deadline [s].

    Raises:
        InvalidRequest: `given` exceeds `longest`.
    """
    if wrong := too_long(given, longest, where):
        raise InvalidRequest(wrong)
    return min(default, longest) if given is None else given


async def _wanted_format(request: Request) -> Literal["json", "csv"]:
    return (
        "csv" if is_wanted(request, "text/csv") and not is_wanted(request, EVENT_STREAM) else "json"
    )


WantedFormat = Annotated[Literal["json", "csv"], Depends(_wanted_format)]
"""Format of the answer, by the header `Accept`."""
StudyId = Annotated[str, Path(description="The study's id.", examples=[STUDY_ID])]
Key = Annotated[
    IdempotencyKey | None,
    Header(
        alias=KEY_HEADER,
        description="A text of your own that identifies this request. If you send the same request "
        "again with the same "
        "key, for example after a lost connection, nothing new is created.",
        examples=["2f6f3d0c-try-1"],
    ),
]
CACHED_HEADERS = {
    CACHE_HEADER: {
        "description": "`hit` if the answer was computed for an equal request before.",
        "schema": {"type": "string"},
    },
    "Age": {"description": "Time since then [s].", "schema": {"type": "integer", "minimum": 0}},
}
"""Headers of an answer that may come from the database."""
REPLAYED = "Idempotency-Replayed"
"""Header of a response to a request that was sent before."""
LOCATION_HEADER = {
    "Location": {"description": "Path of the created resource.", "schema": {"type": "string"}}
}
CREATED_HEADERS = {
    **LOCATION_HEADER,
    REPLAYED: {
        "description": "`true` if an earlier request with the same key created it.",
        "schema": {"type": "string"},
    },
}


def is_fresh(request: Request) -> bool:
    """Whether the client wants its request to be computed, although an equal one was answered
    before.
    """
    return "no-cache" in request.headers.get("cache-control", "").lower()


def set_location(request: Request, response: Response, path: str, again: bool = False) -> None:
    """Sets the headers of a response about a created resource; `again`: an earlier request with
    this key created it.
    """
    response.headers["Location"] = f"{request.scope.get('root_path', '')}{path}"
    if again:
        response.headers[REPLAYED] = "true"
