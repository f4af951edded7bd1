"""The work on one lease, from its request to its outcome."""

from __future__ import annotations

import logging
import time
from typing import Any

import orjson

from app.engine.result import json_document
from app.exceptions import (
    ClusterUnavailable,
    Preempted,
    ServiceError,
    ShuttingDown,
    StoreUnavailable,
    TaskFailed,
    TooManyDeaths,
    WorkerDied,
)
from app.http.problem_details import problem_content
from app.jobs.executor import Executor
from app.store.leases import Lease, Outcome
from app.tasks.job_request import JobRequestTask, JobResult
from optimizer.exceptions import JoulepathError
from optimizer.progress import Tell

logger = logging.getLogger(__name__)

MOST_DEATHS = 3
"""Workers that may die of a request."""
MOST_PREEMPTIONS = 2
"""Times that a caller may take the worker of a request; then it is left to end."""


async def outcome_of(lease: Lease, executor: Executor, tell: Tell) -> Outcome:
    """Runs the request of a lease; `tell` gets what it finds. Raises CancelledError only."""
    began = time.perf_counter()
    task = JobRequestTask(lease.kind, lease.body, _request_id(lease))
    try:
        result = await executor.run(task, lease.deadline, lease.preempted < MOST_PREEMPTIONS, tell)
    except Preempted:
        return Outcome(lease, "waiting", preempted=True)
    except (ShuttingDown, StoreUnavailable, ClusterUnavailable):
        return Outcome(lease, "waiting")
    except WorkerDied:
        if lease.deaths + 1 < MOST_DEATHS:
            return Outcome(lease, "waiting", died=True)
        return _failed(lease, TooManyDeaths(), task.request_id, began)
    except (JoulepathError, ServiceError) as error:
        return _failed(lease, error, task.request_id, began)
    except Exception:
        logger.exception("unforeseen error", extra={"request_id": task.request_id})
        return defect(lease)
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
    )


def defect(lease: Lease) -> Outcome:
    """The outcome of a request that a defect of the service ends; the log has it."""
    return Outcome(lease, "failed", problem=_content(TaskFailed(), _request_id(lease)))


def _request_id(lease: Lease) -> str:
    return f"{lease.job_id}.{lease.number}"


def _failed(lease: Lease, error: Exception, request_id: str, began: float) -> Outcome:
    return Outcome(lease, "failed", time.perf_counter() - began, problem=_content(error, request_id))


def _content(error: Exception, request_id: str) -> dict[str, Any]:
    # as it is sent: without arrays, and null for what is not finite
    content: dict[str, Any] = orjson.loads(json_document(problem_content(error, request_id)))
    return content
