"""A cluster in this process: results, errors, progress, cancelled work, machines and schedulers that go."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from distributed import Scheduler, Worker

from app.cluster.link import Cluster
from app.engine.task import Task
from app.exceptions import ClusterUnavailable, TaskFailed, WorkerDied
from optimizer.exceptions import OutsideLimits
from optimizer.progress import CandidatesFound, Event
from tests.app.engine.simple_tasks import Count, Die, Fail, Hold, ProcessId
from tests.app.live import alive

PATIENCE = 120.0
"""What a busy machine may take for anything below [s]; no test waits for it to pass."""
LONG = 1000.0


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(PATIENCE):
        while not condition():
            await asyncio.sleep(0.01)


def machine(scheduler: Scheduler, workers: int = 1) -> Worker:
    return Worker(scheduler.address, nthreads=workers, memory_limit=0, preload=["app.cluster"], dashboard=False)


def with_cluster(test: Callable[[Cluster, Scheduler], Awaitable[None]], monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs a test against a cluster of one machine with one worker, which is not warm for any robot."""
    monkeypatch.setenv("JOULEPATH_ROBOTS", "")

    async def run() -> None:
        async with Scheduler(host="127.0.0.1", port=0, dashboard=False) as scheduler, machine(scheduler):
            cluster = Cluster(scheduler.address)
            cluster.start()
            try:
                await until(lambda: cluster.slots == 1)
                await test(cluster, scheduler)
            finally:
                await cluster.stop()

    asyncio.run(run())


def start(cluster: Cluster, task: Task) -> asyncio.Task[int]:
    """A task whose result is the id of the process that computes it."""

    async def process() -> int:
        return int((await cluster.run(task, LONG)).document)

    return asyncio.create_task(process())


def hold(folder: Path) -> Hold:
    folder.mkdir(exist_ok=True)
    return Hold(folder)


def test_results_errors_and_what_is_found_come_back(monkeypatch: pytest.MonkeyPatch) -> None:
    async def test(cluster: Cluster, _: Scheduler) -> None:
        told: list[Event] = []
        first = int((await cluster.run(Count(100), LONG, told.append)).document)
        await until(lambda: len(told) == 100)
        assert told == [CandidatesFound(number) for number in range(100)]
        assert first == await start(cluster, ProcessId()), "the same warm process"
        limits = OutsideLimits("start", 1, 9.0, -1.0, 1.0)
        with pytest.raises(OutsideLimits) as raised:
            await cluster.run(Fail(limits), LONG)
        assert vars(raised.value) == vars(limits)
        with pytest.raises(TaskFailed):
            await cluster.run(Fail(ZeroDivisionError("caller-secret")), LONG)
        with pytest.raises(WorkerDied):
            await cluster.run(Die(), LONG)
        assert first != await start(cluster, ProcessId()), "another one in its place"

    with_cluster(test, monkeypatch)


def test_a_cancel_kills_what_runs_and_what_waits_never_begins(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Dask itself lets a task that runs go on to its end."""

    async def test(cluster: Cluster, _: Scheduler) -> None:
        process = await start(cluster, ProcessId())
        running = start(cluster, hold(tmp_path / "runs"))
        await until((tmp_path / "runs" / "started").exists)
        waiting = start(cluster, hold(tmp_path / "waits"))
        await asyncio.sleep(0)
        waiting.cancel()
        running.cancel()
        await until(lambda: not alive(process))
        assert await start(cluster, ProcessId()) != process
        assert not (tmp_path / "waits" / "started").exists()

    with_cluster(test, monkeypatch)


def test_what_a_service_leaves_behind_is_stopped(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    async def test(cluster: Cluster, scheduler: Scheduler) -> None:
        other = Cluster(scheduler.address)
        other.start()
        await until(lambda: other.slots == 1)
        process = await start(cluster, ProcessId())
        orphan = start(other, hold(tmp_path / "orphan"))
        await until((tmp_path / "orphan" / "started").exists)
        assert other._keeper is not None
        other._keeper.cancel()  # its connection ends, as that of a service that is killed
        await until(lambda: not alive(process))
        with pytest.raises(ClusterUnavailable):
            await orphan
        await other.stop()

    with_cluster(test, monkeypatch)


def test_work_of_a_machine_that_stops_is_done_elsewhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    async def test(cluster: Cluster, scheduler: Scheduler) -> None:
        process = await start(cluster, ProcessId())
        running = start(cluster, hold(tmp_path / "runs"))
        await until((tmp_path / "runs" / "started").exists)
        async with machine(scheduler, workers=2):
            await until(lambda: cluster.slots == 3)
            (tmp_path / "runs" / "started").unlink()
            first = next(address for address, count in cluster.workers.items() if count == 1)
            scheduler.close_worker(first)
            await until((tmp_path / "runs" / "started").exists)
            (tmp_path / "runs" / "released").touch()
            assert await running != process
            assert not alive(process)
            await until(lambda: cluster.slots == 2)

    with_cluster(test, monkeypatch)


def test_a_scheduler_that_goes_and_comes_back(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    async def test(cluster: Cluster, scheduler: Scheduler) -> None:
        running = start(cluster, hold(tmp_path / "runs"))
        await until((tmp_path / "runs" / "started").exists)
        port = scheduler.port
        await scheduler.close()
        with pytest.raises(ClusterUnavailable):
            await running
        await until(lambda: cluster.slots == 0)
        with pytest.raises(ClusterUnavailable):
            await cluster.run(ProcessId(), LONG)
        with pytest.raises(ClusterUnavailable):
            assert cluster.workers
        async with Scheduler(host="127.0.0.1", port=port, dashboard=False) as again, machine(again):
            await until(lambda: cluster.slots == 1)
            await start(cluster, ProcessId())

    with_cluster(test, monkeypatch)


def test_workers_of_others_get_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    async def test(cluster: Cluster, scheduler: Scheduler) -> None:
        async with Worker(scheduler.address, nthreads=4, dashboard=False):
            await asyncio.gather(*(start(cluster, ProcessId()) for _ in range(6)))
            assert list(cluster.workers.values()) == [1]

    with_cluster(test, monkeypatch)
