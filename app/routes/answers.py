"""GET /answers/{id}."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import orjson
from fastapi import APIRouter, Path, Response

from app.engine.result import TaskResult
from app.http.handlers import result_response
from app.http.openapi import problem_responses
from app.routes.dependencies import ServiceStore
from app.schemas import errors as problems
from app.schemas.answers import StoredAnswer
from app.schemas.examples.values import ANSWER_ID
from app.store import answers

router = APIRouter(prefix="/answers", tags=["answers"])


@router.get(
    "/{id}",
    summary="A stored answer",
    response_model=StoredAnswer,
    responses=problem_responses(problems.UnknownAnswer, problems.StoreUnavailable),
)
async def show(
    id: Annotated[str, Path(description="The answer's id.", examples=[ANSWER_ID])], store: ServiceStore
) -> Response:
    """The complete answer that another answer refers to."""
    answer, body = await store.read(partial(answers.get, answer_id=id))
    content = {"id": answer.id, "kind": answer.kind, "created": answer.created, "answer": orjson.Fragment(body)}
    return result_response(TaskResult.of_json(content))
