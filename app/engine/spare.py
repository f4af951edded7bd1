"""Work that can wait: it gets workers that no caller waits for, and gives one back to a caller that
waits too long.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from joulepath.app.engine.fair_queue import PATIENCE, FairQueue
from joulepath.app.engine.work import Ended, Take, Work
from joulepath.app.engine.worker import Worker
from joulepath.app.exceptions.queue import Preempted, WorkerLost
from joulepath.optimizer.exceptions import DeadlineExceeded


@dataclass(eq=False)
class _Run:
    """Work on a worker. `at`: what it is at work on, since `began` [s]. `preempted`: a caller took
    the worker. `over`: nothing more is told of it."""

    worker: Worker
    at: Work | None
    began: float
    preempted: bool = False
    over: bool = False

    @property
    def is_stoppable(self) -> bool:
        """Whether a caller may take the worker now."""
        return self.at is not None and self.at.stoppable and not self.preempted

    def stop(self) -> None:
        """Takes the worker away."""
        self.preempted = True
        self.worker.stop()

    def end(self, error: Exception) -> None:
        """The work that it is at ends with this."""
        if self.at is not None:
            self.at.ended(error)


class SpareWorkers:
    """Lends idle workers of an engine. `grace` [s] is the time after a deadline at which a work is
    stopped.
    """

    def __init__(self, queue: FairQueue, workers: set[Worker], grace: float) -> None:
        self._queue, self._workers, self._grace = queue, workers, grace
        self._runs: dict[Worker, _Run] = {}

    async def run(self, take: Take) -> None:
        """Runs works one after another on one worker, once it is idle and no caller waits for one.

        It ends if there is no more work, a caller waits, or the worker is gone. The work that it
        was at then has ended with DeadlineExceeded, WorkerLost, or, if it is `stoppable`,
        Preempted: a caller took the worker. If cancelled, the work is stopped, and has not ended.
        """
        async with self._queue.spare() as worker:
            first = take()
            if first is not None:
                await self._run(worker, first, take)

    async def _run(self, worker: Worker, first: Work, take: Take) -> None:
        clock = asyncio.get_running_loop().time
        run = self._runs[worker] = _Run(worker, first, clock())

        def turn(ended: Work, how: Ended, following: Work | None) -> None:
            if run.over:
                return
            # if the worker is being stopped, the next one has not begun
            run.at = None if run.preempted or limit.expired() else following
            if run.at is not None:
                run.began = clock()
                limit.reschedule(run.began + run.at.deadline + self._grace)
            ended.ended(how)

        def following() -> Work | None:
            return None if self._queue.someone_waits else take()

        try:
            async with asyncio.timeout(first.deadline + self._grace) as limit:
                await worker.ask_all(first, following, turn)
        except TimeoutError:
            run.end(DeadlineExceeded([]))
        except (WorkerLost, Preempted) as error:
            run.end(error)
        finally:
            run.over = True
            del self._runs[worker]

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
            stoppable = [run for run in self._runs.values() if run.is_stoppable]
            if stoppable:
                max(stoppable, key=lambda run: run.began).stop()
