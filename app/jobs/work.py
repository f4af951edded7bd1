"""The work on one lease, from its request to its outcome."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import orjson

from joulepath.app.engine.result import TaskResult, json_document
from joulepath.app.engine.task import Ended
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


@dataclass(frozen=True)
class RetrySettings:
    """Retries of a request."""

    deaths: int = 3
    """Dead workers after which a request fails."""
    preemptions: int = 2
    """Preemptions of a request, after which it may run to its end."""


RETRY = RetrySettings()


def task_of(lease: Lease, motions: Mapping[str, bytes]) -> JobRequestTask:
    """The task of a lease; `motions` are known motions of the cell of a cycle."""
    return JobRequestTask(lease.kind, lease.body, request_id_of(lease), motions=motions)


def outcome_of(lease: Lease, ended: Ended, began: float) -> Outcome:
    """The outcome of work started at `began` [s] by `perf_counter`."""
    if not isinstance(ended, Exception):
        return _done(lease, ended)
    if isinstance(ended, Preempted):
        return Outcome(lease, "waiting", preempted=True)
    if isinstance(ended, ShuttingDown | StoreUnavailable | ClusterUnavailable):
        return Outcome(lease, "waiting")
    if isinstance(ended, WorkerLost) and lease.deaths + 1 < RETRY.deaths:
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
    """The outcome of a request ended by a logged defect of the service."""
    return Outcome(lease, "failed", problem=_content(InternalError(), request_id_of(lease)))


def request_id_of(lease: Lease) -> str:
    """The id of the request."""
    return f"{lease.job_id}.{lease.number}"


def _failed(lease: Lease, error: Exception, began: float) -> Outcome:
    return Outcome(
        lease, "failed", time.perf_counter() - began, problem=_content(error, request_id_of(lease))
    )


def _content(error: Exception, request_id: str) -> dict[str, Any]:
    # as sent: without arrays, and null for non-finite numbers
    content: dict[str, Any] = orjson.loads(json_document(problem_of(error, request_id)))
    return content
