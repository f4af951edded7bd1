"""GET /answers/{id}."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import orjson
from fastapi import APIRouter, Path, Request, Response

from app.http.openapi import problem_responses
from app.schemas import errors as problems
from app.schemas.answers import StoredAnswer
from app.schemas.examples.values import ANSWER_ID
from app.store import answers
from app.store.store import Store

router = APIRouter(prefix="/answers", tags=["answers"])


@router.get(
    "/{id}",
    summary="An answer kept by reference",
    response_model=StoredAnswer,
    responses=problem_responses(problems.UnknownAnswer, problems.StoreUnavailable),
)
async def show(
    request: Request, id: Annotated[str, Path(description="The answer's id.", examples=[ANSWER_ID])]
) -> Response:
    """The whole answer that another answer refers to by its id."""
    store: Store = request.app.state.store
    answer, body = await store.read(partial(answers.get, answer_id=id))
    content = {"id": answer.id, "kind": answer.kind, "created": answer.created, "answer": orjson.Fragment(body)}
    return Response(orjson.dumps(content), media_type="application/json")
