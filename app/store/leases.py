"""The queue of jobs from the view of holders. Expired leases are leased again, late results
dropped.

A transaction with locked rows of `job_requests` may wait for rows of `jobs`, in order of their ids.
A transaction with a locked row of `jobs` never waits for rows of `job_requests`. This excludes
deadlocks.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Literal

from sqlalchemy import select, tuple_, update
from sqlalchemy.orm import Session, defer

from joulepath.app.answers.envelope import AnswerFigures
from joulepath.app.engine.result import StoredAnswer
from joulepath.app.exceptions.stored import TooManyFigures
from joulepath.app.store import answers, cache, figures, jobs, known_motions
from joulepath.app.store.cache import Answered, Asked, Meaning
from joulepath.app.store.job_events import (
    Report,
    conclude,
    progress_is_due,
    record_progress,
    request_ended,
    set_state,
)
from joulepath.app.store.tables import Job, JobRequest, new_id

Key = tuple[str, int]
"""A request: the id of its job and its index."""


@dataclass(frozen=True)
class Lease:
    """A leased request of `owner`: compressed JSON `body` of the endpoint `kind`, deadline [s]."""

    job_id: str
    number: int
    attempt: int
    kind: str
    body: bytes
    deadline: float
    deaths: int
    preempted: int
    meaning: Meaning | None
    owner: str | None

    @property
    def key(self) -> Key:
        """The request."""
        return self.job_id, self.number


@dataclass(frozen=True)
class FoundFigures:
    """Identified figures of a robot, see `figures.new_figures`."""

    robot: str
    content: dict[str, Any]


@dataclass(frozen=True)
class Outcome:
    """Outcome of the work on a lease. `waiting`: the request must run again.

    `wall_time` [s] is the time of the work. `answer` is the compressed document, `answer_id` the id
    in it, if any. `parts` are compressed answers of the endpoint `parts_kind` to which it refers.
    `identified` are figures found for an arm. `is_optimal`: more time could not improve the answer.
    `asked` is the cache key of the request. `motions` are used or found motions of a cell.
    """

    lease: Lease
    state: Literal["waiting", "done", "failed", "cancelled"]
    wall_time: float | None = None
    figures: AnswerFigures = field(default_factory=AnswerFigures)
    answer: bytes | None = None
    answer_id: str | None = None
    parts: Sequence[StoredAnswer] = ()
    parts_kind: str = ""
    problem: dict[str, Any] | None = None
    died: bool = False
    preempted: bool = False
    identified: FoundFigures | None = None
    is_optimal: bool = False
    asked: Asked | None = None
    motions: Mapping[str, bytes] = field(default_factory=dict)


def lease(
    session: Session,
    holder: str,
    count: int,
    now: datetime,
    until: datetime,
    served: Sequence[str | None] = (),
) -> tuple[list[Lease], set[str]]:
    """Lease waiting requests. The owners of jobs take turns.

    Args:
        session: session of the database.
        holder: who gets the leases.
        count: largest number of leases.
        now: present time.
        until: end of the leases.
        served: owners whose requests this holder has leased before, the latest one last.

    Returns:
        The leases in the order of work, and the jobs that have changed.
    """
    _take_back(session, JobRequest.leased_until < now)
    found = _next(session, count, served)
    locked = _locked(session, (request.job_id for request in found))
    leased, changed = [], set()
    for request in found:
        job = locked.get(request.job_id)
        if job is None:
            continue  # it has just been deleted
        if job.state == "cancelling":
            request.state = "cancelled"
            request_ended(session, job, request)
            changed.add(job.id)
            continue
        if job.state == "waiting":
            job.started = job.started or now
            set_state(session, job, "running")
            changed.add(job.id)
        request.state, request.attempt = "running", request.attempt + 1
        request.leased_by, request.leased_until = holder, until
        names = (
            "job_id",
            "number",
            "attempt",
            "kind",
            "body",
            "deadline",
            "deaths",
            "preempted",
            "meaning",
        )
        leased.append(Lease(**{name: getattr(request, name) for name in names}, owner=job.owner))
    for job_id in changed:
        if locked[job_id].state == "cancelling":
            conclude(session, locked[job_id], now)
    return leased, changed


def _next(session: Session, count: int, served: Sequence[str | None]) -> list[JobRequest]:
    """The next waiting requests: the first one of each owner, then the second ones, and so on.

    The owner that was served longest ago is the first.
    """
    waiting = JobRequest.state == "waiting"
    turns = {owner: turn for turn, owner in enumerate(served)}
    places = list[tuple[int, int, int, str]]()
    for owner in session.scalars(select(JobRequest.owner).where(waiting).distinct()):
        # without the bodies, because most of these requests stay where they are
        own = (
            select(JobRequest.number, JobRequest.job_id)
            .where(waiting, JobRequest.owner == owner)
            .order_by(JobRequest.number, JobRequest.job_id)
            .limit(count)
            .with_for_update(skip_locked=True)
        )
        turn = turns.get(owner, -1)
        places += [(rank, turn, *key) for rank, key in enumerate(session.execute(own))]
    keys = [place[2:] for place in sorted(places)[:count]]
    rows = select(JobRequest).where(tuple_(JobRequest.number, JobRequest.job_id).in_(keys))
    found = {(each.number, each.job_id): each for each in session.scalars(rows)}
    return [found[key] for key in keys]


def settle(
    session: Session, holder: str, outcomes: Sequence[Outcome], now: datetime, most: int
) -> set[str]:
    """Stores outcomes of valid leases of `holder`, drops others, and returns the changed jobs.

    The database takes at most `most` identified figures; further ones stay in their answers.
    """
    found = _held(session, holder, outcomes)
    held = [
        (outcome, found.pop((outcome.lease.key, outcome.lease.attempt), None))
        for outcome in outcomes
    ]
    locked = _locked(
        session, (outcome.lease.job_id for outcome, request in held if request is not None)
    )
    stopped = []
    for outcome, request in held:
        if request is not None:
            job = locked[request.job_id]
            _store(session, job, request, outcome, most)
            if request.state == "failed" and not job.keep_going:
                stopped.append(job)
    cache.remember(session, _answered(held))
    for outcome, request in held:
        if (
            request is not None
            and outcome.lease.meaning is not None
            and "cell" in outcome.lease.meaning
        ):
            known_motions.keep(session, outcome.lease.meaning["cell"], outcome.motions)
    for job in stopped:
        if job.state == "running":
            jobs.stop(session, job, now)
    for job in locked.values():
        conclude(session, job, now)
    return set(locked)


def report(session: Session, holder: str, reports: Mapping[Key, Report], now: datetime) -> set[str]:
    """Records progress within requests leased by `holder`; returns the jobs with new events."""
    keys = tuple_(JobRequest.job_id, JobRequest.number).in_(list(reports))
    query = select(JobRequest.job_id, JobRequest.number, JobRequest.attempt)
    held = session.execute(
        query.where(keys, JobRequest.state == "running", JobRequest.leased_by == holder)
    ).all()
    told: dict[str, dict[int, Report]] = {}
    for job_id, number, attempt in held:
        own = reports[job_id, number]
        if own.attempt == attempt:
            told.setdefault(job_id, {})[number] = own
    due = [
        job
        for job in _locked(session, told).values()
        if job.ended is None and progress_is_due(job, now)
    ]
    for job in due:
        record_progress(session, job, now, told[job.id])
    return {job.id for job in due}


def renew(session: Session, holder: str, until: datetime) -> None:
    """Extends all leases of `holder`."""
    mine = (JobRequest.state == "running", JobRequest.leased_by == holder)
    session.execute(update(JobRequest).where(*mine).values(leased_until=until))


def kept(session: Session, holder: str) -> set[tuple[Key, int]]:
    """Requests and attempts leased by `holder` and not cancelled."""
    query = select(JobRequest.job_id, JobRequest.number, JobRequest.attempt).join(
        Job, Job.id == JobRequest.job_id
    )
    query = query.where(
        JobRequest.state == "running", JobRequest.leased_by == holder, Job.state != "cancelling"
    )
    return {((job_id, number), attempt) for job_id, number, attempt in session.execute(query)}


def is_due(session: Session, now: datetime) -> bool:
    """Whether a request waits, or a lease ran out."""
    waits = select(JobRequest.number).where(JobRequest.state == "waiting").limit(1)
    ran_out = (
        select(JobRequest.number)
        .where(JobRequest.state == "running", JobRequest.leased_until < now)
        .limit(1)
    )
    return session.scalar(waits) is not None or session.scalar(ran_out) is not None


def take_back_from(session: Session, is_gone: Callable[[str], bool]) -> None:
    """Ends the leases of ended holders."""
    holders = session.scalars(
        select(JobRequest.leased_by).where(JobRequest.state == "running").distinct()
    )
    gone = [holder for holder in holders if holder is not None and is_gone(holder)]
    if gone:
        _take_back(session, JobRequest.leased_by.in_(gone))


def _take_back(session: Session, which: Any) -> None:
    query = (
        select(JobRequest)
        .where(JobRequest.state == "running", which)
        .options(defer(JobRequest.body))
    )
    for request in session.scalars(query.with_for_update(skip_locked=True)):
        request.state, request.leased_by, request.leased_until = "waiting", None, None
    session.flush()


def _held(
    session: Session, holder: str, outcomes: Iterable[Outcome]
) -> dict[tuple[Key, int], JobRequest]:
    """The rows of valid leases of `holder`, by request and attempt."""
    query = select(JobRequest).where(
        tuple_(JobRequest.job_id, JobRequest.number).in_(
            [outcome.lease.key for outcome in outcomes]
        ),
        JobRequest.state == "running",
        JobRequest.leased_by == holder,
    )
    # in one order for everybody
    query = (
        query.order_by(JobRequest.job_id, JobRequest.number)
        .options(defer(JobRequest.body))
        .with_for_update()
    )
    return {
        ((request.job_id, request.number), request.attempt): request
        for request in session.scalars(query)
    }


def _locked(session: Session, job_ids: Iterable[str]) -> dict[str, Job]:
    query = (
        select(Job).where(Job.id.in_(set(job_ids))).order_by(Job.id).with_for_update(key_share=True)
    )
    return {job.id: job for job in session.scalars(query.execution_options(populate_existing=True))}


def _answered(held: Iterable[tuple[Outcome, JobRequest | None]]) -> Iterator[Answered]:
    for outcome, request in held:
        if request is not None and request.answer_id is not None and outcome.asked is not None:
            yield Answered(outcome.asked, request.answer_id, outcome.is_optimal)


def _store(session: Session, job: Job, request: JobRequest, outcome: Outcome, most: int) -> None:
    request.leased_by = request.leased_until = None
    request.state = outcome.state
    if outcome.state == "waiting":
        request.deaths += outcome.died
        request.preempted += outcome.preempted
        request.attempt -= outcome.preempted
        if job.state == "cancelling":
            request.state = "cancelled"
    own = outcome.figures
    request.wall_time, request.energy, request.duration = (
        outcome.wall_time,
        own.energy,
        own.duration,
    )
    request.status, request.problem = own.status, outcome.problem
    for part in outcome.parts:
        answers.put_of_job(session, outcome.parts_kind, part, job, is_part=True)
    if outcome.answer is not None:
        request.answer_id = outcome.answer_id or new_id()
        whole = StoredAnswer(request.answer_id, outcome.answer, own)
        answers.put_of_job(session, outcome.lease.kind, whole, job)
    if (found := outcome.identified) is not None:
        with contextlib.suppress(TooManyFigures):
            new = figures.new_figures(found.robot, found.content, job.owner)
            request.figures = figures.put(session, new, most)[0].id
    if request.state != "waiting":
        request_ended(session, job, request)
