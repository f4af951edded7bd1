"""GET /studies/{id}/suggest."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Query, Request, Response

from app.engine.pool import Engine
from app.engine.reply import Reply
from app.exceptions import Busy, EmptyStudy, WorkerDied
from app.http.disconnect import unless_disconnected
from app.http.handlers import to_http
from app.http.openapi import problem_responses
from app.http.problem_details import problem_type
from app.routes.parameters import StudyId
from app.schemas import errors as problems
from app.schemas.errors import PREFIX
from app.schemas.request import OptimizeRequest
from app.schemas.suggestions import Suggestions, SuggestQuery
from app.settings import Settings
from app.store import answers, studies
from app.store.store import Store
from app.studies.progress import best_of
from app.studies.suggestions import Proposal, base_of, proposals
from app.tasks.optimize import OptimizeTask
from optimizer.exceptions import DeadlineExceeded, InvalidProblem

router = APIRouter(prefix="/studies", tags=["studies"])

Outcome = dict[str, Any]


@router.get(
    "/{id}/suggest",
    summary="What to try next",
    response_model=Suggestions,
    responses=problem_responses(
        problems.Validation,
        problems.UnknownStudy,
        problems.EmptyStudy,
        problems.ShuttingDown,
        problems.StoreUnavailable,
    ),
)
async def suggest(request: Request, id: StudyId, query: Annotated[SuggestQuery, Query()]) -> Response:
    """Steps that differ from the best iteration (or the last) in one thing each: the optimiser computes every one of
    them, and they come ranked by what they save, each with the body for the next `POST /studies/{id}/iterations`."""
    settings: Settings = request.app.state.settings
    if query.deadline is not None and query.deadline > settings.max_deadline:
        raise InvalidProblem("deadline", f"deadline must be at most {settings.max_deadline:g} s.")
    deadline = min(SuggestQuery.DEFAULT_DEADLINE, settings.max_deadline) if query.deadline is None else query.deadline
    return to_http(await unless_disconnected(request, _suggest(request, id, query.base, deadline)))


async def _suggest(request: Request, id: str, which: str, deadline: float) -> Reply:
    end = asyncio.get_running_loop().time() + deadline
    store: Store = request.app.state.store
    history = await store.read(partial(studies.history, study_id=id))
    energies, study = history.energies, history.study
    index = best_of(energies) if which == "best" else len(energies) - 1 if energies else None
    if index is None:
        raise EmptyStudy
    iteration = history.iterations[index]
    asked = (await store.read(partial(studies.up_to, study_id=id, number=iteration.number))).iterations[-1].request
    _, body = await store.read(partial(answers.get, answer_id=iteration.answer_id))
    base = base_of(iteration.kind, asked, orjson.loads(body), study.objective)
    found = [] if base is None else proposals(base)
    outcomes = await _computed(request, found, study.objective, end)
    computed = []
    for outcome in outcomes:
        if "energy" in outcome:
            energy = outcome["energy"]
            computed.append(outcome | {"gain": energies[index] - energy, "threshold_met": energy <= study.threshold})
    content = {
        "study": study.id,
        "base": {"number": iteration.number, "energy": energies[index]},
        "suggestions": sorted(computed, key=lambda entry: entry["gain"], reverse=True),
        "not_computed": [outcome for outcome in outcomes if "problem" in outcome],
    }
    return Reply(200, orjson.dumps(content))


async def _computed(request: Request, found: list[Proposal], objective: str, end: float) -> list[Outcome]:
    """What becomes of each proposal by the time `end` of the loop's clock."""
    engine: Engine = request.app.state.engine
    settings: Settings = request.app.state.settings
    # a worker stays free for whoever asks meanwhile, where there is more than one
    turn = asyncio.Semaphore(max(1, settings.workers - 1))

    async def compute(proposal: Proposal) -> Outcome:
        asked = OptimizeRequest.model_validate(proposal.request)
        told: Outcome = {
            "step": proposal.step,
            "summary": proposal.summary,
            "request": {"optimize": proposal.request},
        }
        async with turn:
            left = min(end - asyncio.get_running_loop().time(), asked.deadline)
            try:
                if left <= 0:
                    raise DeadlineExceeded([])
                reply = await engine.run(OptimizeTask(asked, request.state.id), left)
            except (Busy, DeadlineExceeded, WorkerDied) as error:
                return told | {"problem": problem_type(error).slug()}
        answer = orjson.loads(reply.body)
        if reply.status != 200:
            return told | {"problem": answer["type"].removeprefix(PREFIX)}
        energy = answer["energy"][objective]["total"]
        return told | {"energy": energy, "duration": answer["duration"], "status": answer["status"]}

    async with asyncio.TaskGroup() as group:
        running = [group.create_task(compute(proposal)) for proposal in found]
    return [task.result() for task in running]
