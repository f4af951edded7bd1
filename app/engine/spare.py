"""Deferrable work on idle workers; a caller waiting too long gets a worker back."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from joulepath.app.engine.fair_queue import PATIENCE, FairQueue
from joulepath.app.engine.task import Ended, Take, Work
from joulepath.app.engine.worker import Worker
from joulepath.app.exceptions.queue import Preempted, WorkerLost
from joulepath.optimizer.exceptions import DeadlineExceeded


@dataclass(eq=False)
class _Run:
    """Deferrable work on one worker.

    `at` is the running work, since `began` [s]. `preempted`: a caller has taken the worker. `over`:
    no more events are reported.
    """

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
        """Ends the running work with an error."""
        if self.at is not None:
            self.at.ended(error)


class SpareWorkers:
    """Lends idle workers of an engine; work is stopped `grace` [s] after its deadline."""

    def __init__(self, queue: FairQueue, workers: set[Worker], grace: float) -> None:
        self._queue, self._workers, self._grace = queue, workers, grace
        self._runs: dict[Worker, _Run] = {}

    async def run(self, take: Take) -> None:
        """Runs works one after another on one worker, once it is idle and no caller waits.

        It returns when there is no more work, when a caller waits, or when the worker is lost. The
        running work then ends with DeadlineExceeded, with WorkerLost, or, if `stoppable`, with
        Preempted. If cancelled, the work is stopped without a result.
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
        """A context of a caller waiting for an idle worker."""
        patience = asyncio.get_running_loop().call_later(PATIENCE, self._make_room)
        try:
            yield
        finally:
            patience.cancel()

    def _make_room(self) -> None:
        """Stops the latest deferrable work if such work has all workers."""
        if self._runs.keys() >= {worker for worker in self._workers if worker.alive}:
            stoppable = [run for run in self._runs.values() if run.is_stoppable]
            if stoppable:
                max(stoppable, key=lambda run: run.began).stop()
