"""Clients take turns, have their share, and give back workers. The tests move the clock."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest

from joulepath.app.engine.fair_queue import PATIENCE
from joulepath.app.exceptions.queue import Busy, TooManyRequests
from tests.app.engine.bench import LONG, Bench, settings, until
from tests.app.engine.simple_tasks import Hold, ProcessId


async def held(bench: Bench, folder: Path, client: str) -> tuple[asyncio.Task[Any], Path]:
    """A client's task running in a worker; touch the path to let it end."""
    folder.mkdir()
    running = asyncio.create_task(bench.engine.run(Hold(folder), LONG, client))
    await until((folder / "started").exists)
    return running, folder / "released"


async def waiting(bench: Bench, client: str, name: str, ended: list[str]) -> asyncio.Task[Any]:
    """A client's waiting task; at its end, it adds its name to the list."""

    async def run() -> None:
        await bench.engine.run(ProcessId(), LONG, client)
        ended.append(name)

    task = asyncio.create_task(run())
    await asyncio.sleep(0)
    return task


@settings(queue_size=10)
async def test_clients_are_served_in_turn(tmp_path: Path, bench: Bench) -> None:
    ended: list[str] = []
    running, release = await held(bench, tmp_path / "a", "a")
    tasks = [await waiting(bench, "a", f"a{k}", ended) for k in range(3)]
    tasks += [await waiting(bench, "b", f"b{k}", ended) for k in range(2)]
    tasks.append(await waiting(bench, "c", "c0", ended))
    release.touch()
    await asyncio.gather(running, *tasks)
    assert ended == ["a0", "b0", "c0", "a1", "b1", "a2"]


@settings(workers=2, queue_size=10)
async def test_a_client_without_a_worker_comes_before_one_that_has_some(
    tmp_path: Path, bench: Bench
) -> None:
    ended: list[str] = []
    first, release_first = await held(bench, tmp_path / "first", "a")
    second, release_second = await held(bench, tmp_path / "second", "b")
    tasks = [await waiting(bench, "a", "a0", ended), await waiting(bench, "c", "c0", ended)]
    release_second.touch()
    await asyncio.gather(second, *tasks)
    assert ended == ["c0", "a0"]
    release_first.touch()
    await first


@settings(queue_size=3, client_requests=2)
async def test_one_client_has_its_share_of_the_queue(tmp_path: Path, bench: Bench) -> None:
    ended: list[str] = []
    running, release = await held(bench, tmp_path / "a", "a")
    tasks = [await waiting(bench, "a", "a0", ended)]
    with pytest.raises(TooManyRequests):
        await bench.engine.run(ProcessId(), LONG, "a")
    tasks += [await waiting(bench, "b", f"b{k}", ended) for k in range(2)]
    with pytest.raises(Busy) as refused:
        await bench.engine.run(ProcessId(), LONG, "c")
    assert not isinstance(refused.value, TooManyRequests)
    release.touch()
    await asyncio.gather(running, *tasks)
    await bench.engine.run(ProcessId(), LONG, "a")


@settings(workers=2, queue_size=10)
async def test_a_client_with_several_workers_gives_one_back(tmp_path: Path, bench: Bench) -> None:
    ended: list[str] = []
    first, release_first = await held(bench, tmp_path / "first", "a")
    second, release_second = await held(bench, tmp_path / "second", "a")
    newcomer = await waiting(bench, "b", "b0", ended)
    await asyncio.sleep(0.05)
    assert not ended
    (tmp_path / "second" / "started").unlink()
    bench.move_clock(PATIENCE)
    await newcomer
    # The task begun last begins again beside the first, since no other one waits.
    await until((tmp_path / "second" / "started").exists)
    assert not first.done()
    release_first.touch()
    release_second.touch()
    await asyncio.gather(first, second)


@settings(workers=2, queue_size=10)
async def test_nobody_gives_a_worker_back_twice_or_the_only_one(
    tmp_path: Path, bench: Bench
) -> None:
    ended: list[str] = []
    first, release_first = await held(bench, tmp_path / "first", "a")
    second, release_second = await held(bench, tmp_path / "second", "a")
    newcomers = [await waiting(bench, "b", "b0", ended), await waiting(bench, "c", "c0", ended)]
    pids = set(bench.engine.worker_pids)
    bench.move_clock(PATIENCE)
    await asyncio.gather(*newcomers)
    assert len(pids & set(bench.engine.worker_pids)) == 1, "one worker was enough for both"
    release_first.touch()
    release_second.touch()
    await asyncio.gather(first, second)
