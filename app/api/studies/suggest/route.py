"""GET /studies/{id}/suggest."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Query, Request, Response

from joulepath.app.api.optimize.task import OptimizeTask
from joulepath.app.api.shared.dependencies import ServiceArmEngine, ServiceSettings, ServiceStore
from joulepath.app.api.shared.parameters import StudyId, allowed_deadline
from joulepath.app.api.studies.suggest.models import Suggestions, SuggestQuery
from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.base import InternalError, InvalidRequest
from joulepath.app.exceptions.queue import Busy, ShuttingDown, WorkerLost
from joulepath.app.exceptions.stored import EmptyStudy, StoreUnavailable, UnknownStudy
from joulepath.app.http.disconnect import unless_disconnected
from joulepath.app.http.handlers import result_response
from joulepath.app.http.openapi import problem_responses
from joulepath.app.http.problems import reported
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.app.store import answers, studies
from joulepath.app.store.store import Store
from joulepath.app.studies.suggestions import Proposal, base_of, proposals
from joulepath.app.tasks.arm_engine import ArmEngine, known_here
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError, UnknownRobot

router = APIRouter(prefix="/studies", tags=["studies"])

Outcome = dict[str, Any]


@router.get(
    "/{id}/suggest",
    summary="Suggestions for the next iteration",
    response_model=Suggestions,
    responses=problem_responses(
        InvalidRequest,
        UnknownStudy,
        UnknownRobot,
        EmptyStudy,
        ShuttingDown,
        StoreUnavailable,
    ),
)
async def suggest_iteration(
    request: Request,
    id: StudyId,
    query: Annotated[SuggestQuery, Query()],
    settings: ServiceSettings,
    engine: ServiceArmEngine,
    store: ServiceStore,
) -> Response:
    """Suggestions for the next iteration: changes of the best iteration (or the last) in one
    respect. The optimiser computes every suggestion. They are in order of the saved energy, with
    their bodies for `POST /studies/{id}/iterations`."""
    deadline = allowed_deadline(
        query.deadline, SuggestQuery.DEFAULT_DEADLINE, settings.max_deadline, "query"
    )
    end = asyncio.get_running_loop().time() + deadline
    # if there are several workers, one stays free for other clients
    computing = _Computing(
        engine, asyncio.Semaphore(max(1, settings.workers - 1)), request.state.id, end
    )
    content = await unless_disconnected(request, _suggestions(store, id, query.base, computing))
    return result_response(TaskResult.of_json(content))


async def _suggestions(
    store: Store, study_id: str, which: str, computing: _Computing
) -> dict[str, Any]:
    state = await store.read(partial(studies.state, study_id=study_id))
    known, study = state.best if which == "best" else state.last, state.study
    if known is None:
        raise EmptyStudy
    iteration = (
        await store.read(partial(studies.entry, study_id=study_id, number=known.number))
    ).iteration
    least = studies.energy_of(study, iteration)
    _, body = await store.read(partial(answers.get, answer_id=iteration.answer_id))
    base = base_of(iteration.kind, iteration.request, orjson.loads(body), study.objective)
    with await known_here(store, study.robot, study.figures):
        found = [] if base is None else proposals(base)
    outcomes = await computing.outcomes(found, study.objective)
    computed = []
    for outcome in outcomes:
        if "energy" in outcome:
            energy = outcome["energy"]
            computed.append(
                outcome | {"gain": least - energy, "threshold_met": energy <= study.threshold}
            )
    return {
        "study": study.id,
        "base": {"number": iteration.number, "energy": least},
        "suggestions": sorted(computed, key=lambda entry: entry["gain"], reverse=True),
        "not_computed": [outcome for outcome in outcomes if "problem" in outcome],
    }


@dataclass(frozen=True)
class _Computing:
    """Computes proposals until `end` [s] of the event loop's clock; `turn` limits how many run at
    the same time.
    """

    engine: ArmEngine
    turn: asyncio.Semaphore
    request_id: str
    end: float

    async def outcomes(self, found: list[Proposal], objective: str) -> list[Outcome]:
        """Compute the outcomes of all proposals. Raises ShuttingDown."""
        try:
            async with asyncio.TaskGroup() as group:
                running = [
                    group.create_task(self._outcome(proposal, objective)) for proposal in found
                ]
        except ExceptionGroup as errors:
            # the first cancelled the other proposals
            raise errors.exceptions[0] from None
        return [task.result() for task in running]

    async def _outcome(self, proposal: Proposal, objective: str) -> Outcome:
        """The proposal with its energy, or with the type of its problem."""
        outcome: Outcome = {
            "step": proposal.step,
            "summary": proposal.summary,
            "request": {"optimize": proposal.request},
        }
        asked = OptimizeRequest.model_validate(proposal.request)
        async with self.turn:
            left = min(self.end - asyncio.get_running_loop().time(), asked.deadline)
            try:
                if left <= 0:
                    raise DeadlineExceeded([])
                result = await self.engine.run(OptimizeTask(asked, self.request_id), left)
            except (JoulepathError, Busy, WorkerLost, InternalError) as error:
                return outcome | {"problem": reported(error).slug()}
        answer = orjson.loads(result.document)
        energy = answer["energy"][objective]["total"]
        return outcome | {
            "energy": energy,
            "duration": answer["duration"],
            "status": answer["status"],
        }
