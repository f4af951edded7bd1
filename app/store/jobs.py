"""Jobs from the view of clients. All functions take a session."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import ColumnElement, Select, insert, select
from sqlalchemy import delete as delete_from
from sqlalchemy.orm import Session, defer

from joulepath.app.access.client import Client
from joulepath.app.exceptions.queue import TooManyWaiting, TooManyWaitingOfClient
from joulepath.app.exceptions.stored import JobNotCancellable, KeyReused, UnknownJob
from joulepath.app.store.cache import Meaning
from joulepath.app.store.job_events import (
    ENDED,
    Counts,
    conclude,
    counts_of,
    record,
    request_ended,
    set_state,
)
from joulepath.app.store.paging import following, having, newest_first, page_of
from joulepath.app.store.shares import COUNT, room_of, stored_key
from joulepath.app.store.tables import Answer, Job, JobRequest, by_id, new_id, now

_AT_A_TIME = 50
"""Requests that are read at once with their answers, of up to 1 MB each."""


@dataclass(frozen=True)
class NewRequest:
    """A validated request to the endpoint `kind`.

    It has a `body` of compressed JSON, a deadline [s], its meaning, if the answer to an equal
    request may be used, and the name of its row.
    """

    kind: str
    body: bytes
    deadline: float
    meaning: Meaning | None = None
    name: str | None = None


@dataclass(frozen=True)
class NewJob:
    """A job to create; `fingerprint` distinguishes it from other jobs with the same key."""

    requests: Sequence[NewRequest]
    fingerprint: str
    name: str | None = None
    keep_going: bool = True


@dataclass(frozen=True)
class JobView:
    """A job and the numbers of its requests by state."""

    job: Job
    counts: Counts


def create(
    session: Session, new: NewJob, key: str | None, most_waiting: int, owner: str | None = None
) -> tuple[str, bool]:
    """Adds a job; returns its id, and whether a job with this key existed already.

    Raises KeyReused if the existing job differs; TooManyWaiting above `most_waiting` requests, and
    TooManyWaitingOfClient above the owner's share of them.
    """
    if key is not None:
        key = stored_key(key, owner)
        known = session.scalar(select(Job).where(Job.idempotency_key == key))
        if known is not None:
            if known.fingerprint != new.fingerprint:
                raise KeyReused
            return known.id, True
    _check_room(session, len(new.requests), most_waiting, owner)
    job = Job(
        id=new_id(),
        name=new.name,
        state="waiting",
        owner=owner,
        keep_going=new.keep_going,
        created=now(),
        total=len(new.requests),
        ended_before=0,
        events=0,
        idempotency_key=key,
        fingerprint=new.fingerprint,
    )
    session.add(job)
    record(session, job, "state", {"state": "waiting"})
    session.flush()
    fresh = {"state": "waiting", "attempt": 0, "deaths": 0, "preempted": 0}
    rows = [
        {"job_id": job.id, "number": number, "owner": owner, **vars(each), **fresh}
        for number, each in enumerate(new.requests)
    ]
    session.execute(insert(JobRequest), rows)
    return job.id, False


def view(session: Session, job_id: str) -> JobView:
    """A job and its counts. Raises UnknownJob."""
    job = by_id(session, Job, job_id, UnknownJob)
    return JobView(job, counts_of(session, [job.id])[job.id])


@dataclass(frozen=True)
class Wanted:
    """Which jobs a list has."""

    state: str | None = None
    """State of the jobs; None: any."""
    search: str | None = None
    """Text in the name, in upper or lower case; None: any."""
    without: str | None = None
    """Endpoint that their first request is not for; None: any."""

    def of(self, query: Select[Job]) -> Select[Job]:
        """The query for these jobs."""
        if self.state is not None:
            query = query.where(Job.state == self.state)
        query = query.where(having(self.search, Job.name))
        if self.without is not None:
            first = (JobRequest.job_id == Job.id) & (JobRequest.number == 0)
            query = query.join(JobRequest, first).where(JobRequest.kind != self.without)
        return query


def page(
    session: Session, limit: int, after: str | None, wanted: Wanted
) -> tuple[list[JobView], str | None]:
    """Up to `limit` jobs, newest first, and the `after` of the next page; None on the last page."""
    jobs, following = page_of(session, wanted.of(select(Job)), Job, limit, after)
    counts = counts_of(session, [job.id for job in jobs])
    return [JobView(job, counts[job.id]) for job in jobs], following


def page_of_kind(
    session: Session, kind: str, limit: int, after: str | None, search: str | None
) -> tuple[list[tuple[Job, JobRequest, str | None]], str | None]:
    """Up to `limit` jobs of one request to the endpoint `kind`, newest first. With a `search`,
    those that have this text in their name or in the robot of their answer.

    Returns jobs, requests and robots of the answers, and the `after` of the next page; None on the
    last page.
    """
    query = select(Job, JobRequest, Answer.robot).join(JobRequest, JobRequest.job_id == Job.id)
    query = query.outerjoin(Answer, Answer.id == JobRequest.answer_id)
    which = (Job.total == 1, JobRequest.kind == kind, having(search, Job.name, Answer.robot))
    query = query.where(*which).options(defer(JobRequest.body, raiseload=True))
    rows = session.execute(newest_first(query, Job, limit, after))
    found = [(job, request, robot) for job, request, robot in rows]
    return found[:limit], following([job for job, _, _ in found], limit)


def requests(
    session: Session, job_id: str, limit: int, after: int, *which: ColumnElement[bool]
) -> list[JobRequest]:
    """Up to `limit` requests of a job with an index above `after`, in order, without their
    bodies."""
    query = select(JobRequest).where(JobRequest.job_id == job_id, JobRequest.number > after, *which)
    query = query.order_by(JobRequest.number).limit(limit)
    return list(session.scalars(query.options(defer(JobRequest.body, raiseload=True))))


def ended(session: Session, job_id: str, limit: int, after: int) -> list[JobRequest]:
    """Ended requests, otherwise as `requests`."""
    return requests(session, job_id, limit, after, JobRequest.state.in_(ENDED))


def results(
    session: Session, job_id: str, limit: int, after: int
) -> list[tuple[JobRequest, bytes | None]]:
    """Ended requests with the compressed bodies of their answers; None without an answer."""
    found = ended(session, job_id, limit, after)
    query = select(Answer.id, Answer.body).where(
        Answer.id.in_([request.answer_id for request in found])
    )
    bodies: dict[str, bytes] = dict(session.execute(query).all())
    return [(request, bodies.get(request.answer_id or "")) for request in found]


def whole(session: Session, job_id: str) -> Iterator[tuple[JobRequest, bytes | None]]:
    """All requests of a job with their bodies and those of their answers, in order, some at a time:
    together they may be larger than the memory.
    """
    query = select(JobRequest, Answer.body).outerjoin(Answer, Answer.id == JobRequest.answer_id)
    query = query.where(JobRequest.job_id == job_id).order_by(JobRequest.number)
    rows = session.execute(query.execution_options(yield_per=_AT_A_TIME))
    return ((request, body) for request, body in rows)


def rename(session: Session, job_id: str, name: str | None, client: Client) -> JobView:
    """Gives a job a name, or none. Raises UnknownJob or NotOwner."""
    job = _locked(session, job_id, client)
    job.name = name
    return view(session, job_id)


def cancel(session: Session, job_id: str, client: Client) -> None:
    """Cancels waiting requests, and asks for the end of running ones.

    Raises UnknownJob, NotOwner or JobNotCancellable.
    """
    job = _locked(session, job_id, client)
    if job.state == "done":
        raise JobNotCancellable
    if job.state != "cancelled":
        stop(session, job, now())


def stop(session: Session, job: Job, at: datetime) -> None:
    """Cancels waiting requests of a job with a locked row; holders stop running ones."""
    set_state(session, job, "cancelling")
    # A locked row is about to be leased: the holder will see the state of the job.
    query = select(JobRequest).where(JobRequest.job_id == job.id, JobRequest.state == "waiting")
    for request in session.scalars(
        query.options(defer(JobRequest.body)).with_for_update(skip_locked=True)
    ):
        request.state = "cancelled"
        request_ended(session, job, request)
    conclude(session, job, at)


def retry(session: Session, job_id: str, client: Client, most_waiting: int) -> None:
    """Lets failed and cancelled requests wait again. Raises UnknownJob, NotOwner, TooManyWaiting or
    TooManyWaitingOfClient."""
    job = _locked(session, job_id, client)
    again = select(JobRequest).where(
        JobRequest.job_id == job.id, JobRequest.state.in_(("failed", "cancelled"))
    )
    found = list(session.scalars(again.options(defer(JobRequest.body))))
    if not found:
        return
    _check_room(session, len(found), most_waiting, job.owner)
    for request in found:
        request.state, request.problem, request.deaths, request.preempted = "waiting", None, 0, 0
    session.flush()
    counts = counts_of(session, [job.id])[job.id]
    job.started, job.ended, job.ended_before = now(), None, sum(counts[state] for state in ENDED)
    set_state(session, job, "running" if counts["running"] else "waiting")


def delete(session: Session, job_id: str, client: Client) -> None:
    """Deletes a job, its requests, their answers and its events. Raises UnknownJob or NotOwner."""
    job = by_id(session, Job, job_id, UnknownJob, client)
    # in the order in which holders lock the rows of a job
    session.execute(
        select(JobRequest.number).where(JobRequest.job_id == job.id).with_for_update()
    ).all()
    _delete(session, [job.id])


def prune(session: Session, max_age: timedelta) -> None:
    """Deletes jobs and their answers `max_age` after their end."""
    _delete(session, list(session.scalars(select(Job.id).where(Job.ended < now() - max_age))))


def outcome(session: Session, job_id: str, number: int) -> tuple[JobRequest, bytes | None]:
    """A request of a job and the compressed body of its answer; None if it has none. Raises
    UnknownJob.
    """
    request = session.get(JobRequest, (job_id, number), options=[defer(JobRequest.body)])
    if request is None:
        raise UnknownJob
    return request, session.scalar(select(Answer.body).where(Answer.id == request.answer_id))


def _delete(session: Session, job_ids: list[str]) -> None:
    # requests and events go with their job; requests refer to answers, and so go first
    session.execute(delete_from(Job).where(Job.id.in_(job_ids)))
    session.execute(delete_from(Answer).where(Answer.job_id.in_(job_ids)))


def _locked(session: Session, job_id: str, client: Client) -> Job:
    """A job whose row is locked, for a client to change it. Raises UnknownJob or NotOwner."""
    return by_id(session, Job, job_id, UnknownJob, client, with_for_update={"key_share": True})


def _check_room(session: Session, more: int, most_waiting: int, owner: str | None) -> None:
    waiting = JobRequest.state == "waiting"
    own, room = room_of(session, owner, most_waiting, JobRequest.owner, COUNT, waiting)
    if more > room:
        raise TooManyWaiting
    if more > own:
        raise TooManyWaitingOfClient
