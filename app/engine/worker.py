"""A worker process: it starts, warms up, and runs one task at a time.

It is asked to end an unwanted task, and killed if it does not comply. Every worker has its own pipe
and shares no lock with others. It can therefore be killed at any moment, and its end, whatever the
cause, is noticed as the end of the pipe.
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
from typing import Any, TypeVar

from joulepath.app.engine.forkserver import CONTEXT
from joulepath.app.engine.listening import Listener, listening
from joulepath.app.engine.result import TaskResult
from joulepath.app.engine.task import Ended, Take, Task, Work, outcome
from joulepath.app.exceptions.queue import Preempted, WorkerLost
from joulepath.app.logs import configure_logging
from joulepath.optimizer.deadline import Stopped, stoppable
from joulepath.optimizer.progress import Told, no_listener

logger = logging.getLogger(__name__)

T = TypeVar("T")
Heard = Callable[[Told], object] | None
"""Receiver of a task's events, called in a thread; None without a listener."""
Turn = Callable[[Work, Ended, Work | None], object]
"""Function called with an ended work, its outcome, and the next work."""


class Worker:
    """The parent's side of a worker process.

    Exchanges with the process are numbered. To stop an exchange, its number is written into shared
    memory. The process compares it with its own number at every `checkpoint`, and ends exchanges up
    to this number, so that a late request to stop cannot end another task. `stop_grace` [s] is the
    time for the process to end the task.
    """

    def __init__(
        self, warm: Callable[[], None], log_level: str, threads: Executor, stop_grace: float
    ) -> None:
        self._pipe, self._child_pipe = CONTEXT.Pipe()
        # One aligned word is read and written atomically, without a lock that a killed process
        # could hold.
        self._stopped_up_to = CONTEXT.RawValue("Q", 0)
        self._process = CONTEXT.Process(
            target=_serve,
            args=(self._child_pipe, self._stopped_up_to, warm, log_level),
            name="joulepath-worker",
            daemon=True,
        )
        self._threads, self._stop_grace = threads, stop_grace
        self._number = 0
        self._exchange: asyncio.Future[Any] | None = None
        self._killed, self._lost = False, False
        self.ended = asyncio.Event()

    @property
    def pid(self) -> int | None:
        """Process id; None before the start."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether it can run a task, now or after the running one."""
        return not (self._killed or self._lost or self.ended.is_set())

    @property
    def is_free(self) -> bool:
        """Whether it is at no task."""
        return self._exchange is None or self._exchange.done()

    def when_free(self, call: Callable[[], object]) -> None:
        """Calls once it is at no task, at once or later."""
        if self._exchange is None or self._exchange.done():
            call()
        else:
            self._exchange.add_done_callback(lambda _: call())

    async def start(self) -> None:
        """Starts the process and waits until it is warm. If cancelled, it kills it. Raises
        WorkerLost.
        """
        loop = asyncio.get_running_loop()
        try:
            await loop.run_in_executor(self._threads, self._start)
            loop.add_reader(self._process.sentinel, self._has_ended)
        except BaseException as error:
            self.kill()
            if isinstance(error, EOFError | OSError):
                raise WorkerLost from None
            raise

    async def ask(self, task: Task, deadline: float, tell: Listener = no_listener) -> TaskResult:
        """The task's result. If cancelled, the task is stopped.

        Args:
            task: the task.
            deadline: its time [s].
            tell: receives events before the result.

        Raises:
            JoulepathError: the error of the task (see `Task.run`).
            Preempted: the task was stopped.
            WorkerLost: the process has ended.
        """
        heard = _heard(tell, asyncio.get_running_loop())
        ended = await self._exchanged(lambda number: self._ask(number, task, deadline, heard))
        if isinstance(ended, Exception):
            raise ended
        return ended

    async def ask_all(self, first: Work, take: Take, turn: Turn) -> None:
        """Runs works one after another until `take` returns none. Raises Preempted or WorkerLost.

        A thread sends the next work as soon as the previous one has ended, without waiting for the
        event loop, which calls `turn`. If cancelled, the running work is stopped.
        """
        loop = asyncio.get_running_loop()
        await self._exchanged(lambda number: self._ask_all(number, first, take, turn, loop))

    def stop(self) -> None:
        """Stops the running task, and kills the process after the grace. Returns at once."""
        exchange = self._exchange
        if exchange is None or exchange.done() or self._is_stopped(self._number):
            return
        self._stopped_up_to.value = self._number
        patience = asyncio.get_running_loop().call_later(self._stop_grace, self._kill_in, exchange)
        exchange.add_done_callback(lambda _: patience.cancel())

    def kill(self) -> None:
        """Ends the process at once. Does nothing if it has ended."""
        self._killed = True
        if self._process.pid is not None:
            self._process.kill()

    def _kill_in(self, exchange: asyncio.Future[Any]) -> None:
        if not exchange.done():
            logger.info("killed, because its task did not end in time", extra={"pid": self.pid})
            self.kill()

    async def _exchanged(self, call: Callable[[int], T]) -> T:
        """The result of an exchange with the process, in a thread. Raises WorkerLost, or Preempted
        if it was stopped.

        The exchange goes on after a cancellation until the process has ended the task: see
        `when_free`.
        """
        assert self.is_free, "the answer to another task would be taken for that to this one"
        self._number += 1
        number = self._number
        exchange = asyncio.get_running_loop().run_in_executor(
            self._threads, self._in_step, call, number
        )
        # whoever asked may have left by then
        exchange.add_done_callback(lambda done: done.cancelled() or done.exception())
        self._exchange = exchange
        try:
            return await asyncio.shield(exchange)
        except (EOFError, OSError):
            raise (Preempted() if self._is_stopped(number) else WorkerLost()) from None
        except asyncio.CancelledError:
            self.stop()
            raise

    def _in_step(self, call: Callable[[int], T], number: int) -> T:
        try:
            return call(number)
        except Preempted:
            raise
        except BaseException:
            # The process has ended, or it may still compute an unwanted answer.
            self._lost = True
            self._process.kill()
            raise

    def _is_stopped(self, number: int) -> bool:
        return _is_stopped(self._stopped_up_to, number)

    def _start(self) -> None:
        self._process.start()
        if self._killed:  # during the start, when `kill` found no process yet
            self._process.kill()
        self._child_pipe.close()
        self._pipe.recv()

    def _ask(self, number: int, task: Task, deadline: float, heard: Heard) -> Ended:
        self._pipe.send((number, task, deadline, heard is not None))
        return self._receive(number, heard)

    def _receive(self, number: int, heard: Heard) -> Ended:
        """Outcome of the running task. Raises Preempted if it was stopped."""
        while isinstance(received := self._pipe.recv(), Told):
            if heard is not None and not self._is_stopped(number):
                heard(received)
        if isinstance(received, Stopped):
            raise Preempted
        ended: Ended = received
        return ended

    def _ask_all(
        self, number: int, first: Work, take: Take, turn: Turn, loop: asyncio.AbstractEventLoop
    ) -> None:
        self._send(number, first)
        work: Work | None = first
        while work is not None:
            # after a short one, the next one is there already
            following = take() if work.is_short and not self._is_stopped(number) else None
            is_sent = following is not None and following.is_short
            if following is not None and is_sent:
                self._send(number, following)
            try:
                ended = self._receive(number, _heard(work.tell, loop))
            except Preempted:
                if is_sent:  # it is stopped, too, and said so
                    self._pipe.recv()
                raise
            last, work = work, following or (None if self._is_stopped(number) else take())
            # before the next one is sent: if the process dies of it, this one has ended
            loop.call_soon_threadsafe(turn, last, ended, work)
            if work is not None and not is_sent:
                self._send(number, work)

    def _send(self, number: int, work: Work) -> None:
        self._pipe.send((number, work.task, work.deadline, work.tell is not no_listener))

    def _has_ended(self) -> None:
        asyncio.get_running_loop().remove_reader(self._process.sentinel)
        self._process.join()
        if not self._killed:
            logger.error(
                "worker ended by itself",
                extra={"pid": self.pid, "exit_code": self._process.exitcode},
            )
        self.ended.set()


def _heard(tell: Listener, loop: asyncio.AbstractEventLoop) -> Heard:
    return None if tell is no_listener else lambda event: loop.call_soon_threadsafe(tell, event)


def _serve(pipe: Connection, stopped_up_to: Any, warm: Callable[[], None], log_level: str) -> None:
    """The worker process. It ends tasks of exchanges up to the number `stopped_up_to` at their next
    checkpoint.
    """
    # Ctrl-C in a terminal and SIGTERM from a service manager reach the whole process group. Only
    # the parent reacts: it lets running requests finish and then kills its workers.
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
            number, task, deadline, is_heard = pipe.recv()
        except EOFError:
            return
        with (
            listening(pipe.send if is_heard else no_listener),
            stoppable(partial(_is_stopped, stopped_up_to, number)),
        ):
            ended = outcome(task, deadline)
        pipe.send(ended)


def _is_stopped(stopped_up_to: Any, number: int) -> bool:
    return bool(stopped_up_to.value >= number)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)
