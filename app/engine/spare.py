"""Work that can wait: it gets workers that no caller waits for, and gives one back to a caller that waits too long."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from app.engine.census import Census
from app.engine.fair_queue import PATIENCE, FairQueue
from app.engine.result import TaskResult
from app.engine.task import Task
from app.engine.worker import Worker
from app.exceptions import Preempted
from optimizer.exceptions import DeadlineExceeded
from optimizer.progress import Tell, nobody


@dataclass(eq=False)
class _Run:
    """Work on a worker. `stoppable`: a caller may take the worker."""

    asking: asyncio.Task[TaskResult]
    stoppable: bool
    preempted: bool = False


class SpareWorkers:
    """Lends idle workers of an engine. `grace` [s] is the time after a deadline at which a worker is killed."""

    def __init__(self, queue: FairQueue[Worker], workers: set[Worker], census: Census, grace: float) -> None:
        self._queue, self._workers, self._census, self._grace = queue, workers, census, grace
        self._runs: dict[Worker, _Run] = {}

    async def run(self, task: Task, deadline: float, stoppable: bool = True, tell: Tell = nobody) -> TaskResult:
        """The task's result, once a worker is idle and no caller waits for one. `deadline` [s] counts from then on.
        `tell` gets what the task finds.

        If cancelled, its worker is killed. Raises what the task raises, DeadlineExceeded, WorkerDied, or, if it is
        `stoppable`, Preempted: a caller took the worker.
        """
        worker = await self._queue.spare()
        run = self._runs[worker] = _Run(asyncio.create_task(worker.ask(task, deadline, tell)), stoppable)
        try:
            with self._census.works():
                async with asyncio.timeout(deadline + self._grace):
                    return await run.asking
        except TimeoutError:
            raise DeadlineExceeded([]) from None
        except asyncio.CancelledError:
            if run.preempted:
                raise Preempted from None
            raise
        finally:
            run.asking.cancel()
            del self._runs[worker]
            self._queue.put(worker)

    @contextmanager
    def someone_waits(self) -> Iterator[None]:
        """A context in which a caller waits for an idle worker."""
        patience = asyncio.get_running_loop().call_later(PATIENCE, self._make_room)
        try:
            yield
        finally:
            patience.cancel()

    def _make_room(self) -> None:
        """Stops the work that began last, if work that can wait has all workers."""
        if self._runs.keys() >= {worker for worker in self._workers if worker.alive}:
            stoppable = [run for run in self._runs.values() if run.stoppable and not run.preempted]
            if stoppable:
                stoppable[-1].preempted = True
                stoppable[-1].asking.cancel()
