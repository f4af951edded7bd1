"""The executor of the requests of jobs."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeGuard

from joulepath.app.api.identifications.request import IdentifyRequest
from joulepath.app.convert.packed import unpacked
from joulepath.app.engine.task import Ended, Take, Task, Work, result_of
from joulepath.app.exceptions.queue import Preempted
from joulepath.app.exceptions.stored import UnknownFigures, UnknownLog
from joulepath.app.store.store import Store
from joulepath.app.tasks.arm_engine import ArmEngine, given_log
from joulepath.app.tasks.job_request import IDENTIFY, JobRequestTask
from joulepath.optimizer.exceptions import DeclaredError, UnknownRobot


@dataclass(frozen=True)
class Executor:
    """Runs works of jobs one after another for every caller, in workers of this service or on a
    cluster. Users' own robots, figures and logs come from the database.
    """

    many: Callable[[Take], Awaitable[None]]
    """Runs works until there is none, see `SpareWorkers.run` and `Cluster.run`."""
    store: Store
    count: Callable[[], int]

    @property
    def slots(self) -> int:
        """Number of callers needed for full use."""
        return self.count()

    async def run(self, take: Take) -> None:
        """Runs works until there is none, or a caller of the service needs the worker. Works with
        items of the database follow the others, one by one.

        A work ends with its result, the error of its task, DeadlineExceeded, WorkerLost, or, if
        `stoppable`, Preempted. If cancelled, the work is stopped at once. Raises
        ClusterUnavailable; works without an outcome must then run again.
        """
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

        await self.many(taken)
        for work in waiting:
            alone = partial(result_of, self.many, stoppable=work.stoppable)
            try:
                task = await _with_logs(work.task, self.store)
                work.ended(await ArmEngine(alone, self.store).run(task, work.deadline, work.tell))
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
