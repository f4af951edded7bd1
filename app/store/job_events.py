"""Events of a job, with consecutive numbers: a client can ask for all events after a number."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from joulepath.app.store.tables import Job, JobEvent, JobRequest

PROGRESS_PERIOD = timedelta(seconds=0.5)
"""Least time between two events `progress`."""
STATES = ("waiting", "running", "done", "failed", "cancelled")
"""States of a request, in the order of counts."""
ENDED = ("done", "failed", "cancelled")

Counts = dict[str, int]


@dataclass(frozen=True)
class Report:
    """Progress within an attempt at a request: energy [J] of the best answer, its bound [J],
    candidates tried, and the share of its steps that are done.
    """

    attempt: int
    found: float | None = None
    bound: float | None = None
    solved: int = 0
    share: float | None = None


def counts_of(session: Session, job_ids: list[str]) -> dict[str, Counts]:
    """Number of requests by job and state."""
    counts = {job_id: dict.fromkeys(STATES, 0) for job_id in job_ids}
    query = select(JobRequest.job_id, JobRequest.state, func.count()).where(
        JobRequest.job_id.in_(job_ids)
    )
    for job_id, state, count in session.execute(
        query.group_by(JobRequest.job_id, JobRequest.state)
    ):
        counts[job_id][state] = count
    return counts


def record(session: Session, job: Job, name: str, data: Mapping[str, Any]) -> None:
    """Adds the next event of a job; its row must be locked."""
    job.events += 1
    session.add(JobEvent(job_id=job.id, number=job.events, name=name, data=dict(data)))


def set_state(session: Session, job: Job, state: str) -> None:
    """Changes the state of a job; its row must be locked."""
    if job.state != state:
        job.state = state
        record(session, job, "state", {"state": state})


def request_ended(session: Session, job: Job, request: JobRequest) -> None:
    """Records the end of a request of the job."""
    record(
        session,
        job,
        "request",
        {"index": request.number, "state": request.state, "energy": request.energy},
    )


def conclude(session: Session, job: Job, now: datetime) -> None:
    """Records progress, and the end of the job if no request waits or runs. The job's row must be
    locked.
    """
    if job.ended is not None:
        return
    session.flush()
    open_requests = select(JobRequest.number).where(
        JobRequest.job_id == job.id, JobRequest.state.in_(("waiting", "running"))
    )
    over = session.scalar(open_requests.limit(1)) is None
    if not over and not progress_is_due(job, now):
        return
    counts = record_progress(session, job, now, {})
    if over:
        job.ended = now
        set_state(session, job, "cancelled" if job.state == "cancelling" else "done")
        record(session, job, "end", {"state": job.state, "counts": counts})


def progress_is_due(job: Job, now: datetime) -> bool:
    """Whether the last event `progress` of a job is old enough for another one."""
    # the clock may have been set back since then
    return job.progressed is None or abs(now - job.progressed) >= PROGRESS_PERIOD


def record_progress(
    session: Session, job: Job, now: datetime, reports: Mapping[int, Report]
) -> Counts:
    """Records the progress of a job, and within its requests by their index; returns its counts."""
    counts = counts_of(session, [job.id])[job.id]
    job.progressed = now
    requests = [{"index": index, **vars(report)} for index, report in sorted(reports.items())]
    within = sum(report.share or 0.0 for report in reports.values())
    left = eta(job, counts, now, within)
    known = {"counts": counts, "progress": progress(job, counts), "eta": left}
    record(session, job, "progress", known | {"requests": requests})
    return counts


def progress(job: Job, counts: Counts) -> float:
    """Share of ended requests."""
    return sum(counts[state] for state in ENDED) / job.total


def eta(job: Job, counts: Counts, now: datetime, within: float = 0.0) -> float | None:
    """Time [s] until the job ends at its present speed; None before 5 % of its work is done, and
    while the clock, which was set back, shows a time before its start. `within` is the work that is
    done of running requests, in requests.
    """
    ended = sum(counts[state] for state in ENDED) + within
    done, work = ended - job.ended_before, job.total - job.ended_before
    if job.ended is not None or job.started is None or done <= 0 or done < 0.05 * work:
        return None
    taken = (now - job.started).total_seconds()
    return None if taken < 0 else taken * (job.total - ended) / done


def after(session: Session, job_id: str, number: int, limit: int) -> tuple[list[JobEvent], bool]:
    """Up to `limit` events after `number`, and whether they are the last ones before a retry."""
    # The job is read first: events in between only make the second value False.
    job = session.get(Job, job_id)
    query = select(JobEvent).where(JobEvent.job_id == job_id, JobEvent.number > number)
    found = list(session.scalars(query.order_by(JobEvent.number).limit(limit)))
    last = found[-1].number if found else number
    return found, job is None or (job.ended is not None and last >= job.events)
