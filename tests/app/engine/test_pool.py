"""The engine by itself: queue, deadlines, cancellation, errors, crashes, shutdown. The tests move
its clock.
"""

from __future__ import annotations

import asyncio
import logging
import os
import signal
from functools import partial

import pytest

from joulepath.app.engine.pool import POOL
from joulepath.app.engine.task import outcome, result_of
from joulepath.app.exceptions.base import InternalError, InvalidRequest
from joulepath.app.exceptions.queue import Busy, ShuttingDown
from joulepath.optimizer.exceptions import DeadlineExceeded, OutsideLimits
from joulepath.optimizer.progress import Told
from tests.app.engine.bench import (
    DEADLINE_GRACE,
    LONG,
    PATIENCE,
    SHUTDOWN_GRACE,
    Bench,
    settings,
    until,
)
from tests.app.engine.simple_tasks import (
    Count,
    Fail,
    ProcessId,
    TimeLeft,
    failing_warm_up,
    frozen_warm_up,
)
from tests.app.live import alive


@settings(workers=2)
async def test_runs_tasks_in_other_processes(bench: Bench) -> None:
    (first, release_first), (second, release_second) = await bench.held(), await bench.held()
    release_first.touch()
    release_second.touch()
    pids = {int(result.document) for result in await asyncio.gather(first, second)}
    assert pids == set(bench.engine.worker_pids)
    assert os.getpid() not in pids


async def test_refuses_what_the_queue_cannot_hold(bench: Bench) -> None:
    (first, release), second = await bench.held(), await bench.queued(ProcessId())
    with pytest.raises(Busy):
        await bench.pid()
    release.touch()
    assert (await first).document == (await second).document
    await bench.pid()


async def test_time_in_the_queue_counts_against_the_deadline(bench: Bench) -> None:
    running, release = await bench.held()
    waiting = await bench.queued(TimeLeft(), LONG)
    bench.move_clock(0.4 * LONG)
    release.touch()
    await running
    left = float((await waiting).document)
    assert 0.6 * LONG - PATIENCE < left < 0.6 * LONG


async def test_a_deadline_that_passes_in_the_queue_spares_the_worker(bench: Bench) -> None:
    running, release = await bench.held(deadline=2 * LONG)
    waiting = await bench.queued(ProcessId(), LONG)
    bench.move_clock(LONG)
    with pytest.raises(DeadlineExceeded):
        await waiting
    release.touch()
    assert int((await running).document) == bench.engine.worker_pids[0]


async def test_a_result_within_the_grace_is_taken(bench: Bench) -> None:
    running, release = await bench.held(deadline=LONG)
    bench.move_clock(LONG + DEADLINE_GRACE / 2)
    release.touch()
    assert int((await running).document) == bench.engine.worker_pids[0]


async def test_kills_a_worker_that_overruns_and_replaces_it(bench: Bench) -> None:
    (pid,) = bench.engine.worker_pids
    running, _ = await bench.held(deadline=LONG)
    bench.move_clock(LONG + DEADLINE_GRACE)
    with pytest.raises(DeadlineExceeded):
        await running
    assert await bench.pid() != pid
    assert not alive(pid)


async def test_errors_of_a_task_reach_its_caller_with_their_data(bench: Bench) -> None:
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


def test_an_unforeseen_error_is_logged_with_the_requests_id(
    caplog: pytest.LogCaptureFixture,
) -> None:
    failed = outcome(Fail(ZeroDivisionError("caller-secret"), request_id="the-id"), LONG)
    assert isinstance(failed, InternalError)
    assert "caller-secret" not in str(failed)
    (record,) = caplog.records
    assert (record.levelno, vars(record)["request_id"]) == (logging.ERROR, "the-id")
    assert record.exc_info is not None and "caller-secret" in str(record.exc_info[1])


async def test_a_worker_killed_while_idle_is_replaced(bench: Bench) -> None:
    (pid,) = bench.engine.worker_pids
    os.kill(pid, signal.SIGKILL)
    await until(lambda: bench.engine.worker_pids not in ([], [pid]))
    assert await bench.pid() != pid


async def test_workers_leave_signals_to_the_parent(bench: Bench) -> None:
    (pid,) = bench.engine.worker_pids
    running, release = await bench.held()
    for signum in (signal.SIGINT, signal.SIGTERM):
        os.kill(pid, signum)
    release.touch()
    assert int((await running).document) == pid


@settings(workers=2)
async def test_drain_lets_short_tasks_finish_and_refuses_the_rest(bench: Bench) -> None:
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


@settings(warm=failing_warm_up)
async def test_is_not_ready_without_a_warm_worker(
    caplog: pytest.LogCaptureFixture, bench: Bench
) -> None:
    await until(lambda: "worker did not start" in caplog.messages)
    assert not bench.engine.ready
    waiting = await bench.queued(ProcessId(), LONG)
    bench.move_clock(LONG)
    with pytest.raises(DeadlineExceeded):
        await waiting


@settings(warm=frozen_warm_up)
async def test_a_worker_that_freezes_in_its_warm_up_is_given_up(
    caplog: pytest.LogCaptureFixture, bench: Bench
) -> None:
    await asyncio.sleep(0)  # until the end of its start is awaited
    bench.move_clock(POOL.longest_warm_up)
    await until(lambda: "worker did not start" in caplog.messages)


async def test_what_a_task_finds_comes_before_its_result(bench: Bench) -> None:
    for tells in (bench.engine.run, partial(result_of, bench.engine.spare.run)):
        told: list[Told] = []
        await tells(Count(1000), LONG, tell=told.append)
        assert told == Count(1000).told
    await bench.engine.run(Count(1000), LONG)
    await bench.engine.run(ProcessId(), LONG, tell=told.append)
    assert len(told) == 1000, "nobody is told of a task that nobody listens to"
