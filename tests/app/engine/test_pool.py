"""The engine by itself: queue, deadlines, cancellation, errors, crashes, shutdown. The tests move
its clock.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import os
import signal
from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from joulepath.app.engine.pool import Engine
from joulepath.app.engine.task import outcome
from joulepath.app.engine.work import result_of
from joulepath.app.exceptions.base import InternalError, InvalidRequest
from joulepath.app.exceptions.queue import Busy, ShuttingDown
from joulepath.app.settings import Settings
from joulepath.optimizer.exceptions import DeadlineExceeded, OutsideLimits
from joulepath.optimizer.progress import Told
from tests.app.engine.simple_tasks import (
    Count,
    Fail,
    Hold,
    ProcessId,
    TimeLeft,
    failing_warm_up,
    no_warm_up,
)
from tests.app.live import alive

# What a busy machine may take for anything below [s]; no test waits for it to pass.
PATIENCE = 120.0
# A deadline, and two graces, that a busy machine does not reach by itself [s]; the tests move the
# clock beyond them.
LONG, DEADLINE_GRACE, SHUTDOWN_GRACE = 1000.0, 300.0, 500.0


class MovableLoop(asyncio.SelectorEventLoop):
    """An event loop whose clock a test moves."""

    moved = 0.0

    def time(self) -> float:
        return super().time() + self.moved


class Bench:
    """An engine under test, and tasks that hold its workers until the test releases them."""

    def __init__(self, engine: Engine, loop: MovableLoop, folder: Path) -> None:
        self.engine, self._loop, self._folder = engine, loop, folder
        self._numbers = itertools.count()

    def move_clock(self, seconds: float) -> None:
        self._loop.moved += seconds

    async def held(self, deadline: float = LONG) -> tuple[asyncio.Task[Any], Path]:
        """A task that runs in a worker; touch the path to let it end."""
        folder = self._folder / str(next(self._numbers))
        folder.mkdir()
        running = asyncio.create_task(self.engine.run(Hold(folder), deadline))
        await until((folder / "started").exists)
        return running, folder / "released"

    async def queued(self, task: Any, deadline: float = LONG) -> asyncio.Task[Any]:
        """A task that waits for a worker."""
        waiting = asyncio.create_task(self.engine.run(task, deadline))
        await asyncio.sleep(0)  # until it waits
        return waiting

    async def pid(self) -> int:
        """Process id of the worker that runs the next task."""
        return int((await self.engine.run(ProcessId(), LONG)).document)


def with_engine(
    folder: Path,
    test: Callable[[Bench], Awaitable[None]],
    warm: Callable[[], None] = no_warm_up,
    **given: Any,
) -> None:
    """Runs a test against an engine, which is ready unless it cannot warm up."""
    graces = {"deadline_grace": DEADLINE_GRACE, "shutdown_grace": SHUTDOWN_GRACE}

    async def run() -> None:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, MovableLoop)
        engine = Engine(Settings(**{"workers": 1, "queue_size": 1, **graces, **given}), warm)
        engine.start()
        try:
            if warm is no_warm_up:
                await until(lambda: engine.ready)
            await test(Bench(engine, loop, folder))
        finally:
            pids = engine.worker_pids
            await engine.stop()
            assert not any(alive(pid) for pid in pids)

    with asyncio.Runner(loop_factory=MovableLoop) as runner:
        runner.run(run())


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(PATIENCE):
        while not condition():
            await asyncio.sleep(0.01)


def test_runs_tasks_in_other_processes(tmp_path: Path) -> None:
    async def test(bench: Bench) -> None:
        (first, release_first), (second, release_second) = await bench.held(), await bench.held()
        release_first.touch()
        release_second.touch()
        pids = {int(result.document) for result in await asyncio.gather(first, second)}
        assert pids == set(bench.engine.worker_pids)
        assert os.getpid() not in pids

    with_engine(tmp_path, test, workers=2)


def test_refuses_what_the_queue_cannot_hold(tmp_path: Path) -> None:
    async def test(bench: Bench) -> None:
        (first, release), second = await bench.held(), await bench.queued(ProcessId())
        with pytest.raises(Busy):
            await bench.pid()
        release.touch()
        assert (await first).document == (await second).document
        await bench.pid()

    with_engine(tmp_path, test)


def test_time_in_the_queue_counts_against_the_deadline(tmp_path: Path) -> None:
    async def test(bench: Bench) -> None:
        running, release = await bench.held()
        waiting = await bench.queued(TimeLeft(), LONG)
        bench.move_clock(0.4 * LONG)
        release.touch()
        await running
        left = float((await waiting).document)
        assert 0.6 * LONG - PATIENCE < left < 0.6 * LONG

    with_engine(tmp_path, test)


def test_a_deadline_that_passes_in_the_queue_spares_the_worker(tmp_path: Path) -> None:
    async def test(bench: Bench) -> None:
        running, release = await bench.held(deadline=2 * LONG)
        waiting = await bench.queued(ProcessId(), LONG)
        bench.move_clock(LONG)
        with pytest.raises(DeadlineExceeded):
            await waiting
        release.touch()
        assert int((await running).document) == bench.engine.worker_pids[0]

    with_engine(tmp_path, test)


def test_a_result_within_the_grace_is_taken(tmp_path: Path) -> None:
    async def test(bench: Bench) -> None:
        running, release = await bench.held(deadline=LONG)
        bench.move_clock(LONG + DEADLINE_GRACE / 2)
        release.touch()
        assert int((await running).document) == bench.engine.worker_pids[0]

    with_engine(tmp_path, test)


def test_kills_a_worker_that_overruns_and_replaces_it(tmp_path: Path) -> None:
    async def test(bench: Bench) -> None:
        (pid,) = bench.engine.worker_pids
        running, _ = await bench.held(deadline=LONG)
        bench.move_clock(LONG + DEADLINE_GRACE)
        with pytest.raises(DeadlineExceeded):
            await running
        assert await bench.pid() != pid
        assert not alive(pid)

    with_engine(tmp_path, test)


def test_cancellation_in_the_queue_spares_the_worker(tmp_path: Path) -> None:
    async def test(bench: Bench) -> None:
        (running, release), waiting = await bench.held(), await bench.queued(ProcessId())
        waiting.cancel()
        release.touch()
        assert int((await running).document) == bench.engine.worker_pids[0]
        await bench.pid()

    with_engine(tmp_path, test)


def test_errors_of_a_task_reach_its_caller_with_their_data(tmp_path: Path) -> None:
    async def test(bench: Bench) -> None:
        pid = await bench.pid()
        limits = OutsideLimits("start", "elbow_joint", 4.0, -3.1, 3.1)
        with pytest.raises(OutsideLimits) as raised:
            await bench.engine.run(Fail(limits), LONG)
        assert (str(raised.value), vars(raised.value)) == (str(limits), vars(limits))
        with pytest.raises(InvalidRequest) as refused:
            await bench.engine.run(Fail(InvalidRequest([{"loc": ["body"], "msg": "No"}])), LONG)
        assert refused.value.errors == [{"loc": ["body"], "msg": "No"}]
        with pytest.raises(InternalError):
            await bench.engine.run(Fail(ZeroDivisionError("caller-secret")), LONG)
        assert await bench.pid() == pid, "an exception does not end the worker"

    with_engine(tmp_path, test)


def test_an_unforeseen_error_is_logged_with_the_requests_id(
    caplog: pytest.LogCaptureFixture,
) -> None:
    failed = outcome(Fail(ZeroDivisionError("caller-secret"), request_id="the-id"), LONG)
    assert isinstance(failed, InternalError)
    assert "caller-secret" not in str(failed)
    (record,) = caplog.records
    assert (record.levelno, vars(record)["request_id"]) == (logging.ERROR, "the-id")
    assert record.exc_info is not None and "caller-secret" in str(record.exc_info[1])


def test_a_worker_killed_while_idle_is_replaced(tmp_path: Path) -> None:
    async def test(bench: Bench) -> None:
        (pid,) = bench.engine.worker_pids
        os.kill(pid, signal.SIGKILL)
        await until(lambda: bench.engine.worker_pids not in ([], [pid]))
        assert await bench.pid() != pid

    with_engine(tmp_path, test)


def test_workers_leave_signals_to_the_parent(tmp_path: Path) -> None:
    async def test(bench: Bench) -> None:
        (pid,) = bench.engine.worker_pids
        running, release = await bench.held()
        for signum in (signal.SIGINT, signal.SIGTERM):
            os.kill(pid, signum)
        release.touch()
        assert int((await running).document) == pid

    with_engine(tmp_path, test)


def test_drain_lets_short_tasks_finish_and_refuses_the_rest(tmp_path: Path) -> None:
    async def test(bench: Bench) -> None:
        (short, release), (long, _) = await bench.held(), await bench.held()
        bench.engine.drain()
        assert not bench.engine.ready
        with pytest.raises(ShuttingDown):
            await bench.pid()
        bench.move_clock(SHUTDOWN_GRACE / 2)
        release.touch()
        assert int((await short).document) in bench.engine.worker_pids
        assert not long.done()
        bench.move_clock(SHUTDOWN_GRACE / 2)
        with pytest.raises(ShuttingDown):
            await long

    with_engine(tmp_path, test, workers=2)


def test_is_not_ready_without_a_warm_worker(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def test(bench: Bench) -> None:
        await until(lambda: "worker did not start" in caplog.messages)
        assert not bench.engine.ready
        waiting = await bench.queued(ProcessId(), LONG)
        bench.move_clock(LONG)
        with pytest.raises(DeadlineExceeded):
            await waiting

    with_engine(tmp_path, test, warm=failing_warm_up)


def test_what_a_task_finds_comes_before_its_result(tmp_path: Path) -> None:
    async def test(bench: Bench) -> None:
        for tells in (bench.engine.run, partial(result_of, bench.engine.spare.run)):
            told: list[Told] = []
            await tells(Count(1000), LONG, tell=told.append)
            assert told == Count(1000).told
        await bench.engine.run(Count(1000), LONG)
        await bench.engine.run(ProcessId(), LONG, tell=told.append)
        assert len(told) == 1000, "nobody is told of a task that nobody listens to"

    with_engine(tmp_path, test)
