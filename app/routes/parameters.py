"""Parameters and headers that several routes share."""

from __future__ import annotations

from typing import Annotated

from fastapi import Header, Path, Request, Response

from app.schemas.common import KEY_HEADER
from app.schemas.examples.values import STUDY_ID
from app.schemas.request import MotionRequest
from app.schemas.studies import IdempotencyKey
from app.schemas.whatif import WhatifRequest
from optimizer.exceptions import InvalidProblem


def allowed_deadline(body: MotionRequest | WhatifRequest, most: float) -> float:
    """The request's deadline [s]. Raises InvalidProblem when the caller asks for too much."""
    if "deadline" not in body.model_fields_set:
        return min(body.deadline, most)
    if body.deadline > most:
        raise InvalidProblem("deadline", f"deadline must be at most {most:g} s.")
    return body.deadline


StudyId = Annotated[str, Path(description="The study's id.", examples=[STUDY_ID])]
Key = Annotated[
    IdempotencyKey | None,
    Header(
        alias=KEY_HEADER,
        description="Any text that names this request and no other: sent again under the same key, after a lost "
        "connection for one, it is answered from what it made the first time.",
        examples=["2f6f3d0c-try-1"],
    ),
]
REPLAYED = "Idempotency-Replayed"
"""Header of an answer to a request that was sent before."""
CREATED_HEADERS = {
    "Location": {"description": "Path of what was made.", "schema": {"type": "string"}},
    REPLAYED: {"description": "`true` if it was made before, under the same key.", "schema": {"type": "string"}},
}


def set_location(request: Request, response: Response, path: str, again: bool) -> None:
    """Headers of an answer that says what was made, now or under the same key before."""
    response.headers["Location"] = f"{request.scope.get('root_path', '')}/studies/{path}"
    if again:
        response.headers[REPLAYED] = "true"
