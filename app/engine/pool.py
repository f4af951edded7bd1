"""The engine: warm worker processes behind a bounded, fair queue, with a deadline per task."""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AsyncExitStack
from dataclasses import dataclass

from joulepath.app.engine.fair_queue import FairQueue, Place
from joulepath.app.engine.forkserver import start_forkserver
from joulepath.app.engine.listening import Listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.engine.spare import SpareWorkers
from joulepath.app.engine.task import Task
from joulepath.app.engine.worker import Worker
from joulepath.app.exceptions.queue import Preempted, ShuttingDown, WorkerLost
from joulepath.app.settings import Settings
from joulepath.optimizer.exceptions import DeadlineExceeded
from joulepath.optimizer.progress import no_listener

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class PoolSettings:
    """Settings of the pool of workers."""

    first_restart_delay: float = 0.5
    """Delay of the first replacement of a worker [s], doubled after every failure."""
    longest_restart_delay: float = 30.0
    """Longest delay of a replacement [s]."""
    longest_warm_up: float = 1800.0
    """Time of a worker for its start [s]; many kernels compile for minutes, a frozen one never."""
    most_deaths: int = 2
    """Dead workers after which a task is given up; the first one may have been killed by chance."""


POOL = PoolSettings()


class Engine:
    """Runs tasks in `settings.workers` processes; `settings.queue_size` more may wait for one.

    Of one client, `settings.client_requests` may run and wait.
    """

    def __init__(self, settings: Settings, warm: Callable[[], None]) -> None:
        self.restarts = 0
        """Number of workers replaced since the start."""
        self._settings = settings
        self._warm = warm
        self.queue: FairQueue = FairQueue(
            capacity=settings.workers + settings.queue_size, share=settings.client_requests
        )
        self._in_flight: set[asyncio.Timeout] = set()
        self._threads = ThreadPoolExecutor(2 * settings.workers, thread_name_prefix="worker-pipe")
        self._workers: set[Worker] = set()
        self._keepers: list[asyncio.Task[None]] = []
        self.spare = SpareWorkers(self.queue, self._workers, settings.deadline_grace)
        self._first_warm = asyncio.Event()
        self._was_ready = False
        self._draining = asyncio.Event()
        self._latest_end = math.inf

    @property
    def warm_workers(self) -> int:
        """Number of workers running a task or ready for one."""
        return sum(worker.alive for worker in self._workers)

    @property
    def worker_pids(self) -> list[int]:
        """Process ids of the warm workers."""
        return [worker.pid for worker in self._workers if worker.alive and worker.pid is not None]

    @property
    def ready(self) -> bool:
        """Whether all workers have been warm once, one is now, no request waits while none is at
        work, and the service is not stopping."""
        is_served = self.warm_workers > 0 and not self.queue.is_stuck
        return self._was_ready and is_served and not self._draining.is_set()

    @property
    def draining(self) -> bool:
        """Whether it is stopping."""
        return self._draining.is_set()

    def start(self) -> None:
        """Starts the workers in the background."""
        start_forkserver()
        self._keepers = [
            asyncio.create_task(self._keep(first=index == 0))
            for index in range(self._settings.workers)
        ]

    async def stop(self) -> None:
        """Kills the workers and waits for their end."""
        self.drain()
        for keeper in self._keepers:
            keeper.cancel()
        await asyncio.gather(*self._keepers, return_exceptions=True)
        for worker in self._workers:
            worker.kill()
        await asyncio.gather(*(worker.ended.wait() for worker in self._workers))
        await asyncio.to_thread(self._threads.shutdown)

    def drain(self) -> None:
        """Refuses new tasks and gives running tasks `settings.shutdown_grace` seconds to finish."""
        if self._draining.is_set():
            return
        self._draining.set()
        self._latest_end = asyncio.get_running_loop().time() + self._settings.shutdown_grace
        # An expired limit ends by itself.
        for limit in [each for each in self._in_flight if not each.expired()]:
            limit.reschedule(min(limit.when() or self._latest_end, self._latest_end))

    async def run(
        self, task: Task, deadline: float, client: str = "", tell: Listener = no_listener
    ) -> TaskResult:
        """The task's result, within `deadline` seconds plus `settings.deadline_grace`.

        The time in the queue counts. Clients take turns, see `FairQueue`. A task starts again if
        another client needs its worker, and once if its worker dies. If cancelled, it leaves the
        queue or is stopped.

        Args:
            task: the task.
            deadline: time for queue and task [s].
            client: the client.
            tell: receives the events of the task, from the first one again after a restart.

        Raises:
            JoulepathError: the error of the task (see `Task.run`).
            Busy: the queue is full.
            TooManyRequests: the client's share of the queue is full.
            ShuttingDown: the service is stopping.
            DeadlineExceeded: the time is over.
            WorkerLost: the task has ended two workers.
        """
        if self._draining.is_set():
            raise ShuttingDown
        end = asyncio.get_running_loop().time() + deadline
        try:
            with self.queue.place(client) as place:
                async with asyncio.timeout_at(end) as limit:
                    self._in_flight.add(limit)
                    try:
                        return await self._run_in_worker(task, end, limit, place, tell)
                    finally:
                        self._in_flight.discard(limit)
        except TimeoutError:
            raise (ShuttingDown() if self._draining.is_set() else DeadlineExceeded([])) from None

    async def _run_in_worker(
        self, task: Task, end: float, limit: asyncio.Timeout, place: Place, tell: Listener
    ) -> TaskResult:
        deaths = 0
        while True:
            limit.reschedule(min(end, self._latest_end))
            async with AsyncExitStack() as turn:
                with self.spare.someone_waits():
                    worker = await turn.enter_async_context(self.queue.worker(place))
                # The grace lets the optimiser return its best motion at the deadline.
                limit.reschedule(min(end + self._settings.deadline_grace, self._latest_end))
                left = end - asyncio.get_running_loop().time()
                if left <= 0:
                    raise DeadlineExceeded([])
                if not place.gave_back:  # nobody is stopped twice
                    place.give_back = worker.stop
                try:
                    return await worker.ask(task, left, tell)
                except Preempted:
                    reason = "gave its worker back"
                except WorkerLost:
                    deaths += 1
                    if self._draining.is_set():
                        raise ShuttingDown from None
                    if deaths == POOL.most_deaths:
                        raise
                    reason = "its worker died"
            place.begins_again = True
            logger.info(
                "begins again",
                extra={"request_id": task.request_id, "client": place.client, "reason": reason},
            )

    async def _keep(self, first: bool) -> None:
        """Keeps one worker alive: starts it, waits for its end, starts the next."""
        if not first:
            # The first worker compiles the kernels for the cache of all workers.
            await self._first_warm.wait()
        delay = POOL.first_restart_delay
        while True:
            try:
                worker = Worker(
                    self._warm, self._settings.log_level, self._threads, self._settings.stop_grace
                )
                async with asyncio.timeout(POOL.longest_warm_up):
                    await worker.start()
            except Exception as error:
                # also without memory, files or threads for it: there may be some later
                is_told = isinstance(error, WorkerLost | TimeoutError)
                logger.error(
                    "worker did not start",
                    exc_info=None if is_told else error,
                    extra={"retry_in": delay},
                )
                await asyncio.sleep(delay)
                delay = min(2 * delay, POOL.longest_restart_delay)
                continue
            delay = POOL.first_restart_delay
            self._has_warmed(worker)
            await worker.ended.wait()
            self._workers.discard(worker)
            self.queue.remove(worker)
            self.restarts += 1

    def _has_warmed(self, worker: Worker) -> None:
        self._workers.add(worker)
        self.queue.put(worker)
        self._first_warm.set()
        logger.info("worker warm", extra={"pid": worker.pid})
        if not self._was_ready and self.warm_workers == self._settings.workers:
            self._was_ready = True
            logger.info("ready", extra={"workers": self.warm_workers})
