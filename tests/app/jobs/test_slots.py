"""The dispatcher and its executor: progress within requests, and a changing number of slots."""

from __future__ import annotations

import json
import math
from datetime import timedelta
from functools import partial
from typing import Any

import pytest

from joulepath.app.convert.packed import packed
from joulepath.app.convert.recorded import GivenLog
from joulepath.app.engine.task import Ended, Take, Work, taking
from joulepath.app.exceptions.base import InternalError
from joulepath.app.exceptions.queue import ClusterUnavailable
from joulepath.app.jobs.executor import Executor
from joulepath.app.store import job_events, logs
from joulepath.app.store.store import Store
from joulepath.app.store.tables import StoredLog, new_id, now
from joulepath.app.tasks.job_request import IDENTIFY, JobRequestTask
from joulepath.optimizer.progress import (
    CandidatesFound,
    CandidateTried,
    Event,
    Improved,
    StepsDone,
    no_listener,
)
from tests.app.jobs.test_dispatcher import Service, is_done, requests, sent, until

TRIED = {"solved": 1, "share": None}
"""Progress within a request that has tried one candidate."""


async def test_progress_within_a_long_request_is_an_event(store: Store, service: Service) -> None:
    job_id = await sent(service, kind="cycle")

    async def reports() -> list[dict[str, Any]]:
        found, _ = await store.read(partial(job_events.after, job_id=job_id, number=0, limit=100))
        told = [each.data["requests"] for each in found if each.name == "progress"]
        return [only for each in told for only in each]

    async def tells(report: dict[str, Any], *events: Event) -> None:
        for event in events:
            service.work.tell(event)
        service.moved += timedelta(seconds=1)
        await until(lambda: is_told(report))

    async def is_told(report: dict[str, Any]) -> bool:
        return report in await reports()

    service.dispatcher.start()
    await until(lambda: service.work.begun == [0])
    first = {"index": 0, "attempt": 1, "found": None, "bound": None, **TRIED}
    await tells(first, CandidatesFound(3), CandidateTried(1, "solved", 1.0, 9.0))
    best = {"index": 0, "attempt": 1, "found": 9.0, "bound": None, **TRIED}
    await tells(
        best,
        Improved(9.0, bound=-math.inf),
        Improved(9.5),
        CandidateTried(1, "solved", 1.0, 8.0),
    )
    await tells(best | {"found": 7.0, "bound": 5.0}, Improved(7.0, bound=5.0))
    service.work.free.set()
    await until(lambda: is_done(service, job_id))
    found = await reports()
    assert len(found) == 3, "what is no news is no event, and the end has none"


async def test_time_left_of_an_identification(store: Store, service: Service) -> None:
    """The time left follows from the fits; before the end of the first fit, there is none."""
    job_id = await sent(service, kind=IDENTIFY)

    async def told() -> list[tuple[float | None, float | None]]:
        found, _ = await store.read(partial(job_events.after, job_id=job_id, number=0, limit=100))
        data = [each.data for each in found if each.name == "progress"]
        return [(each["requests"][0]["share"], each["eta"]) for each in data if each["requests"]]

    async def tells(done: float, count: int) -> None:
        service.work.tell(StepsDone(done, 4.0, "fits"))
        service.moved += timedelta(seconds=10)
        await until(lambda: has(count))

    async def has(count: int) -> bool:
        return len(await told()) == count

    service.dispatcher.start()
    await until(lambda: service.work.begun == [0])
    await tells(0.0, 1)
    await tells(1.0, 2)
    await tells(3.0, 3)
    shares, left = zip(*await told(), strict=True)
    assert shares == (0.0, 0.25, 0.75)
    assert left[0] is None
    # 20 s and 30 s after the start, a fourth and three fourths are done
    assert left[1:] == (pytest.approx(60, rel=0.1), pytest.approx(10, rel=0.1))
    service.work.free.set()
    await until(lambda: is_done(service, job_id))


async def test_jobs_wait_until_there_is_a_slot(store: Store, service: Service) -> None:
    """An unreachable cluster has no slots, and machines come and go."""
    service.work.slots = 0
    job_id = await sent(service, 3)
    service.dispatcher.start()
    exchanged = service.dispatcher._exchange
    cycles = 0

    async def counted() -> None:
        nonlocal cycles
        await exchanged()
        cycles += 1

    service.dispatcher._exchange = counted  # type: ignore[method-assign]
    service.dispatcher.wake()
    await until(lambda: cycles >= 2)
    assert [each.state for each in await requests(store, job_id)] == ["waiting"] * 3
    service.work.slots = 3
    service.work.errors = [ClusterUnavailable()]
    await until(lambda: len(service.work.begun) == 4)
    service.work.free.set()
    await until(lambda: is_done(service, job_id))
    states = [(each.state, each.problem) for each in await requests(store, job_id)]
    assert states == [("done", None)] * 3, "a lost cluster is no failure"


async def test_nobody_listens_to_short_requests(service: Service) -> None:
    await sent(service)
    service.dispatcher.start()
    await until(lambda: service.work.begun == [0])
    assert service.work.tell is no_listener


class Workers:
    """A substitute for the cluster, or for the workers of this service."""

    def __init__(self) -> None:
        self.tasks: list[Any] = []

    async def run(self, take: Take) -> None:
        while (work := take()) is not None:
            self.tasks.append(work.task)
            work.ended(InternalError())


async def test_an_identification_gets_its_logs(store: Store) -> None:
    log = StoredLog(
        id=new_id(),
        robot="ur5e",
        created=now(),
        size=3,
        settings={"robot": "ur5e"},
        report={},
        body=b"log",
    )
    await store.write(partial(logs.add, log=log, most=100))
    body = packed(json.dumps({"logs": [log.id]}).encode())
    workers = Workers()
    ended: list[Ended] = []
    others = [
        Work(JobRequestTask(kind, body, "job.0"), 1.0, ended.append)
        for kind in (IDENTIFY, "optimize")
    ]
    await Executor(workers.run, store, lambda: 1).run(taking(*others))
    assert [task.logs for task in workers.tasks] == [
        (),
        (GivenLog(log.id, {"robot": "ur5e"}, b"log"),),
    ]
    assert [type(each) for each in ended] == [InternalError, InternalError]
