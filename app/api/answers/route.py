"""GET /answers, GET, PATCH and DELETE /answers/{id}."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Path, Query, Response
from sqlalchemy.orm import Session

from joulepath.app.api.answers.models import (
    AnswerList,
    AnswerName,
    AnswerPage,
    AnswerSummary,
    KeptAnswer,
    StoredAnswer,
)
from joulepath.app.api.shared.dependencies import ServiceClient, ServiceStore
from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.access import NotOwner
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.stored import AnswerInUse, StoreUnavailable, UnknownAnswer
from joulepath.app.http.handlers import result_response
from joulepath.app.http.json_route import JsonRoute
from joulepath.app.http.openapi import problem_responses
from joulepath.app.schemas.examples.values import ANSWER_ID
from joulepath.app.store import answers
from joulepath.app.store.tables import Answer

router = APIRouter(prefix="/answers", tags=["results"], route_class=JsonRoute)

AnswerId = Annotated[str, Path(description="The answer's id.", examples=[ANSWER_ID])]


@router.get(
    "",
    summary="List stored answers",
    response_model=AnswerList,
    responses=problem_responses(InvalidRequest, StoreUnavailable),
)
async def list_answers(page: Annotated[AnswerPage, Query()], store: ServiceStore) -> AnswerList:
    """Stored answers, newest first, page by page, with optional filters."""
    wanted = answers.Wanted(page.whole, page.job, page.search)
    found, following = await store.read(
        partial(answers.page, limit=page.limit, after=page.after, wanted=wanted)
    )
    return AnswerList(answers=[_summary(answer) for answer in found], next=following)


def _summary(answer: Answer) -> AnswerSummary:
    return AnswerSummary(**{name: getattr(answer, name) for name in AnswerSummary.model_fields})


@router.get(
    "/{id}",
    summary="A stored answer",
    response_model=StoredAnswer,
    responses=problem_responses(UnknownAnswer, StoreUnavailable),
)
async def show_answer(id: AnswerId, store: ServiceStore) -> Response:
    """The complete answer with this id, and its request."""

    def read(session: Session) -> dict[str, Any]:
        answer, body = answers.get(session, id)
        own = {name: getattr(answer, name) for name in (*KeptAnswer.model_fields, "typed")}
        asked = answers.request_of(session, answer)
        return own | {"request": asked, "answer": orjson.Fragment(body)}

    return result_response(TaskResult.of_json(await store.read(read)))


@router.patch(
    "/{id}",
    summary="Name a stored answer",
    response_model=AnswerSummary,
    responses=problem_responses(InvalidRequest, UnknownAnswer, NotOwner, StoreUnavailable),
)
async def rename_answer(
    id: AnswerId, body: AnswerName, store: ServiceStore, client: ServiceClient
) -> AnswerSummary:
    """Names the answer; `GET /answers` searches these names."""
    rename = partial(answers.rename, answer_id=id, name=body.name, typed=body.typed, client=client)
    return await store.write(lambda session: _summary(rename(session)))


@router.delete(
    "/{id}",
    summary="Delete a stored answer",
    status_code=204,
    responses=problem_responses(UnknownAnswer, AnswerInUse, NotOwner, StoreUnavailable),
)
async def delete_answer(id: AnswerId, store: ServiceStore, client: ServiceClient) -> None:
    """Deletes an answer. An answer of a study is deleted with its study only."""
    await store.write(partial(answers.delete, answer_id=id, client=client), frees=True)
