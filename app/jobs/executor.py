"""What runs the requests of jobs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from app.cluster.link import Cluster
from app.engine.pool import Engine
from app.engine.result import TaskResult
from app.engine.task import Task
from app.store.store import Store
from app.tasks.arm_engine import ArmEngine
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
        return await ArmEngine(_Spare(self.engine, stoppable), self.store).run(task, deadline, tell)


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
        return await ArmEngine(self.cluster, self.store).run(task, deadline, tell)


@dataclass(frozen=True)
class _Spare:
    engine: Engine
    stoppable: bool

    async def run(self, task: Task, deadline: float, tell: Tell = nobody) -> TaskResult:
        return await self.engine.spare.run(task, deadline, self.stoppable, tell)
