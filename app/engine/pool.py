"""The engine: warm worker processes behind a bounded queue, each task with a deadline."""

from __future__ import annotations

import asyncio
import atexit
import logging
import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from app.engine.census import Census
from app.engine.forkserver import start_forkserver
from app.engine.result import TaskResult
from app.engine.task import Task
from app.engine.worker import Worker
from app.exceptions import Busy, ShuttingDown, WorkerDied
from app.settings import Settings
from optimizer.exceptions import DeadlineExceeded

logger = logging.getLogger(__name__)

_FIRST_RESTART_DELAY = 0.5
_LONGEST_RESTART_DELAY = 30.0


class Engine:
    """Runs tasks in `settings.workers` processes; `settings.queue_size` more may wait for one."""

    def __init__(self, settings: Settings, warm: Callable[[], None]) -> None:
        self.census = Census()
        self._settings = settings
        self._warm = warm
        self._capacity = settings.workers + settings.queue_size
        self._in_flight: set[asyncio.Timeout] = set()
        self._threads = ThreadPoolExecutor(2 * settings.workers, thread_name_prefix="worker-pipe")
        self._workers: set[Worker] = set()
        self._keepers: list[asyncio.Task[None]] = []
        self._idle: asyncio.Queue[Worker] = asyncio.Queue()
        self._first_warm = asyncio.Event()
        self._was_ready = False
        self._draining = asyncio.Event()
        self._latest_end = math.inf

    @property
    def warm_workers(self) -> int:
        """Number of workers that run a task or could run one."""
        return sum(worker.alive for worker in self._workers)

    @property
    def worker_pids(self) -> list[int]:
        """Process ids of the warm workers."""
        return [worker.pid for worker in self._workers if worker.alive and worker.pid is not None]

    @property
    def ready(self) -> bool:
        """Whether all workers have been warm once, one is now, and the service is not stopping."""
        return self._was_ready and self.warm_workers > 0 and not self._draining.is_set()

    def start(self) -> None:
        """Starts the workers in the background."""
        start_forkserver()
        # `stop` is skipped when the operator forces the exit
        atexit.register(self._kill_all)
        self._keepers = [asyncio.create_task(self._keep(first=index == 0)) for index in range(self._settings.workers)]

    async def stop(self) -> None:
        """Kills the workers and waits for their end."""
        self.drain()
        for keeper in self._keepers:
            keeper.cancel()
        await asyncio.gather(*self._keepers, return_exceptions=True)
        self._kill_all()
        await asyncio.gather(*(worker.ended.wait() for worker in self._workers))
        await asyncio.to_thread(self._threads.shutdown)
        atexit.unregister(self._kill_all)

    def drain(self) -> None:
        """Refuses new tasks. Those in flight get `settings.shutdown_grace` seconds to finish."""
        if self._draining.is_set():
            return
        self._draining.set()
        self._latest_end = asyncio.get_running_loop().time() + self._settings.shutdown_grace
        for limit in self._in_flight:
            limit.reschedule(min(limit.when() or self._latest_end, self._latest_end))

    async def run(self, task: Task, deadline: float) -> TaskResult:
        """The task's result, within `deadline` seconds and `settings.deadline_grace`. Time in the queue counts.

        If cancelled, the task leaves the queue, or its worker is killed. Raises what the task raises (see `Task.run`),
        Busy, ShuttingDown, DeadlineExceeded or WorkerDied.
        """
        if self._draining.is_set():
            raise ShuttingDown
        if len(self._in_flight) >= self._capacity:
            raise Busy
        end = asyncio.get_running_loop().time() + deadline
        try:
            async with asyncio.timeout_at(end) as limit:
                self._in_flight.add(limit)
                try:
                    return await self._run_in_worker(task, end, limit)
                finally:
                    self._in_flight.discard(limit)
        except TimeoutError:
            raise (ShuttingDown() if self._draining.is_set() else DeadlineExceeded([])) from None

    async def _run_in_worker(self, task: Task, end: float, limit: asyncio.Timeout) -> TaskResult:
        with self.census.waits():
            worker = await self._idle.get()
            while not worker.alive:
                worker = await self._idle.get()
        # the optimiser watches the deadline and returns its best motion: the grace is for that
        limit.reschedule(min(end + self._settings.deadline_grace, self._latest_end))
        try:
            left = end - asyncio.get_running_loop().time()
            if left <= 0:
                raise DeadlineExceeded([])
            with self.census.works():
                return await worker.ask(task, left)
        finally:
            if worker.alive:
                self._idle.put_nowait(worker)

    async def _keep(self, first: bool) -> None:
        """Keeps one worker alive: starts it, waits for its end, starts the next."""
        if not first:
            # the first worker compiles the kernels, which the others then find in the cache
            await self._first_warm.wait()
        delay = _FIRST_RESTART_DELAY
        while True:
            worker = Worker(self._warm, self._settings.log_level, self._threads)
            try:
                await worker.start()
            except WorkerDied:
                logger.error("worker did not start", extra={"retry_in": delay})
                await asyncio.sleep(delay)
                delay = min(2 * delay, _LONGEST_RESTART_DELAY)
                continue
            delay = _FIRST_RESTART_DELAY
            self._has_warmed(worker)
            await worker.ended.wait()
            self._workers.discard(worker)
            self.census.restarts += 1

    def _has_warmed(self, worker: Worker) -> None:
        self._workers.add(worker)
        self._idle.put_nowait(worker)
        self._first_warm.set()
        logger.info("worker warm", extra={"pid": worker.pid})
        if not self._was_ready and self.warm_workers == self._settings.workers:
            self._was_ready = True
            logger.info("ready", extra={"workers": self.warm_workers})

    def _kill_all(self) -> None:
        for worker in self._workers:
            worker.kill()
