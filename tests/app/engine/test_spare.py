"""Spare work comes after callers and gives its worker to a waiting one. The tests move
the clock.
"""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest

from joulepath.app.engine.result import TaskResult
from joulepath.app.engine.spare import PATIENCE
from joulepath.app.engine.task import Ended, Work, result_of, taking
from joulepath.app.exceptions.queue import Preempted, WorkerLost
from joulepath.optimizer.exceptions import DeadlineExceeded, OutsideLimits
from tests.app.engine.bench import DEADLINE_GRACE, LONG, Bench, settings, until
from tests.app.engine.simple_tasks import Die, Fail, Hold, ProcessId


async def spare(bench: Bench, folder: Path, **options: Any) -> tuple[asyncio.Task[Any], Path]:
    """Spare work running in a worker; touch the path to let it end."""
    folder.mkdir()
    running = asyncio.create_task(result_of(bench.engine.spare.run, Hold(folder), LONG, **options))
    await until((folder / "started").exists)
    return running, folder / "released"


@settings(queue_size=2)
async def test_it_waits_while_a_caller_waits(bench: Bench) -> None:
    first, release = await bench.held()
    later = asyncio.create_task(result_of(bench.engine.spare.run, ProcessId(), LONG))
    second = await bench.queued(ProcessId())
    order: list[str] = []
    later.add_done_callback(lambda _: order.append("later"))
    second.add_done_callback(lambda _: order.append("second"))
    release.touch()
    await asyncio.gather(first, second, later)
    assert order == ["second", "later"], "it came first and yet was run last"


async def test_a_caller_that_waits_takes_its_worker(tmp_path: Path, bench: Bench) -> None:
    running, _ = await spare(bench, tmp_path / "spare")
    (pid,) = bench.engine.worker_pids
    caller = await bench.queued(ProcessId())
    await asyncio.sleep(0.05)
    assert not running.done(), "it has some time"
    bench.move_clock(PATIENCE)
    with pytest.raises(Preempted):
        await running
    assert int((await caller).document) != pid


async def test_what_is_not_stoppable_is_left_to_end(tmp_path: Path, bench: Bench) -> None:
    running, release = await spare(bench, tmp_path / "spare", stoppable=False)
    caller = await bench.queued(ProcessId())
    bench.move_clock(10 * PATIENCE)
    await asyncio.sleep(0.05)
    assert not running.done()
    release.touch()
    assert (await running).document == (await caller).document


@settings(workers=2)
async def test_a_caller_that_waits_for_callers_takes_nothing(tmp_path: Path, bench: Bench) -> None:
    running, release = await spare(bench, tmp_path / "spare")
    held, release_held = await bench.held()
    caller = await bench.queued(ProcessId())
    bench.move_clock(10 * PATIENCE)
    await asyncio.sleep(0.05)
    assert not running.done(), "work that can wait has one of two workers only"
    release.touch()
    release_held.touch()
    await asyncio.gather(running, held, caller)


async def test_cancelling_kills_its_worker(tmp_path: Path, bench: Bench) -> None:
    running, _ = await spare(bench, tmp_path / "spare")
    (pid,) = bench.engine.worker_pids
    running.cancel()
    with pytest.raises(asyncio.CancelledError):
        await running
    assert await bench.pid() != pid


async def test_its_deadline_counts_from_its_start(tmp_path: Path, bench: Bench) -> None:
    first, release = await bench.held()
    later = asyncio.create_task(result_of(bench.engine.spare.run, ProcessId(), 1.0))
    await asyncio.sleep(0)
    bench.move_clock(LONG / 2)
    release.touch()
    assert (await later).document == (await first).document
    running, _ = await spare(bench, tmp_path / "spare")
    bench.move_clock(LONG + DEADLINE_GRACE)
    with pytest.raises(DeadlineExceeded):
        await running


@pytest.mark.parametrize("is_short", [False, True])
async def test_one_after_another_on_one_worker(is_short: bool, bench: Bench) -> None:
    """A task's error ends only this task; a worker's death leaves the rest. Short tasks
    go ahead.
    """
    ended: list[Ended] = []
    tasks = [
        ProcessId(),
        Fail(OutsideLimits("start", 1, 9.0, -1.0, 1.0)),
        ProcessId(),
        Die(),
        ProcessId(),
    ]
    works = [Work(task, LONG, ended.append, expected=0.0, is_small=is_short) for task in tasks]
    await bench.engine.spare.run(taking(*works))
    first, limits, second, died = ended
    assert isinstance(limits, OutsideLimits) and isinstance(died, WorkerLost)
    assert isinstance(first, TaskResult) and first == second
    await bench.engine.spare.run(taking(works[4]))
    assert isinstance(ended[4], TaskResult) and ended[4] != first


async def test_it_takes_nothing_more_while_a_caller_waits(tmp_path: Path, bench: Bench) -> None:
    ended: list[Ended] = []
    tmp_path.joinpath("held").mkdir()
    take = taking(
        *(Work(task, LONG, ended.append) for task in (Hold(tmp_path / "held"), ProcessId()))
    )
    running = asyncio.create_task(bench.engine.spare.run(take))
    await until((tmp_path / "held" / "started").exists)
    caller = await bench.queued(ProcessId())
    (tmp_path / "held" / "released").touch()
    await running
    assert len(ended) == 1, "the caller comes first"
    assert (await caller) == ended[0]
    await bench.engine.spare.run(take)
    assert len(ended) == 2


async def test_each_has_its_own_deadline(tmp_path: Path, bench: Bench) -> None:
    ended: list[Ended] = []
    folders = [tmp_path / name for name in ("first", "second")]
    for folder in folders:
        folder.mkdir()
    works = [Work(Hold(folder), LONG, ended.append) for folder in folders]
    running = asyncio.create_task(bench.engine.spare.run(taking(*works)))
    await until((folders[0] / "started").exists)
    bench.move_clock(LONG)
    (folders[0] / "released").touch()
    await until((folders[1] / "started").exists)
    await until(lambda: len(ended) == 1)
    bench.move_clock(LONG)
    await asyncio.sleep(0.05)
    assert not running.done(), "the grace is left"
    bench.move_clock(DEADLINE_GRACE)
    await running
    assert isinstance(ended[1], DeadlineExceeded)
