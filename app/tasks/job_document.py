"""A whole job as one document: requests and answers of its rows, for its report."""

from __future__ import annotations

import orjson
from sqlalchemy.orm import Session

from joulepath.app.convert.packed import unpacked
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.store import jobs

JOBS = "/jobs"
"""Begin of the path of a job."""
LARGEST_DOCUMENT = 64_000_000
"""Largest document [byte]. The service holds it twice, and a worker parsed, some 500 MB: with
answers to short motions, of 50 kB each, these are 1,300 requests."""


def job_document(session: Session, job_id: str, most: int) -> bytes:
    """The job as JSON: `name`, and `rows` with `index`, `name`, `kind`, `state`, `request`,
    `answer` and `problem`.

    Raises UnknownJob, or InvalidRequest for more than `most` requests or `LARGEST_DOCUMENT`.
    """
    job = jobs.view(session, job_id).job
    if job.total > most:
        raise _too_large(f"{most:,} requests")
    rows, left = [], LARGEST_DOCUMENT
    for row, body in jobs.whole(session, job_id):
        request, answer = unpacked(row.body), None if body is None else unpacked(body)
        left -= len(request) + len(answer or b"")
        if left < 0:
            raise _too_large(f"{LARGEST_DOCUMENT / 1e6:.0f} MB of requests and answers")
        rows.append(
            {
                "index": row.number,
                "name": row.name,
                "kind": row.kind,
                "state": row.state,
                "problem": row.problem,
                "request": orjson.Fragment(request),
                "answer": None if answer is None else orjson.Fragment(answer),
            }
        )
    return orjson.dumps({"name": job.name, "rows": rows})


def _too_large(limit: str) -> InvalidRequest:
    msg = f"A report may have {limit}: GET /jobs/{{id}}/results has all as a table."
    return InvalidRequest([{"loc": ["body", "job"], "msg": msg}])
