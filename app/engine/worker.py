"""One worker process: it is started, warms up, runs one task at a time, and is killed to stop it.

Each worker has a pipe of its own and shares no lock with the others. It can therefore be killed at any moment, and its
end, whatever the cause, shows as the end of its pipe.
"""

from __future__ import annotations

import asyncio
import logging
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from multiprocessing.connection import Connection, wait
from typing import TypeVar

from app.engine.forkserver import CONTEXT
from app.engine.listening import listening
from app.engine.result import TaskResult
from app.engine.task import Task, outcome
from app.engine.work import Ended, Take, Work
from app.exceptions import WorkerDied
from app.logs import configure_logging
from optimizer.progress import Event, Tell, nobody

logger = logging.getLogger(__name__)

T = TypeVar("T")
Heard = Callable[[Event], object] | None
"""What gets the events of a task in a thread; None if nobody listens."""
Turn = Callable[[Work, Ended, Work | None], object]
"""Told of a work that has ended, of what became of it, and of the next one."""


class Worker:
    """The parent's side of a worker process."""

    def __init__(self, warm: Callable[[], None], log_level: str, threads: Executor) -> None:
        self._pipe, self._child_pipe = CONTEXT.Pipe()
        self._process = CONTEXT.Process(
            target=_serve, args=(self._child_pipe, warm, log_level), name="joulepath-worker", daemon=True
        )
        self._threads = threads
        self._killed = False
        self.ended = asyncio.Event()

    @property
    def pid(self) -> int | None:
        """Process id; None before the start."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether it can run a task."""
        return not (self._killed or self.ended.is_set())

    async def start(self) -> None:
        """Starts the process and waits until it is warm. Raises WorkerDied."""
        await self._in_thread(self._start)
        asyncio.get_running_loop().add_reader(self._process.sentinel, self._has_ended)

    async def ask(self, task: Task, deadline: float, tell: Tell = nobody) -> TaskResult:
        """The task's result. If cancelled, it kills the worker, because nothing else stops a computation.

        `tell` gets what the task finds, before the result. Raises what the task raises (see `Task.run`), or WorkerDied.
        """
        heard = _heard(tell, asyncio.get_running_loop())
        ended = await self._in_thread(partial(self._exchange, task, deadline, heard))
        if isinstance(ended, Exception):
            raise ended
        return ended

    async def ask_all(self, first: Work, take: Take, turn: Turn) -> None:
        """Runs works one after another, until there is none. If cancelled, it kills the worker. Raises WorkerDied.

        Each gets to the process as soon as the last one has ended: the event loop, which calls `turn`, may be late.
        """
        loop = asyncio.get_running_loop()
        await self._in_thread(partial(self._exchange_all, first, take, turn, loop))

    def kill(self) -> None:
        """Ends the process at once. Does nothing if it has ended."""
        self._killed = True
        if self._process.pid is not None:
            self._process.kill()

    async def _in_thread(self, call: Callable[[], T]) -> T:
        """The result of a call that waits for the process. If cancelled, kills the worker. Raises WorkerDied."""
        try:
            return await asyncio.get_running_loop().run_in_executor(self._threads, call)
        except (EOFError, OSError):
            self.kill()
            raise WorkerDied from None
        except asyncio.CancelledError:
            self.kill()
            raise

    def _start(self) -> None:
        self._process.start()
        if self._killed:  # during the start, when `kill` found no process yet
            self._process.kill()
        self._child_pipe.close()
        self._pipe.recv()

    def _exchange(self, task: Task, deadline: float, heard: Heard) -> Ended:
        self._pipe.send((task, deadline, heard is not None))
        return self._receive(heard)

    def _receive(self, heard: Heard) -> Ended:
        received: Event | Ended = self._pipe.recv()
        while isinstance(received, Event):
            if heard is not None:
                heard(received)
            received = self._pipe.recv()
        return received

    def _exchange_all(self, first: Work, take: Take, turn: Turn, loop: asyncio.AbstractEventLoop) -> None:
        self._send(first)
        work: Work | None = first
        while work is not None:
            # after a short one, the next one is there already
            following = take() if work.is_short else None
            is_sent = following is not None and following.is_short
            if following is not None and is_sent:
                self._send(following)
            ended = self._receive(_heard(work.tell, loop))
            last, work = work, following or take()
            # before the next one is sent: if the process dies of it, this one has ended
            loop.call_soon_threadsafe(turn, last, ended, work)
            if work is not None and not is_sent:
                self._send(work)

    def _send(self, work: Work) -> None:
        self._pipe.send((work.task, work.deadline, work.tell is not nobody))

    def _has_ended(self) -> None:
        asyncio.get_running_loop().remove_reader(self._process.sentinel)
        self._process.join()
        if not self._killed:
            logger.error("worker ended by itself", extra={"pid": self.pid, "exit_code": self._process.exitcode})
        self.ended.set()


def _heard(tell: Tell, loop: asyncio.AbstractEventLoop) -> Heard:
    return None if tell is nobody else lambda event: loop.call_soon_threadsafe(tell, event)


def _serve(pipe: Connection, warm: Callable[[], None], log_level: str) -> None:
    """The worker process."""
    # Ctrl-C in a terminal and SIGTERM from a service manager reach the whole process group. Only the parent acts on
    # them: it lets requests in flight finish, and then kills its workers
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    configure_logging(log_level)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        warm()
    except Exception:
        logger.exception("warm-up failed")
        sys.exit(1)
    pipe.send("warm")
    while True:
        try:
            task, deadline, is_heard = pipe.recv()
        except EOFError:
            return
        with listening(pipe.send if is_heard else nobody):
            ended = outcome(task, deadline)
        pipe.send(ended)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)
