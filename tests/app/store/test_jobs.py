"""The queue of jobs in SQLite and PostgreSQL: leases, late results, cancelling, events, limits."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from functools import partial

import pytest
from sqlalchemy import func, select

from joulepath.app.access.client import OPERATOR
from joulepath.app.answers.envelope import AnswerFigures
from joulepath.app.convert.packed import packed, unpacked
from joulepath.app.engine.result import StoredAnswer
from joulepath.app.exceptions.queue import TooManyWaiting
from joulepath.app.exceptions.stored import JobNotCancellable, KeyReused, UnknownAnswer, UnknownJob
from joulepath.app.store import answers, job_events, jobs, leases
from joulepath.app.store.jobs import NewJob, NewRequest
from joulepath.app.store.leases import Lease, Outcome
from joulepath.app.store.store import Store
from joulepath.app.store.tables import Answer, JobEvent, JobRequest, new_id
from tests.app.databases import on_both_databases

MUCH = 1 << 30
START = datetime(2030, 1, 1, tzinfo=UTC)
SOON = timedelta(seconds=30)
BODY = packed(b"{}")


class Bench:
    """A database of jobs with its workers, at a time set by the test."""

    def __init__(self, store: Store) -> None:
        self.store, self.now = store, START

    async def create(
        self,
        count: int = 3,
        key: str | None = None,
        keep_going: bool = True,
        most: int = MUCH,
        owner: str | None = None,
    ) -> str:
        new = NewJob([NewRequest("optimize", BODY, 10.0)] * count, f"{count}", "name", keep_going)
        job_id, _ = await self.store.write(
            partial(jobs.create, new=new, key=key, most_waiting=most, owner=owner)
        )
        return job_id

    async def lease(
        self, holder: str, count: int = 1, served: Sequence[str | None] = ()
    ) -> list[Lease]:
        work = partial(
            leases.lease,
            holder=holder,
            count=count,
            now=self.now,
            until=self.now + SOON,
            served=served,
        )
        return (await self.store.write(work))[0]

    async def settle(self, holder: str, *outcomes: Outcome) -> None:
        await self.store.write(
            partial(leases.settle, holder=holder, outcomes=outcomes, now=self.now, most=MUCH)
        )

    async def states(self, job_id: str) -> list[str]:
        found = await self.store.read(partial(jobs.requests, job_id=job_id, limit=MUCH, after=-1))
        return [request.state for request in found]

    async def state(self, job_id: str) -> str:
        return (await self.store.read(partial(jobs.view, job_id=job_id))).job.state

    async def answer(self, job_id: str, number: int) -> bytes | None:
        _, body = await self.store.read(partial(jobs.outcome, job_id=job_id, number=number))
        return None if body is None else unpacked(body)

    async def events(self, job_id: str) -> list[JobEvent]:
        found, _ = await self.store.read(
            partial(job_events.after, job_id=job_id, number=0, limit=MUCH)
        )
        return found


def done(lease: Lease, answer: bytes = b"{}") -> Outcome:
    return Outcome(lease, "done", 0.1, AnswerFigures("ur5e", 2.0, 1.0, "optimal"), packed(answer))


@pytest.fixture
def bench(store: Store) -> Bench:
    return Bench(store)


@on_both_databases
async def test_a_lease_that_ran_out_is_taken_over_and_the_late_result_dropped(bench: Bench) -> None:
    job_id = await bench.create(1)
    (first,) = await bench.lease("a")
    bench.now += SOON / 2
    assert await bench.lease("b") == [], "it is leased"
    bench.now += SOON
    (second,) = await bench.lease("b")
    assert (second.key, second.attempt) == (first.key, 2)
    await bench.settle("a", done(first, b'"late"'))
    assert await bench.states(job_id) == ["running"]
    await bench.settle("b", done(second, b'"second"'))
    await bench.settle(
        "a", done(first, b'"later"'), Outcome(first, "failed", problem={"type": "late"})
    )
    await bench.settle("b", done(second, b'"twice"'))
    assert (await bench.states(job_id), await bench.state(job_id)) == (["done"], "done")
    assert await bench.answer(job_id, 0) == b'"second"'
    assert (
        await bench.store.read(
            lambda session: session.scalar(select(func.count()).select_from(Answer))
        )
        == 1
    )
    assert [event.name for event in await bench.events(job_id)].count("request") == 1


async def test_a_renewed_lease_is_kept(bench: Bench) -> None:
    await bench.create(1)
    (lease,) = await bench.lease("a")
    bench.now += SOON - timedelta(seconds=1)
    await bench.store.write(partial(leases.renew, holder="a", until=bench.now + SOON))
    bench.now += SOON - timedelta(seconds=1)
    assert await bench.lease("b") == []
    assert await bench.store.read(partial(leases.kept, holder="a")) == {(lease.key, 1)}


@on_both_databases
async def test_many_holders_never_get_the_same_request(bench: Bench) -> None:
    """Services on one database lease every request once and number the events without gaps."""

    async def work(name: str, got: list[Lease]) -> None:
        while found := await bench.lease(name, 3):
            got += found
            await bench.settle(name, *(done(each) for each in found))

    job_ids = [await bench.create(20) for _ in range(3)]
    got: list[Lease] = []
    await asyncio.gather(*(work(name, got) for name in "abcd"))
    assert sorted(lease.key for lease in got) == sorted(
        (job_id, n) for job_id in job_ids for n in range(20)
    )
    for job_id in job_ids:
        events = await bench.events(job_id)
        assert [event.number for event in events] == list(range(1, len(events) + 1))
        assert sorted(event.data["index"] for event in events if event.name == "request") == list(
            range(20)
        )
        assert [event.name for event in events].count("end") == 1 and events[-1].name == "end"


async def test_a_short_job_does_not_wait_for_the_end_of_a_long_one(bench: Bench) -> None:
    await bench.create(100)
    await bench.settle("a", *map(done, await bench.lease("a", 10)))
    short = await bench.create(1)
    assert [lease.job_id for lease in await bench.lease("a")] == [short]


async def test_jobs_take_turns_in_the_order_in_which_they_came(bench: Bench) -> None:
    """No job waits behind later jobs for ever; ids tell times apart by milliseconds."""
    made = list[str]()
    for _ in range(8):
        made.append(await bench.create(1))
        await asyncio.sleep(0.002)
    assert [(await bench.lease("a"))[0].job_id for _ in made] == made


async def test_owners_take_turns_however_many_jobs_they_have(bench: Bench) -> None:
    for _ in range(20):
        await bench.create(1, owner="many")
    await bench.create(3, owner="few")
    await bench.create(2)
    owners = [lease.owner for lease in await bench.lease("a", 8)]
    assert sorted(map(str, owners[:3])) == ["None", "few", "many"] and owners[3:6] == owners[:3]
    assert owners[6:] == [owner for owner in owners[:3] if owner is not None]


@pytest.mark.parametrize("jobs_of", [{"long": [30], "short": [3]}, {"A": [1] * 6, "B": [1] * 6}])
async def test_the_owner_that_was_served_last_comes_last(
    bench: Bench, jobs_of: dict[str, list[int]]
) -> None:
    """Owners take turns by single requests, as with a single worker, in one job or in many."""
    for owner, sizes in jobs_of.items():
        for size in sizes:
            await bench.create(size, owner=owner)
    served, order = list[str | None](), list[str | None]()
    for _ in range(6):
        (lease,) = await bench.lease("a", served=served)
        served = [owner for owner in served if owner != lease.owner] + [lease.owner]
        order.append(lease.owner)
        await bench.settle("a", done(lease))
    assert set(order[:2]) == set(jobs_of) and order[2:] == order[:-2]


@on_both_databases
async def test_cancelling_ends_what_waits_and_then_what_runs(bench: Bench) -> None:
    job_id = await bench.create(4)
    first, second = await bench.lease("a", 2)
    await bench.settle("a", done(first))
    await bench.store.write(partial(jobs.cancel, job_id=job_id, client=OPERATOR))
    assert await bench.states(job_id) == ["done", "running", "cancelled", "cancelled"]
    assert await bench.state(job_id) == "cancelling"
    assert await bench.lease("b", 9) == []
    assert await bench.store.read(partial(leases.kept, holder="a")) == set(), (
        "its holder is to stop it"
    )
    await bench.settle("a", Outcome(second, "waiting"))
    assert (await bench.states(job_id), await bench.state(job_id)) == (
        ["done", "cancelled", "cancelled", "cancelled"],
        "cancelled",
    )
    await bench.store.write(partial(jobs.cancel, job_id=job_id, client=OPERATOR))
    names = [event.name for event in await bench.events(job_id)]
    assert (names.count("request"), names.count("end")) == (4, 1)
    assert await bench.answer(job_id, 0) == b"{}", "what was done stays"

    await bench.store.write(partial(jobs.retry, job_id=job_id, client=OPERATOR, most_waiting=MUCH))
    again = await bench.lease("a", 9)
    assert [lease.number for lease in again] == [1, 2, 3]
    await bench.settle("a", *map(done, again))
    assert await bench.state(job_id) == "done"
    with pytest.raises(JobNotCancellable):
        await bench.store.write(partial(jobs.cancel, job_id=job_id, client=OPERATOR))
    await bench.store.write(partial(jobs.retry, job_id=job_id, client=OPERATOR, most_waiting=MUCH))
    assert await bench.state(job_id) == "done", "nothing is left to retry"


async def test_the_first_failure_may_end_a_job(bench: Bench) -> None:
    job_id = await bench.create(4, keep_going=False)
    first, second = await bench.lease("a", 2)
    await bench.settle("a", Outcome(first, "failed", problem={"type": "/problems/internal-error"}))
    assert await bench.states(job_id) == ["failed", "running", "cancelled", "cancelled"]
    await bench.settle("a", done(second))
    assert await bench.state(job_id) == "cancelled"


async def test_what_is_given_back_waits_again(bench: Bench) -> None:
    job_id = await bench.create(1)
    for expected in (1, 2):
        (lease,) = await bench.lease("a")
        assert (lease.attempt, lease.deaths, lease.preempted) == (expected, expected - 1, 0)
        await bench.settle("a", Outcome(lease, "waiting", died=True))
    (lease,) = await bench.lease("a")
    await bench.settle("a", Outcome(lease, "waiting", preempted=True))
    (lease,) = await bench.lease("a")
    assert (lease.attempt, lease.deaths, lease.preempted) == (3, 2, 1), (
        "that attempt does not count"
    )
    await bench.store.write(partial(leases.take_back_from, is_gone=lambda holder: holder == "b"))
    assert await bench.states(job_id) == ["running"]
    await bench.store.write(partial(leases.take_back_from, is_gone=lambda holder: holder == "a"))
    assert await bench.states(job_id) == ["waiting"]


async def test_a_key_is_for_one_job(bench: Bench) -> None:
    made = await asyncio.gather(
        *(bench.create(2, key="k") for _ in range(2)), return_exceptions=True
    )
    first = next(each for each in made if isinstance(each, str))
    assert await bench.create(2, key="k") == first
    with pytest.raises(KeyReused):
        await bench.create(3, key="k")
    assert (
        await bench.store.read(
            lambda session: session.scalar(select(func.count()).select_from(JobRequest))
        )
        == 2
    )


async def test_the_queue_has_a_limit(bench: Bench) -> None:
    job_id = await bench.create(3, most=5)
    with pytest.raises(TooManyWaiting):
        await bench.create(3, most=5)
    await bench.settle("a", *(Outcome(each, "failed") for each in await bench.lease("a", 3)))
    await bench.create(3, most=5)
    with pytest.raises(TooManyWaiting):
        await bench.store.write(partial(jobs.retry, job_id=job_id, client=OPERATOR, most_waiting=5))
    assert await bench.states(job_id) == ["failed"] * 3


async def test_answers_live_as_long_as_their_job(bench: Bench) -> None:
    job_id = await bench.create(1)
    (lease,) = await bench.lease("a")
    part = new_id()
    await bench.settle(
        "a",
        Outcome(
            lease,
            "done",
            answer=BODY,
            parts=(StoredAnswer(part, packed(b'"part"')),),
            parts_kind="optimize",
        ),
    )
    await bench.store.write(partial(answers.prune, max_bytes=0, max_age=timedelta(0)))
    await bench.store.write(partial(jobs.prune, max_age=timedelta(days=36500)))
    (kept,) = await bench.store.read(partial(jobs.results, job_id=job_id, limit=9, after=-1))
    assert kept[1] is not None
    _, body = await bench.store.read(partial(answers.get, answer_id=part))
    assert body == b'"part"'
    bench.now -= timedelta(days=36500)
    another = await bench.create(1)
    (lease,) = await bench.lease("a")
    await bench.settle("a", done(lease))
    await bench.store.write(partial(jobs.prune, max_age=timedelta(days=30)))
    with pytest.raises(UnknownJob):
        await bench.state(another)
    await bench.store.write(partial(jobs.delete, job_id=job_id, client=OPERATOR))
    with pytest.raises(UnknownAnswer):
        await bench.store.read(partial(answers.get, answer_id=part))
    assert (
        await bench.store.read(
            lambda session: session.scalar(select(func.count()).select_from(Answer))
        )
        == 0
    )


async def test_progress_comes_twice_a_second_at_most(bench: Bench) -> None:
    job_id = await bench.create(30)
    for _ in range(30):
        await bench.settle("a", *map(done, await bench.lease("a")))
        bench.now += timedelta(seconds=0.1)
    progress = [event.data for event in await bench.events(job_id) if event.name == "progress"]
    assert 6 <= len(progress) <= 8
    assert progress[0]["eta"] is None, "before 5 % is done"
    half = next(each for each in progress if each["progress"] >= 0.5)
    assert half["eta"] == pytest.approx(1.5, abs=0.2)
    assert progress[-1]["progress"] == 1.0
    view = await bench.store.read(partial(jobs.view, job_id=job_id))
    assert view.counts == {"waiting": 0, "running": 0, "done": 30, "failed": 0, "cancelled": 0}


async def test_progress_continues_after_the_clock_was_set_back(bench: Bench) -> None:
    job_id = await bench.create(30)
    for done_before in range(30):
        bench.now -= timedelta(hours=1) if done_before == 15 else timedelta()
        await bench.settle("a", *map(done, await bench.lease("a")))
        bench.now += timedelta(seconds=0.1)
    progress = [event.data for event in await bench.events(job_id) if event.name == "progress"]
    assert sum(each["progress"] > 0.5 for each in progress) >= 3
    assert all(each["eta"] is None for each in progress if each["progress"] > 0.5)
