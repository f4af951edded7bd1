"""The dispatcher: two on one database, dying workers, a failing database, a stop.

The tests run the work and move the clock of the leases.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable
from datetime import timedelta
from functools import partial
from pathlib import Path

from joulepath.app.access.client import OPERATOR
from joulepath.app.convert.packed import packed, unpacked
from joulepath.app.engine.listening import Listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.engine.task import Take
from joulepath.app.exceptions.queue import ClusterUnavailable, Preempted, WorkerLost
from joulepath.app.jobs import dispatcher as module
from joulepath.app.jobs.dispatcher import LEASE, Dispatcher
from joulepath.app.jobs.holder import is_gone, new_holder
from joulepath.app.jobs.jobs import Jobs
from joulepath.app.settings import Settings
from joulepath.app.store import jobs
from joulepath.app.store.jobs import NewJob, NewRequest
from joulepath.app.store.store import Store
from joulepath.app.store.tables import JobRequest, now
from joulepath.app.tasks.job_request import JobRequestTask, JobResult
from joulepath.optimizer.progress import no_listener

PATIENCE = 60.0
BODY = packed(b"{}")


def answer(name: str) -> TaskResult:
    return JobResult(
        packed(f'"{name}"'.encode()), "application/json", wall_time=0.1, parts="optimize"
    )


class Work:
    """An executor with work that the test ends."""

    def __init__(self, name: str) -> None:
        self.name, self.slots, self.free = name, 1, asyncio.Event()
        self.begun: list[int] = []
        self.stopped: list[int] = []
        self.stoppable: list[bool] = []
        self.errors: list[Exception] = []
        self.tell: Listener = no_listener
        self.answer: Callable[[JobRequestTask], TaskResult] = lambda task: answer(name)

    async def run(self, take: Take) -> None:
        while (work := take()) is not None:
            assert isinstance(work.task, JobRequestTask)
            index = int(work.task.request_id.rpartition(".")[2])
            self.begun.append(index)
            self.stoppable.append(work.stoppable)
            self.tell = work.tell
            try:
                if self.errors:
                    error = self.errors.pop(0)
                    if isinstance(error, ClusterUnavailable):
                        raise error
                    work.ended(error)
                    continue
                await self.free.wait()
            except asyncio.CancelledError:
                self.stopped.append(index)
                raise
            work.ended(self.answer(work.task))


class Service:
    """A dispatcher with work of its own, on a clock of its own."""

    def __init__(self, name: str, store: Store) -> None:
        settings = Settings()
        self.moved = timedelta(0)
        self.work = Work(name)
        self.dispatcher = Dispatcher(store, self.work, settings, lambda: now() + self.moved)
        self.jobs = Jobs(store, self.dispatcher, settings)


async def until(condition: Callable[[], bool | Awaitable[bool]]) -> None:
    async with asyncio.timeout(PATIENCE):
        while True:
            found = condition()
            if found if isinstance(found, bool) else await found:
                return
            await asyncio.sleep(0.01)


async def sent(
    service: Service, count: int = 1, kind: str = "optimize", owner: str | None = None
) -> str:
    job_id, _ = await service.jobs.create(
        NewJob([NewRequest(kind, BODY, 10.0)] * count, "x"), None, owner
    )
    return job_id


async def requests(store: Store, job_id: str) -> list[JobRequest]:
    return await store.read(partial(jobs.requests, job_id=job_id, limit=1000, after=-1))


async def is_done(service: Service, job_id: str) -> bool:
    return (await service.jobs.view(job_id)).job.ended is not None


async def test_a_second_service_takes_over_and_the_late_answer_is_dropped(store: Store) -> None:
    first, second = Service("first", store), Service("second", store)
    job_id = await sent(first)
    first.dispatcher.start()
    await until(lambda: first.work.begun == [0])
    second.dispatcher.start()
    second.work.free.set()
    # The first dispatcher stands still, so it renews no lease.
    second.moved = LEASE + timedelta(seconds=5)
    await until(lambda: is_done(second, job_id))
    # it notices the loss of the lease by itself
    await until(lambda: first.work.stopped == [0])
    first.work.free.set()
    await first.dispatcher.stop()
    await second.dispatcher.stop()
    (only,) = await requests(store, job_id)
    assert (only.state, only.attempt, first.work.begun, second.work.begun) == (
        "done",
        2,
        [0],
        [0],
    )
    _, body = await store.read(partial(jobs.outcome, job_id=job_id, number=0))
    assert body is not None
    assert unpacked(body) == b'"second"'


async def test_a_long_request_is_not_taken_over(store: Store) -> None:
    first, second = Service("first", store), Service("second", store)
    job_id = await sent(first)
    first.dispatcher.start()
    await until(lambda: first.work.begun == [0])
    second.dispatcher.start()
    for _ in range(3):
        for service in (first, second):
            service.moved += LEASE / 2
        leased = first.dispatcher._now() + LEASE / 2

        async def renewed(at: object = leased) -> bool:
            (only,) = await requests(store, job_id)
            end = only.leased_until
            return end is not None and end >= at  # type: ignore[operator]

        await until(renewed)
    first.work.free.set()
    await until(lambda: is_done(first, job_id))
    assert second.work.begun == []
    await first.dispatcher.stop()
    await second.dispatcher.stop()


async def test_a_clock_set_back_leaves_no_lease_in_the_future(
    store: Store, service: Service
) -> None:
    job_id = await sent(service)
    service.dispatcher.start()
    await until(lambda: service.work.begun == [0])
    service.moved, began = timedelta(hours=-1), now()

    async def renewed() -> bool:
        (only,) = await requests(store, job_id)
        return only.leased_until is not None and only.leased_until < began

    await until(renewed)


async def test_a_request_that_kills_three_workers_fails(store: Store, service: Service) -> None:
    service.work.errors = [WorkerLost(), WorkerLost(), WorkerLost()]
    service.work.free.set()
    job_id = await sent(service)
    service.dispatcher.start()
    await until(lambda: is_done(service, job_id))
    (only,) = await requests(store, job_id)
    assert (only.state, only.attempt, service.work.begun) == ("failed", 3, [0, 0, 0])
    assert only.problem is not None
    assert only.problem["type"] == "/problems/worker-died"
    await service.jobs.retry(job_id, OPERATOR)
    await until(lambda: is_done(service, job_id))
    (only,) = await requests(store, job_id)
    assert (only.state, only.attempt, only.problem) == ("done", 4, None)


async def test_a_caller_may_take_its_worker_twice(store: Store, service: Service) -> None:
    service.work.errors = [Preempted(), Preempted()]
    service.work.free.set()
    job_id = await sent(service)
    service.dispatcher.start()
    await until(lambda: is_done(service, job_id))
    (only,) = await requests(store, job_id)
    assert (only.state, only.attempt) == ("done", 1)
    assert service.work.stoppable == [True, True, False]


async def test_cancelling_stops_what_runs_here_and_elsewhere(store: Store) -> None:
    here, elsewhere = Service("here", store), Service("elsewhere", store)
    job_id = await sent(here, 6)
    here.dispatcher.start()
    await until(lambda: len(here.work.begun) == 1)
    elsewhere.dispatcher.start()
    await until(lambda: len(elsewhere.work.begun) == 1)
    await here.jobs.cancel(job_id, OPERATOR)
    await until(lambda: is_done(here, job_id))
    assert here.work.stopped == here.work.begun
    assert elsewhere.work.stopped == elsewhere.work.begun
    view = await here.jobs.view(job_id)
    assert (view.job.state, view.counts["cancelled"]) == ("cancelled", 6)
    await here.dispatcher.stop()
    await elsewhere.dispatcher.stop()


async def test_deleting_stops_what_runs(service: Service) -> None:
    job_id = await sent(service, 2)
    service.dispatcher.start()
    await until(lambda: service.work.begun == [0])
    await service.jobs.delete(job_id, OPERATOR)
    await until(lambda: service.work.stopped == [0])
    another = await sent(service)
    service.work.free.set()
    await until(lambda: is_done(service, another))


async def test_a_stop_gives_everything_back(store: Store, service: Service) -> None:
    service.work.slots = 2
    job_id = await sent(service, 9)
    service.dispatcher.start()
    await until(lambda: len(service.work.begun) == 2)
    await service.dispatcher.stop()
    assert sorted(service.work.stopped) == sorted(service.work.begun)
    found = await requests(store, job_id)
    assert {(each.state, each.leased_by, each.deaths) for each in found} == {("waiting", None, 0)}


async def test_an_unforeseen_error_ends_no_job(store: Store, service: Service) -> None:
    service.work.errors = [ZeroDivisionError()]
    service.work.free.set()
    job_id = await sent(service, 3)
    service.dispatcher.start()
    await until(lambda: is_done(service, job_id))
    assert [each.state for each in await requests(store, job_id)] == ["failed", "done", "done"]


async def test_outcomes_outlive_a_database_that_fails(
    tmp_path: Path, store: Store, service: Service
) -> None:
    job_id = await sent(service)
    service.dispatcher.start()
    await until(lambda: service.work.begun == [0])
    engine, store._engine = (
        store._engine,
        Store(f"sqlite:///{tmp_path}/no/such/folder.db")._engine,
    )
    service.work.free.set()
    await until(lambda: len(service.dispatcher._outcomes) == 1)
    await asyncio.sleep(2 * module.DISPATCHER.look)
    store._engine = engine
    await until(lambda: is_done(service, job_id))
    assert (await requests(store, job_id))[0].state == "done"


def test_a_holder_is_gone_once_its_process_is() -> None:
    ours = new_holder()
    assert not is_gone(ours)
    *machine, pid, start, own = ours.split()
    assert int(pid) == os.getpid()
    assert is_gone(" ".join([*machine, pid, str(int(start) - 1), own])), (
        "another process had this id"
    )
    assert is_gone(" ".join([*machine, str(2**22 + 1), start, own]))
    assert not is_gone(" ".join(["elsewhere", *machine[1:], pid, "1", own])), "nobody here knows"
