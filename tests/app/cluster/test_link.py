"""A cluster in this process: results, errors, progress, cancellation, lost machines."""

from __future__ import annotations

import asyncio
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from distributed import Scheduler, Worker

from joulepath.app.cluster import link
from joulepath.app.cluster import machine as app_machine
from joulepath.app.cluster.link import LINK, Cluster
from joulepath.app.cluster.machine import RESOURCES
from joulepath.app.engine.result import TaskResult
from joulepath.app.engine.task import Ended, Task, Work, result_of, taking
from joulepath.app.exceptions.base import InternalError
from joulepath.app.exceptions.queue import ClusterUnavailable, WorkerLost
from joulepath.optimizer.exceptions import OutsideLimits
from joulepath.optimizer.progress import Told
from tests.app.engine.bench import LONG, until
from tests.app.engine.simple_tasks import Count, Die, Fail, Hold, ProcessId
from tests.app.live import ROOT, alive, free_port


def machine(scheduler: str, workers: int = 1) -> Worker:
    return Worker(
        scheduler,
        nthreads=workers,
        memory_limit=0,
        preload=["joulepath.app.cluster"],
        dashboard=False,
    )


@asynccontextmanager
async def linked(address: str) -> AsyncIterator[Cluster]:
    """A link to a scheduler."""
    cluster = Cluster(address)
    cluster.start()
    try:
        yield cluster
    finally:
        await cluster.stop()


@pytest.fixture
async def scheduler(monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Scheduler]:
    """A scheduler with one machine of one worker, warm for no robot."""
    monkeypatch.setenv("JOULEPATH_ROBOTS", "")
    async with (
        Scheduler(host="127.0.0.1", port=0, dashboard=False) as scheduler,
        machine(scheduler.address),
    ):
        yield scheduler


@pytest.fixture
async def cluster(scheduler: Scheduler) -> AsyncIterator[Cluster]:
    """A link to the scheduler and its machine."""
    async with linked(scheduler.address) as cluster:
        await until(lambda: cluster.slots == LINK.per_process)
        yield cluster


def start(cluster: Cluster, task: Task) -> asyncio.Task[int]:
    """A task with the id of its process as the result."""

    async def process() -> int:
        return int((await result_of(cluster.run, task, LONG)).document)

    return asyncio.create_task(process())


def hold(folder: Path) -> Hold:
    folder.mkdir(exist_ok=True)
    return Hold(folder)


async def test_results_errors_and_what_is_found_come_back(cluster: Cluster) -> None:
    told: list[Told] = []
    first = int((await result_of(cluster.run, Count(100), LONG, tell=told.append)).document)
    await until(lambda: len(told) == 100)
    assert told == Count(100).told
    assert first == await start(cluster, ProcessId()), "the same warm process"
    limits = OutsideLimits("start", 1, 9.0, -1.0, 1.0)
    with pytest.raises(OutsideLimits) as raised:
        await result_of(cluster.run, Fail(limits), LONG)
    assert vars(raised.value) == vars(limits)
    with pytest.raises(InternalError):
        await result_of(cluster.run, Fail(ZeroDivisionError("caller-secret")), LONG)
    with pytest.raises(WorkerLost):
        await result_of(cluster.run, Die(), LONG)
    assert first != await start(cluster, ProcessId()), "another one in its place"


async def test_a_cancel_kills_what_runs_and_what_waits_never_begins(
    tmp_path: Path, cluster: Cluster
) -> None:
    """Dask itself lets a running task go on to its end."""
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


async def test_what_a_service_leaves_behind_is_stopped(
    tmp_path: Path, cluster: Cluster, scheduler: Scheduler
) -> None:
    other = Cluster(scheduler.address)
    other.start()
    await until(lambda: other.slots == LINK.per_process)
    process = await start(cluster, ProcessId())
    orphan = start(other, hold(tmp_path / "orphan"))
    await until((tmp_path / "orphan" / "started").exists)
    assert other._keeper is not None
    other._keeper.cancel()  # its connection ends, as that of a service that is killed
    await until(lambda: not alive(process))
    with pytest.raises(ClusterUnavailable):
        await orphan
    await other.stop()


async def test_work_of_a_machine_that_stops_is_done_elsewhere(
    tmp_path: Path, cluster: Cluster, scheduler: Scheduler
) -> None:
    process = await start(cluster, ProcessId())
    running = start(cluster, hold(tmp_path / "runs"))
    await until((tmp_path / "runs" / "started").exists)
    async with machine(scheduler.address, workers=2):
        await until(lambda: cluster.slots == 3 * LINK.per_process)
        (tmp_path / "runs" / "started").unlink()
        first = next(address for address, count in cluster.workers.items() if count == 1)
        scheduler.close_worker(first)
        await until((tmp_path / "runs" / "started").exists)
        (tmp_path / "runs" / "released").touch()
        assert await running != process
        await until(lambda: not alive(process))
        await until(lambda: cluster.slots == 2 * LINK.per_process)


async def test_a_scheduler_that_goes_and_comes_back(
    tmp_path: Path, cluster: Cluster, scheduler: Scheduler
) -> None:
    running = start(cluster, hold(tmp_path / "runs"))
    await until((tmp_path / "runs" / "started").exists)
    port = scheduler.port
    await scheduler.close()
    with pytest.raises(ClusterUnavailable):
        await running
    await until(lambda: cluster.slots == 0)
    with pytest.raises(ClusterUnavailable):
        await result_of(cluster.run, ProcessId(), LONG)
    with pytest.raises(ClusterUnavailable):
        assert cluster.workers
    async with (
        Scheduler(host="127.0.0.1", port=port, dashboard=False) as again,
        machine(again.address),
    ):
        await until(lambda: cluster.slots == LINK.per_process)
        await start(cluster, ProcessId())


async def test_workers_of_others_get_nothing(cluster: Cluster, scheduler: Scheduler) -> None:
    async with Worker(scheduler.address, nthreads=4, dashboard=False):
        await asyncio.gather(*(start(cluster, ProcessId()) for _ in range(6)))
        assert list(cluster.workers.values()) == [1]


def short(task: Task, ended: list[Ended]) -> Work:
    return Work(task, LONG, ended.append, expected=0.01)


async def test_short_works_go_together(cluster: Cluster, scheduler: Scheduler) -> None:
    """Short works are one task of Dask; a work that dies leaves the others unharmed.

    Progress of each work reaches its own listener.
    """
    ended, told = list[Ended](), list[Told]()
    works = [short(task, ended) for task in (ProcessId(), Count(3), Die(), ProcessId())]
    works[1].tell = told.append
    before = len(scheduler.tasks)
    running = asyncio.create_task(cluster.run(taking(*works)))
    await until(lambda: len(scheduler.tasks) > before or running.done())
    assert len(scheduler.tasks) <= before + 1, "one task of Dask"
    await running
    first, counted, died, last = ended
    assert isinstance(died, WorkerLost)
    assert isinstance(first, TaskResult) and isinstance(last, TaskResult)
    assert counted == first != last
    await until(lambda: len(told) == 3)


async def test_those_whose_machine_died_are_tried_one_by_one(
    tmp_path: Path, cluster: Cluster, scheduler: Scheduler
) -> None:
    """One of the works may be the cause of the machine's death."""
    scheduler.allowed_failures = 0
    ended = list[Ended]()
    (first,) = cluster.workers
    running = asyncio.create_task(
        cluster.run(taking(short(hold(tmp_path), ended), short(ProcessId(), ended)))
    )
    await until((tmp_path / "started").exists)
    async with machine(scheduler.address):
        (tmp_path / "started").unlink()
        scheduler.close_worker(first)
        await until((tmp_path / "started").exists)
        (tmp_path / "released").touch()
        await running
        assert [type(each) for each in ended] == [TaskResult] * 2


@contextmanager
def scheduler_process(
    folder: Path, **environment: str
) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """A scheduler in its own process, and its address.

    The scheduler has the version of the package in `folder`, or no package if the folder has none.
    """
    if not (folder / "joulepath").exists() and "PYTHONPATH" not in environment:
        # hides the installed package
        (folder / "joulepath.py").write_text("raise ImportError('there is none')\n")
    port = free_port()
    command = [
        "-m",
        "distributed.cli.dask_scheduler",
        "--host",
        "127.0.0.1",
        "--port",
        str(port),
        "--no-dashboard",
    ]
    others = os.environ | {"PYTHONPATH": str(folder)} | environment
    with (folder / "scheduler.log").open("ab") as log:
        process = subprocess.Popen(
            [sys.executable, *command], cwd=folder, env=others, stdout=log, stderr=log
        )
    try:
        yield process, f"tcp://127.0.0.1:{port}"
    finally:
        process.kill()
        process.wait()


async def refused_by(cluster: Cluster, caplog: pytest.LogCaptureFixture, reason: str) -> None:
    """Waits for the log's reason why the cluster is refused, and checks its single occurrence.

    A busy machine may need several attempts to reach the scheduler.
    """

    def told() -> list[str]:
        records = [
            record for record in caplog.records if record.name == "joulepath.app.cluster.link"
        ]
        return [vars(record)["reason"] for record in records if "cannot be used" in record.message]

    await until(lambda: any(reason in each for each in told()))
    await asyncio.sleep(3 * LINK.look)
    assert len([each for each in told() if reason in each]) == 1
    assert cluster.slots == 0
    with pytest.raises(ClusterUnavailable):
        assert cluster.workers
    with pytest.raises(ClusterUnavailable):
        await result_of(cluster.run, ProcessId(), LONG)


def other_version(folder: Path) -> None:
    """A copy of this package with one character more."""
    copy = folder / "joulepath"
    shutil.copytree(
        ROOT / "joulepath", copy, ignore=shutil.ignore_patterns("static", "__pycache__")
    )
    with (copy / "optimizer" / "deadline.py").open("a", encoding="utf-8") as file:
        file.write("#")


@pytest.mark.parametrize(
    ("there", "reason"),
    [
        ("nothing", "cannot import this package"),
        pytest.param("another", "has another version", marks=pytest.mark.long),
    ],
)
async def test_a_scheduler_without_this_version_gets_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, there: str, reason: str
) -> None:
    """A scheduler reads the tasks it passes on, so another version would fail every request."""
    if there == "another":
        other_version(tmp_path)
    with scheduler_process(tmp_path) as (_, address):
        async with linked(address) as cluster:
            await refused_by(cluster, caplog, reason)


async def test_a_machine_of_another_version_gets_nothing(
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    cluster: Cluster,
    scheduler: Scheduler,
) -> None:
    monkeypatch.setattr(app_machine, "resource", lambda: f"{RESOURCES}another")
    async with machine(scheduler.address, workers=4) as other:
        await until(lambda: len(scheduler.workers) == 2)
        monkeypatch.undo()
        await until(lambda: any("another version" in record.message for record in caplog.records))
        assert cluster.slots == LINK.per_process
        pids = await asyncio.gather(*(start(cluster, ProcessId()) for _ in range(6)))
        assert len(set(pids)) == 1
        assert other.address not in cluster.workers
    await asyncio.sleep(3 * LINK.look)
    (record,) = (record for record in caplog.records if "another version" in record.message)
    assert vars(record)["machines"] == [other.address]


@pytest.mark.long
async def test_a_scheduler_that_hangs_and_goes_on(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The connections of the stopped scheduler stay open without any messages."""
    monkeypatch.setattr(link, "LINK", replace(link.LINK, patience=1.0))
    monkeypatch.setenv("JOULEPATH_ROBOTS", "")
    with scheduler_process(tmp_path, PYTHONPATH=str(ROOT)) as (process, address):
        async with linked(address) as cluster, machine(address):
            await until(lambda: cluster.slots == LINK.per_process)
            running = start(cluster, hold(tmp_path / "runs"))
            await until((tmp_path / "runs" / "started").exists)
            process.send_signal(signal.SIGSTOP)
            await until(lambda: cluster.slots == 0)
            with pytest.raises(ClusterUnavailable):
                await running
            with pytest.raises(ClusterUnavailable):
                await result_of(cluster.run, ProcessId(), LONG)
            process.send_signal(signal.SIGCONT)
            await until(lambda: cluster.slots == LINK.per_process)
            await start(cluster, ProcessId())
