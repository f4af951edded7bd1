"""What runs the requests of jobs."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

from app.cluster.link import Cluster
from app.engine.pool import Engine
from app.engine.result import TaskResult
from app.engine.task import Task
from app.schemas.identifications import IdentifyRequest
from app.store import logs
from app.store.store import Store
from app.tasks.arm_engine import ArmEngine
from app.tasks.job_request import IDENTIFY, JobRequestTask
from optimizer.progress import Tell, nobody


class Executor(Protocol):
    """Runs one task at a time for each of its callers."""

    @property
    def slots(self) -> int:
        """Tasks that it can run at the same time at present."""
        ...

    async def run(self, task: Task, deadline: float, stoppable: bool, tell: Tell) -> TaskResult:
        """The task's result, for which `deadline` [s] is left once work on it begins. `tell` gets what it finds.

        If cancelled, the work is stopped at once. Raises what the task raises, DeadlineExceeded, WorkerDied,
        ShuttingDown, ClusterUnavailable, or, if it is `stoppable`, Preempted.
        """
        ...


@dataclass(frozen=True)
class LocalExecutor:
    """Runs tasks in workers of this service that no caller waits for. Users' own robots come from the database."""

    engine: Engine
    store: Store
    slots: int

    async def run(self, task: Task, deadline: float, stoppable: bool, tell: Tell) -> TaskResult:
        """See `Executor`."""
        spare = _Spare(self.engine, stoppable)
        return await ArmEngine(spare, self.store).run(await _with_logs(task, self.store), deadline, tell)


@dataclass(frozen=True)
class ClusterExecutor:
    """Runs tasks on a cluster. No caller waits for its workers, so that none is taken away."""

    cluster: Cluster
    store: Store

    @property
    def slots(self) -> int:
        """See `Executor`."""
        return self.cluster.slots

    async def run(self, task: Task, deadline: float, stoppable: bool, tell: Tell) -> TaskResult:
        """See `Executor`."""
        return await ArmEngine(self.cluster, self.store).run(await _with_logs(task, self.store), deadline, tell)


async def _with_logs(task: Task, store: Store) -> Task:
    """The task with the logs that an identification names. Raises UnknownLog or StoreUnavailable."""
    if not isinstance(task, JobRequestTask) or task.kind != IDENTIFY:
        return task
    asked = IdentifyRequest.model_validate_json(zlib.decompress(task.body))
    found = [await store.read(partial(logs.get, log_id=each)) for each in asked.all_logs]
    return replace(task, logs=tuple((log.settings, log.body) for log in found))


@dataclass(frozen=True)
class _Spare:
    engine: Engine
    stoppable: bool

    async def run(self, task: Task, deadline: float, tell: Tell = nobody) -> TaskResult:
        return await self.engine.spare.run(task, deadline, self.stoppable, tell)
