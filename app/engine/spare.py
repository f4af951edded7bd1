"""Work that can wait: it gets workers that no caller waits for, and gives one back to a caller that waits too long."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from app.engine.census import Census
from app.engine.fair_queue import PATIENCE, FairQueue
from app.engine.work import Ended, Take, Work
from app.engine.worker import Worker
from app.exceptions import Preempted, WorkerDied
from optimizer.exceptions import DeadlineExceeded


@dataclass(eq=False)
class _Run:
    """Work on a worker. `at`: what it is at work on, since `began` [s]. `preempted`: a caller took the worker."""

    at: Work | None
    began: float
    asking: asyncio.Task[None] | None = None
    preempted: bool = False

    @property
    def is_stoppable(self) -> bool:
        """Whether a caller may take the worker now."""
        return self.at is not None and self.at.stoppable and not self.preempted

    def stop(self) -> None:
        """Takes the worker away."""
        self.preempted = True
        if self.asking is not None:
            self.asking.cancel()


class SpareWorkers:
    """Lends idle workers of an engine. `grace` [s] is the time after a deadline at which a worker is killed."""

    def __init__(self, queue: FairQueue[Worker], workers: set[Worker], census: Census, grace: float) -> None:
        self._queue, self._workers, self._census, self._grace = queue, workers, census, grace
        self._runs: dict[Worker, _Run] = {}

    async def run(self, take: Take) -> None:
        """Runs works one after another on one worker, once it is idle and no caller waits for one.

        It ends if there is no more work, a caller waits, or the worker is gone. The work that it was at then has ended
        with DeadlineExceeded, WorkerDied, or, if it is `stoppable`, Preempted: a caller took the worker. If cancelled,
        the worker is killed, and what it was at has not ended.
        """
        worker = await self._queue.spare()
        first = take()
        try:
            if first is not None:
                await self._run(worker, first, take)
        finally:
            self._queue.put(worker)

    async def _run(self, worker: Worker, first: Work, take: Take) -> None:
        clock = asyncio.get_running_loop().time
        run = self._runs[worker] = _Run(first, clock())

        def turn(ended: Work, how: Ended, following: Work | None) -> None:
            # if the worker is being killed, the next one has not begun
            run.at = None if run.preempted or limit.expired() else following
            if run.at is not None:
                run.began = clock()
                limit.reschedule(run.began + run.at.deadline + self._grace)
            ended.ended(how)

        def stopped(error: Exception) -> None:
            if run.at is not None:
                run.at.ended(error)

        def following() -> Work | None:
            return None if self._queue.someone_waits else take()

        run.asking = asyncio.create_task(worker.ask_all(first, following, turn))
        try:
            with self._census.works():
                async with asyncio.timeout(first.deadline + self._grace) as limit:
                    await run.asking
        except TimeoutError:
            stopped(DeadlineExceeded([]))
        except WorkerDied as error:
            stopped(error)
        except asyncio.CancelledError:
            if not run.preempted:
                raise
            stopped(Preempted())
        finally:
            run.asking.cancel()
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
