"""The work on one lease, from its request to its outcome."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from typing import Any

import orjson

from joulepath.app.engine.result import TaskResult, json_document
from joulepath.app.engine.work import Ended
from joulepath.app.exceptions.base import InternalError
from joulepath.app.exceptions.queue import (
    ClusterUnavailable,
    Preempted,
    ShuttingDown,
    WorkerDied,
    WorkerLost,
)
from joulepath.app.exceptions.stored import StoreUnavailable
from joulepath.app.http.problems import problem_of
from joulepath.app.store.leases import Lease, Outcome
from joulepath.app.tasks.job_request import JobRequestTask, JobResult
from joulepath.optimizer.exceptions import DeclaredError

logger = logging.getLogger(__name__)

MOST_DEATHS = 3
"""Workers that may die of a request."""
MOST_PREEMPTIONS = 2
"""Times that a caller may take the worker of a request; then it is left to end."""


def task_of(lease: Lease, motions: Mapping[str, bytes]) -> JobRequestTask:
    """The task of a lease; `motions` are known ones of the cell of a cycle."""
    return JobRequestTask(lease.kind, lease.body, request_id_of(lease), motions=motions)


def outcome_of(lease: Lease, ended: Ended, began: float) -> Outcome:
    """The outcome of work that began at a time [s] by `perf_counter` and ended like this."""
    if not isinstance(ended, Exception):
        return _done(lease, ended)
    if isinstance(ended, Preempted):
        return Outcome(lease, "waiting", preempted=True)
    if isinstance(ended, ShuttingDown | StoreUnavailable | ClusterUnavailable):
        return Outcome(lease, "waiting")
    if isinstance(ended, WorkerLost) and lease.deaths + 1 < MOST_DEATHS:
        return Outcome(lease, "waiting", died=True)
    error = WorkerDied() if isinstance(ended, WorkerLost) else ended
    if isinstance(error, DeclaredError):
        return _failed(lease, error, began)
    logger.error("unforeseen error", exc_info=error, extra={"request_id": request_id_of(lease)})
    return defect(lease)


def _done(lease: Lease, result: TaskResult) -> Outcome:
    assert isinstance(result, JobResult)
    return Outcome(
        lease,
        "done",
        result.wall_time,
        result.figures,
        result.document,
        result.kept_as,
        result.stored,
        result.parts,
        identified=result.identified,
        is_optimal=result.is_optimal,
        motions=result.motions,
    )


def defect(lease: Lease) -> Outcome:
    """The outcome of a request that a defect of the service ends; the log has it."""
    return Outcome(lease, "failed", problem=_content(InternalError(), request_id_of(lease)))


def request_id_of(lease: Lease) -> str:
    """The id of the request."""
    return f"{lease.job_id}.{lease.number}"


def _failed(lease: Lease, error: Exception, began: float) -> Outcome:
    return Outcome(
        lease, "failed", time.perf_counter() - began, problem=_content(error, request_id_of(lease))
    )


def _content(error: Exception, request_id: str) -> dict[str, Any]:
    # as it is sent: without arrays, and null for what is not finite
    content: dict[str, Any] = orjson.loads(json_document(problem_of(error, request_id)))
    return content
