"""Executors of the requests of jobs."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol, TypeGuard

from joulepath.app.api.identifications.request import IdentifyRequest
from joulepath.app.cluster.link import Cluster
from joulepath.app.convert.packed import unpacked
from joulepath.app.engine.listening import Listener
from joulepath.app.engine.pool import Engine
from joulepath.app.engine.result import TaskResult
from joulepath.app.engine.task import Ended, Take, Task, Work, result_of
from joulepath.app.exceptions.queue import Preempted
from joulepath.app.exceptions.stored import UnknownFigures, UnknownLog
from joulepath.app.store.store import Store
from joulepath.app.tasks.arm_engine import ArmEngine, given_log
from joulepath.app.tasks.job_request import IDENTIFY, JobRequestTask
from joulepath.optimizer.exceptions import DeclaredError, UnknownRobot
from joulepath.optimizer.progress import no_listener


class Executor(Protocol):
    """Runs works one after another for every caller."""

    @property
    def slots(self) -> int:
        """Number of callers needed for full use."""
        ...

    async def run(self, take: Take) -> None:
        """Runs works until there is none, or a caller of the service needs the worker.

        A work ends with its result, the error of its task, DeadlineExceeded, WorkerLost, or, if
        `stoppable`, Preempted. If cancelled, the work is stopped at once. Raises
        ClusterUnavailable; works without an outcome must then run again.
        """
        ...


@dataclass(frozen=True)
class LocalExecutor:
    """Runs works in idle workers of this service. Users' own robots come from the database."""

    engine: Engine
    store: Store
    slots: int

    async def run(self, take: Take) -> None:
        """See `Executor`."""
        await _run(self.engine.spare.run, self.store, take)


@dataclass(frozen=True)
class ClusterExecutor:
    """Runs works on a cluster, whose workers are not needed by callers."""

    cluster: Cluster
    store: Store

    @property
    def slots(self) -> int:
        """See `Executor`."""
        return self.cluster.slots

    async def run(self, take: Take) -> None:
        """See `Executor`."""
        await _run(self.cluster.run, self.store, take)


async def _run(run: Callable[[Take], Awaitable[None]], store: Store, take: Take) -> None:
    """Runs works; works with items of the database follow the others, one by one."""
    waiting: list[Work] = []

    def ended(work: Work, how: Ended) -> None:
        if isinstance(how, UnknownRobot | UnknownFigures | UnknownLog):
            waiting.append(work)
        else:
            work.ended(how)

    def taken() -> Work | None:
        while (work := take()) is not None and _needs_logs(work.task):
            waiting.append(work)
        return None if work is None else replace(work, ended=partial(ended, work))

    await run(taken)
    for work in waiting:
        alone = _Alone(run, work.stoppable)
        try:
            task = await _with_logs(work.task, store)
            work.ended(await ArmEngine(alone, store).run(task, work.deadline, work.tell))
        except (DeclaredError, Preempted) as error:
            work.ended(error)


def _needs_logs(task: Task) -> TypeGuard[JobRequestTask]:
    return isinstance(task, JobRequestTask) and task.kind == IDENTIFY


async def _with_logs(task: Task, store: Store) -> Task:
    """The task with the logs of an identification. Raises UnknownLog or StoreUnavailable."""
    if not _needs_logs(task):
        return task
    asked = IdentifyRequest.model_validate_json(unpacked(task.body))
    return replace(task, logs=tuple([await given_log(store, each) for each in asked.all_logs]))


@dataclass(frozen=True)
class _Alone:
    """Runs one task at a time by a function for many."""

    many: Callable[[Take], Awaitable[None]]
    stoppable: bool

    async def run(self, task: Task, deadline: float, tell: Listener = no_listener) -> TaskResult:
        return await result_of(self.many, task, deadline, self.stoppable, tell)
