"""Searches for motions: POST /optimize, /compare, /pareto, /cycle, /placement, /whatif, /advice."""

from __future__ import annotations

from fastapi import APIRouter, Response

from joulepath.app.answers.declared import model_of
from joulepath.app.api.advice.request import AdviceRequest
from joulepath.app.api.advice.task import AdviceAnswer, AdviceTask
from joulepath.app.api.compare.task import CompareAnswer, CompareRequest, CompareTask
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.cycle.task import CycleAnswer, CycleTask
from joulepath.app.api.optimize.task import OptimizeAnswer, OptimizeTask
from joulepath.app.api.pareto.task import ParetoAnswer, ParetoRequest, ParetoTask
from joulepath.app.api.placement.request import PlacementRequest
from joulepath.app.api.placement.task import PlacementAnswer, PlacementTask
from joulepath.app.api.shared.dependencies import ServiceCache
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.parameters import CACHED_HEADERS, WantedFormat
from joulepath.app.api.shared.problem_lists import CYCLE_PROBLEMS, MOTION_PROBLEMS, WORKER_PROBLEMS
from joulepath.app.api.shared.reply import BY_EVENTS, ServiceTasks
from joulepath.app.api.whatif.answer import WhatifAnswer
from joulepath.app.api.whatif.task import WhatifRequest, WhatifTask
from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.stored import (
    StoreUnavailable,
    UnknownAnswer,
    UnknownFigures,
    UnknownLog,
)
from joulepath.app.http.handlers import result_response
from joulepath.app.http.openapi import problem_responses
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.app.tasks.read_body import HeldBody
from joulepath.app.tasks.request_key import cell_of
from joulepath.optimizer.exceptions import ContradictoryOrder, InvalidTable, OutsideLimits
from joulepath.optimizer.placement.errors import NoPlacement
from joulepath.optimizer.progress import Tell
from joulepath.optimizer.search.errors import PathInfeasible

router = APIRouter(tags=["motion"], route_class=LargeBodyRoute)


@router.post(
    "/optimize",
    summary="The motion of least energy",
    response_model=model_of(OptimizeAnswer),
    responses={
        200: {"content": BY_EVENTS, "headers": CACHED_HEADERS},
        **problem_responses(*MOTION_PROBLEMS, PathInfeasible),
    },
)
async def optimize(body: OptimizeRequest, tasks: ServiceTasks, cache: ServiceCache) -> Response:
    """Finds the motion of least energy from standstill at `start` to standstill at `goal`, over all
    arm configurations. The answer has its energy breakdown, and a certificate that the motion is
    within all limits. `GET /answers/{id}` returns it again. The same request is answered from the
    database the next time; with `Cache-Control: no-cache` it is computed again. `Accept:
    text/event-stream` returns events while the search runs, and then the answer."""
    task = OptimizeTask(body, tasks.request_id)

    async def work(tell: Tell) -> TaskResult:
        deadline = tasks.deadline(body)
        asked = await cache.asked("optimize", body, deadline)
        known = await cache.find(asked, tasks.request_id)
        if known is not None:
            return known
        return await tasks.kept("optimize", await tasks.engine.run(task, deadline, tell), asked)

    return await tasks.respond(work)


@router.post(
    "/compare",
    summary="The same motion by several methods",
    response_model=model_of(CompareAnswer),
    responses={
        200: {"content": BY_EVENTS},
        **problem_responses(*MOTION_PROBLEMS),
    },
)
async def compare(body: CompareRequest, tasks: ServiceTasks) -> Response:
    """Solves one request with several methods, one after another. The answer is a table of their
    energies, durations and solve times, with certified motions. The row of a method without a
    motion has its problem. If no method finds a motion, the answer is the problem of the first
    method in the request. `Accept: text/event-stream` returns events while the methods run, and
    then the answer."""
    return await tasks.search("compare", CompareTask(body, tasks.request_id), body)


@router.post(
    "/pareto",
    summary="Energy over duration",
    response_model=model_of(ParetoAnswer),
    responses={
        200: {"content": {"text/csv": {"schema": {"type": "string"}}, **BY_EVENTS}},
        **problem_responses(*MOTION_PROBLEMS, StoreUnavailable),
    },
)
async def pareto(body: ParetoRequest, wanted: WantedFormat, tasks: ServiceTasks) -> Response:
    """Finds the Pareto front of duration and energy over all arm configurations, from the fastest
    motion to the motion of least energy. Each point refers to its complete answer.
    `Accept: text/csv` returns the points as CSV, `Accept: text/event-stream` events while the
    search runs, and then the answer."""
    return await tasks.search("pareto", ParetoTask(body, tasks.request_id, wanted), body)


@router.post(
    "/cycle",
    summary="A cycle of stops with least energy",
    response_model=model_of(CycleAnswer),
    responses={
        200: {"content": {"text/csv": {"schema": {"type": "string"}}, **BY_EVENTS}},
        **problem_responses(*CYCLE_PROBLEMS),
    },
)
async def cycle(
    body: CycleRequest,
    wanted: WantedFormat,
    tasks: ServiceTasks,
    cache: ServiceCache,
) -> Response:
    """Finds the arm configurations at all stops of a cycle, and the motions between them, with the
    least total energy. The configuration at a stop affects the cost of the moves on both sides, so
    that all are chosen together. A move refers to its complete answer. `Accept:
    text/csv` returns the samples of the cycle, `Accept: text/event-stream` events while the search
    runs, and then the answer."""
    # a body above 64 KiB is not looked into here
    cell = None if isinstance(body, HeldBody) else cell_of(body)

    async def work(tell: Tell) -> TaskResult:
        task = CycleTask(body, tasks.request_id, wanted, await cache.motions(cell))
        result = await tasks.engine.run(task, tasks.deadline(body), tell)
        return await tasks.kept("cycle", result, cell=cell)

    return await tasks.respond(work)


@router.post(
    "/placement",
    summary="Where to put the robot",
    response_model=model_of(PlacementAnswer),
    responses={
        200: {"content": BY_EVENTS},
        **problem_responses(
            *WORKER_PROBLEMS,
            UnknownFigures,
            OutsideLimits,
            ContradictoryOrder,
            NoPlacement,
        ),
    },
)
async def placement(body: PlacementRequest, tasks: ServiceTasks) -> Response:
    """Finds the place of the robot, or of stops and obstacles around it, with the least energy of
    given cycles. The answer has the best and the nominal place with their complete cycles, and a
    map of the region with the energy of every place, or the reason why the cycles fail there.
    `Accept: text/event-stream` returns events while the search runs, and then the answer."""
    return await tasks.search("placement", PlacementTask(body, tasks.request_id), body)


@router.post(
    "/whatif",
    summary="The energy of a motion on a changed arm",
    response_model=model_of(WhatifAnswer),
    responses={
        **problem_responses(
            *MOTION_PROBLEMS,
            PathInfeasible,
            InvalidTable,
            UnknownLog,
            StoreUnavailable,
        ),
    },
)
async def whatif(body: WhatifRequest, tasks: ServiceTasks) -> Response:
    """Compares one motion on the arm as it is with the same task on changed arms: lighter links,
    another payload, other drives or limits. Each change has two results, as differences from the
    base: the base's motion on the changed arm, and the best motion of the changed arm. A given
    motion (`evaluate`) is evaluated only."""
    result = await tasks.result(WhatifTask(body, tasks.request_id), body)
    parts = "evaluate" if body.optimize is None else "optimize"
    return result_response(await tasks.kept("whatif", result, parts=parts))


@router.post(
    "/advice",
    summary="Changes that save energy",
    response_model=model_of(AdviceAnswer),
    responses=problem_responses(*dict.fromkeys((*MOTION_PROBLEMS, *CYCLE_PROBLEMS)), UnknownAnswer),
)
async def advice(body: AdviceRequest, tasks: ServiceTasks) -> Response:
    """Computes changes of a task: a motion over the whole cycle, brakes at rest, a cycle without
    the moves from and to the start, shorter stops, a lighter tool. Every change is optimised, and
    listed with its energy if it saves energy. The service stores no answer."""
    return await tasks.answer(AdviceTask(body, tasks.request_id))
