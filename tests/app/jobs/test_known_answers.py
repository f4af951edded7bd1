"""Requests of jobs that are equal to answered ones get copies of their answers."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import Any

import orjson
import pytest

from joulepath.app.access.client import OPERATOR
from joulepath.app.answers.envelope import AnswerFigures
from joulepath.app.convert.packed import packed, unpacked
from joulepath.app.engine.result import TaskResult
from joulepath.app.store import jobs
from joulepath.app.store.cache import Meaning
from joulepath.app.store.jobs import NewJob, NewRequest
from joulepath.app.store.store import Store
from joulepath.app.store.tables import JobRequest
from joulepath.app.tasks.job_request import JobRequestTask, JobResult
from joulepath.app.tasks.request_key import VERSION
from tests.app.jobs.test_dispatcher import BODY, Service, is_done, requests, until

TURN = 0.3
"""Longer than a dispatcher takes to look for a new request [s]."""


def computed(task: JobRequestTask, status: str = "optimal") -> TaskResult:
    figures = AnswerFigures("ur5e", 5.0, 1.0, status)
    result = TaskResult.of_kept_json(
        {"request": task.request_id, "id": None, "by": task.request_id, "answer": None}, figures
    )
    document = packed(result.document)
    return JobResult(
        document,
        result.media_type,
        (),
        result.kept_as,
        figures,
        result.is_optimal,
        wall_time=0.1,
        parts="optimize",
    )


def asks(
    digest: str = "a", deadline: float = 10.0, kind: str = "optimize", version: str = VERSION
) -> NewRequest:
    return NewRequest(kind, BODY, deadline, Meaning(version=version, digest=digest, robot="ur5e"))


@pytest.fixture
def service(service: Service) -> Service:
    service.work.answer = computed
    return service


async def send(service: Service, *asked: NewRequest, owner: str | None = None) -> str:
    return (await service.jobs.create(NewJob(asked, "x"), None, owner))[0]


async def done(
    service: Service, *asked: NewRequest, owner: str | None = None
) -> tuple[str, list[JobRequest]]:
    """A job after its end, and its requests."""
    job_id = await send(service, *asked, owner=owner)
    await until(lambda: is_done(service, job_id))
    return job_id, await requests(service.jobs.store, job_id)


async def document(service: Service, job_id: str, number: int) -> Any:
    _, body = await service.jobs.store.read(partial(jobs.outcome, job_id=job_id, number=number))
    assert body is not None
    return orjson.loads(unpacked(body))


async def test_one_is_computed_and_later_ones_get_its_answer(
    store: Store, service: Service
) -> None:
    service.work.free.set()
    service.dispatcher.start()
    first, _ = await done(service, asks(), asks("b"))
    later, found = await done(service, *[asks()] * 200, asks("b"), asks(deadline=99.0))
    assert service.work.begun == [0, 1], "those of another job are known, too"
    assert {each.state for each in found} == {"done"} and {each.energy for each in found} == {5.0}
    for number in (*range(200), 201):
        kept = found[number].answer_id
        own = {
            "request": f"{later}.{number}",
            "id": kept,
            "by": f"{first}.0",
            "answer": f"/answers/{kept}",
        }
        assert await document(service, later, number) == own
    await done(service, asks(), owner="somebody")
    await done(service, asks(version="another"), NewRequest("optimize", BODY, 10.0))
    assert len(service.work.begun) == 5


async def test_a_service_without_workers_takes_nothing(store: Store, service: Service) -> None:
    """The cluster may be lost right after a request with a known answer."""
    service.work.free.set()
    service.dispatcher.start()
    await done(service, asks())
    await done(service, asks())
    service.work.slots = 0
    job_id = await send(service, asks("b"))
    await asyncio.sleep(TURN)
    assert [each.state for each in await requests(store, job_id)] == ["waiting"]
    assert service.work.begun == [0]


async def test_more_time_may_find_a_better_answer(service: Service) -> None:
    service.work.answer = partial(computed, status="feasible")
    service.work.free.set()
    service.dispatcher.start()
    for deadline in (10.0, 20.0, 5.0):
        await done(service, asks(deadline=deadline))
    assert len(service.work.begun) == 2


async def test_answers_that_refer_to_others_stay_in_their_job(service: Service) -> None:
    """Answers of a cycle's moves are deleted with their job, so another job must not
    refer to them.
    """
    service.work.free.set()
    service.dispatcher.start()
    for _ in range(2):
        await done(service, *[asks(kind="cycle")] * 100)
    assert service.work.begun.count(0) == 2
    assert len(service.work.begun) < 100, "within a job, later requests get copies"


async def test_a_job_that_is_deleted_takes_its_answers_with_it(service: Service) -> None:
    service.work.free.set()
    service.dispatcher.start()
    first, _ = await done(service, asks())
    second, _ = await done(service, asks())
    await service.jobs.delete(first, OPERATOR)
    assert (await document(service, second, 0))["request"] == f"{second}.0", "it has a copy"
    await done(service, asks())
    assert service.work.begun == [0, 0]
