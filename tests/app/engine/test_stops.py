"""Abandoned tasks end by themselves; their workers stay warm and answer only their own request."""

from __future__ import annotations

import asyncio
import os
import random
import signal
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from joulepath import DeadlineExceeded, JoulepathError, ServiceError
from joulepath.app.engine.fair_queue import PATIENCE
from joulepath.app.engine.task import result_of
from joulepath.app.exceptions.queue import Preempted, ShuttingDown, WorkerLost
from tests.app.engine.bench import (
    DEADLINE_GRACE,
    LONG,
    SHUTDOWN_GRACE,
    Bench,
    settings,
    until,
)
from tests.app.engine.simple_tasks import Die, DieOnce, EndEarly, Hold, HoldWatching, ProcessId

# No busy machine delays a cooperating worker until it is killed [s].
NEVER_KILLED = 200.0


async def begun(
    bench: Bench, task: Any, deadline: float = LONG, client: str = ""
) -> asyncio.Task[Any]:
    """A task with a folder, running in a worker."""
    task.folder.mkdir()
    running = asyncio.create_task(bench.engine.run(task, deadline, client))
    await until((task.folder / "started").exists)
    return running


@pytest.mark.parametrize("kind", [HoldWatching, EndEarly])
@settings(stop_grace=NEVER_KILLED)
async def test_leaving_spares_the_worker(tmp_path: Path, kind: Any, bench: Bench) -> None:
    (pid,) = bench.engine.worker_pids
    running = await begun(bench, kind(tmp_path / "held"))
    running.cancel()
    assert await bench.pid() == pid, "and the answer is that to the second task"


@settings(stop_grace=NEVER_KILLED)
async def test_a_deadline_that_is_overrun_spares_the_worker(tmp_path: Path, bench: Bench) -> None:
    (pid,) = bench.engine.worker_pids
    running = await begun(bench, HoldWatching(tmp_path / "held"))
    bench.move_clock(LONG + DEADLINE_GRACE)
    with pytest.raises(DeadlineExceeded):
        await running
    assert await bench.pid() == pid


@settings(stop_grace=NEVER_KILLED)
async def test_a_task_that_does_not_look_is_killed_after_the_grace(
    tmp_path: Path, bench: Bench
) -> None:
    (pid,) = bench.engine.worker_pids
    running = await begun(bench, Hold(tmp_path / "held"))
    running.cancel()
    waiting = await bench.queued(ProcessId())
    await asyncio.sleep(0.05)
    assert bench.engine.worker_pids == [pid] and not waiting.done(), "it has some time"
    bench.move_clock(NEVER_KILLED)
    assert int((await waiting).document) != pid


@settings(stop_grace=NEVER_KILLED, queue_size=4)
async def test_a_stop_ends_no_following_task(bench: Bench) -> None:
    """Stops arrive around the end of a task, with the next task right behind them."""
    (pid,) = bench.engine.worker_pids
    rng = random.Random(0)
    for _ in range(200):
        running = asyncio.create_task(bench.engine.run(ProcessId(), LONG))
        # some stops come before the task is sent, some after its answer
        for _ in range(rng.randrange(8)):
            await asyncio.sleep(0)
        await asyncio.sleep(rng.choice([0.0, 0.0003, 0.001]))
        running.cancel()
        assert await bench.pid() == pid
        await asyncio.gather(running, return_exceptions=True)


@pytest.mark.parametrize("kind", [HoldWatching, EndEarly])
@settings(workers=2, queue_size=10, stop_grace=NEVER_KILLED)
async def test_who_gives_a_worker_back_gets_no_part_of_an_answer(
    tmp_path: Path, kind: Any, bench: Bench
) -> None:
    pids = set(bench.engine.worker_pids)
    first = await begun(bench, HoldWatching(tmp_path / "first"), client="a")
    second = await begun(bench, kind(tmp_path / "second"), client="a")
    newcomer = asyncio.create_task(bench.engine.run(ProcessId(), LONG, "b"))
    await asyncio.sleep(0)
    (tmp_path / "second" / "started").unlink()
    bench.move_clock(PATIENCE)
    assert int((await newcomer).document) in pids, "no worker was killed"
    assert set(bench.engine.worker_pids) == pids
    (tmp_path / "first" / "released").touch()
    await first
    await until((tmp_path / "second" / "started").exists)
    assert not second.done()
    if kind is EndEarly:
        second.cancel()
    else:
        (tmp_path / "second" / "released").touch()
        assert int((await second).document) in pids


@settings(stop_grace=NEVER_KILLED)
async def test_spare_work_gives_its_worker_back_warm(tmp_path: Path, bench: Bench) -> None:
    (pid,) = bench.engine.worker_pids
    tmp_path.joinpath("spare").mkdir()
    spare = asyncio.create_task(
        result_of(bench.engine.spare.run, HoldWatching(tmp_path / "spare"), LONG)
    )
    await until((tmp_path / "spare" / "started").exists)
    caller = await bench.queued(ProcessId())
    bench.move_clock(PATIENCE)
    with pytest.raises(Preempted):
        await spare
    assert int((await caller).document) == pid
    spare = asyncio.create_task(
        result_of(bench.engine.spare.run, HoldWatching(tmp_path / "spare"), LONG)
    )
    spare.cancel()
    await asyncio.gather(spare, return_exceptions=True)
    assert await bench.pid() == pid


async def test_a_task_whose_worker_dies_begins_again_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, bench: Bench
) -> None:
    assert (
        int((await bench.engine.run(DieOnce(tmp_path), LONG)).document) in bench.engine.worker_pids
    )
    deaths = tmp_path / "deaths"
    deaths.mkdir()
    with pytest.raises(WorkerLost):
        await bench.engine.run(Die(deaths), LONG)
    assert len(list(deaths.iterdir())) == 2, "it kills no third one"
    await bench.pid()
    causes = [
        vars(each)["exit_code"]
        for each in caplog.records
        if each.message == "worker ended by itself"
    ]
    assert causes == [-signal.SIGKILL, -signal.SIGABRT, -signal.SIGABRT]


async def test_the_second_attempt_is_within_the_deadline(bench: Bench) -> None:
    running, _ = await bench.held(deadline=LONG)
    (pid,) = bench.engine.worker_pids
    bench.move_clock(0.9 * LONG)
    os.kill(pid, signal.SIGKILL)
    await until(lambda: bench.engine.worker_pids not in ([], [pid]))
    bench.move_clock(0.1 * LONG + DEADLINE_GRACE)
    with pytest.raises(DeadlineExceeded):
        await running


async def test_a_service_is_not_ready_while_requests_wait_and_none_runs(bench: Bench) -> None:
    running, release = await bench.held()
    waiting = await bench.queued(ProcessId())
    assert bench.engine.ready, "one is at work"
    # Simulates a defect: the worker is alive, but no request holds it.
    (worker,) = bench.engine._workers
    del bench.engine.queue._loans[worker]
    assert not bench.engine.ready
    release.touch()
    await running
    assert not waiting.done() and not bench.engine.ready
    bench.engine.queue.put(worker)
    assert int((await waiting).document) == bench.engine.worker_pids[0]
    assert bench.engine.ready


@settings(queue_size=5)
async def test_shutdown_while_requests_wait(tmp_path: Path, bench: Bench) -> None:
    running = await begun(bench, HoldWatching(tmp_path / "held"))
    waiting = [await bench.queued(ProcessId()) for _ in range(3)]
    bench.engine.drain()
    (pid,) = bench.engine.worker_pids
    os.kill(pid, signal.SIGKILL)
    bench.move_clock(SHUTDOWN_GRACE)
    for each in (running, *waiting):
        with pytest.raises(ShuttingDown):
            await each


@pytest.mark.parametrize("turns", range(4))
@settings(queue_size=5)
async def test_shutdown_in_the_turn_of_a_deadline(tmp_path: Path, turns: int, bench: Bench) -> None:
    running = await begun(bench, HoldWatching(tmp_path / "held"))
    waiting = await bench.queued(ProcessId(), deadline=1.0)
    others = await bench.queued(ProcessId())
    bench.move_clock(1.0)
    for _ in range(turns):
        await asyncio.sleep(0)
    bench.engine.drain()
    with pytest.raises((DeadlineExceeded, ShuttingDown)):
        await waiting
    bench.move_clock(SHUTDOWN_GRACE)
    for each in (running, others):
        with pytest.raises(ShuttingDown):
            await each


@settings(workers=2, queue_size=200, client_requests=100)
async def test_workers_killed_at_random_beside_everything(tmp_path: Path, bench: Bench) -> None:
    """Requests end, leave and time out beside jobs, while workers are killed at random."""
    rng = random.Random(1)
    engine = bench.engine

    async def request(index: int) -> int:
        folder = tmp_path / f"request {index}"
        folder.mkdir()
        task = rng.choice([ProcessId(), HoldWatching(folder), DieOnce(folder)])
        running = asyncio.create_task(
            engine.run(task, rng.choice([0.05, 0.3, LONG]), rng.choice("abc"))
        )
        if isinstance(task, HoldWatching):
            await asyncio.sleep(rng.uniform(0.0, 0.05))
            running.cancel()
        try:
            return int((await running).document)
        except (JoulepathError, ServiceError, asyncio.CancelledError):
            return 0

    async def job(index: int) -> None:
        while True:
            try:
                await result_of(engine.spare.run, ProcessId(), LONG)
            except (Preempted, WorkerLost):
                continue
            await asyncio.sleep(0.001)

    async def kill() -> None:
        while True:
            await asyncio.sleep(0.05)
            if engine.worker_pids:
                with suppress(ProcessLookupError):  # of one that has just ended
                    os.kill(rng.choice(engine.worker_pids), signal.SIGKILL)

    others = [asyncio.create_task(each) for each in (job(0), job(1), kill())]
    found = await asyncio.gather(*(request(index) for index in range(120)))
    for each in others:
        each.cancel()
    results = await asyncio.gather(*others, return_exceptions=True)
    assert all(isinstance(each, asyncio.CancelledError) for each in results), results
    assert any(found)
    await until(lambda: engine.warm_workers == 2)
    assert set(engine.queue._loans) == engine._workers
    await until(lambda: all(loan is None for loan in engine.queue._loans.values()))
    assert (engine.queue.waiting, engine.queue.busy) == ([], 0)
    assert not engine.queue.someone_waits and not engine.queue._places
    assert await bench.pid() in engine.worker_pids
