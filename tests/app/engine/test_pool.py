"""The engine by itself: queue, deadlines, cancellation, crashes, shutdown."""

from __future__ import annotations

import asyncio
import os
import signal
import time
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from app.engine.pool import Engine
from app.exceptions import Busy, ShuttingDown, WorkerDied
from app.settings import Settings
from optimizer.exceptions import DeadlineExceeded
from tests.app.live import alive
from tests.app.simple_tasks import Die, Sleep, TellDeadline, failing_warm_up, no_warm_up

# what a machine that is busy with other things may add to any time below [s]
PATIENCE = 10.0


def with_engine(test: Callable[[Engine], Awaitable[None]], warm: Callable[[], None] = no_warm_up, **given: Any) -> None:
    """Runs a test against an engine, which is ready unless it cannot warm up."""

    async def run() -> None:
        engine = Engine(Settings(**{"workers": 1, "queue_size": 1, **given}), warm)
        engine.start()
        try:
            if warm is no_warm_up:
                await until(lambda: engine.ready)
            await test(engine)
        finally:
            pids = engine.worker_pids
            await engine.stop()
            assert not any(alive(pid) for pid in pids)

    asyncio.run(run())


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(PATIENCE):
        while not condition():
            await asyncio.sleep(0.01)


async def is_running(engine: Engine, task: Any, deadline: float = 60) -> asyncio.Task[Any]:
    """A task that is being run, or waits."""
    running = asyncio.create_task(engine.run(task, deadline))
    await asyncio.sleep(0.2)
    assert not running.done()
    return running


def test_runs_tasks_in_other_processes() -> None:
    async def test(engine: Engine) -> None:
        replies = await asyncio.gather(*(engine.run(Sleep(0.3), 60) for _ in range(2)))
        pids = {int(reply.body) for reply in replies}
        assert pids == set(engine.worker_pids)
        assert os.getpid() not in pids

    with_engine(test, workers=2)


def test_refuses_what_the_queue_cannot_hold() -> None:
    async def test(engine: Engine) -> None:
        first, second = await is_running(engine, Sleep(1)), await is_running(engine, Sleep(0))
        with pytest.raises(Busy):
            await engine.run(Sleep(0), 60)
        assert (await first).body == (await second).body
        await engine.run(Sleep(0), 60)

    with_engine(test)


def test_waiting_counts_against_the_deadline() -> None:
    async def test(engine: Engine) -> None:
        await is_running(engine, Sleep(0.6))
        reply = await engine.run(TellDeadline(), 5)
        assert 5 - PATIENCE < float(reply.body) < 4.9

    with_engine(test)


def test_a_deadline_that_passes_in_the_queue_spares_the_worker() -> None:
    async def test(engine: Engine) -> None:
        running = await is_running(engine, Sleep(1))
        with pytest.raises(DeadlineExceeded):
            await engine.run(Sleep(0), 0.1)
        assert int((await running).body) == engine.worker_pids[0]

    with_engine(test)


def test_kills_a_worker_that_overruns_and_replaces_it() -> None:
    async def test(engine: Engine) -> None:
        (pid,) = engine.worker_pids
        began = time.monotonic()
        with pytest.raises(DeadlineExceeded):
            await engine.run(Sleep(60), 0.1)
        assert time.monotonic() - began < PATIENCE
        reply = await engine.run(Sleep(0), 60)
        assert int(reply.body) != pid
        assert not alive(pid)

    with_engine(test, deadline_grace=0.2)


def test_cancellation_kills_the_worker_and_frees_its_place() -> None:
    async def test(engine: Engine) -> None:
        (pid,) = engine.worker_pids
        running, waiting = await is_running(engine, Sleep(60)), await is_running(engine, Sleep(0))
        running.cancel()
        assert int((await waiting).body) != pid
        assert not alive(pid)

    with_engine(test)


def test_cancellation_in_the_queue_spares_the_worker() -> None:
    async def test(engine: Engine) -> None:
        running, waiting = await is_running(engine, Sleep(0.8)), await is_running(engine, Sleep(0))
        waiting.cancel()
        assert int((await running).body) == engine.worker_pids[0]
        await engine.run(Sleep(0), 60)

    with_engine(test)


def test_a_crash_fails_one_task_only() -> None:
    async def test(engine: Engine) -> None:
        with pytest.raises(WorkerDied):
            await engine.run(Die(), 60)
        assert (await engine.run(Sleep(0), 60)).status == 200

    with_engine(test)


def test_a_worker_killed_while_idle_is_replaced() -> None:
    async def test(engine: Engine) -> None:
        (pid,) = engine.worker_pids
        os.kill(pid, signal.SIGKILL)
        await until(lambda: engine.worker_pids not in ([], [pid]))
        assert int((await engine.run(Sleep(0), 60)).body) != pid

    with_engine(test)


def test_workers_leave_signals_to_the_parent() -> None:
    async def test(engine: Engine) -> None:
        (pid,) = engine.worker_pids
        running = await is_running(engine, Sleep(0.8))
        for signum in (signal.SIGINT, signal.SIGTERM):
            os.kill(pid, signum)
        assert int((await running).body) == pid

    with_engine(test)


def test_drain_lets_short_tasks_finish_and_refuses_the_rest() -> None:
    async def test(engine: Engine) -> None:
        short, long = await is_running(engine, Sleep(0.6)), await is_running(engine, Sleep(60))
        engine.drain()
        assert not engine.ready
        with pytest.raises(ShuttingDown):
            await engine.run(Sleep(0), 60)
        assert (await short).status == 200
        with pytest.raises(ShuttingDown):
            await asyncio.wait_for(long, PATIENCE)

    with_engine(test, workers=2, shutdown_grace=1.5)


def test_is_not_ready_without_a_warm_worker() -> None:
    async def test(engine: Engine) -> None:
        await asyncio.sleep(0.5)
        assert not engine.ready
        with pytest.raises(DeadlineExceeded):
            await engine.run(Sleep(0), 0.1)

    with_engine(test, warm=failing_warm_up)
