"""A whole job as one document: requests and answers of its rows, for its report."""

from __future__ import annotations

import orjson
from sqlalchemy.orm import Session

from joulepath.app.convert.packed import unpacked
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.store import jobs

JOBS = "/jobs"
"""Begin of the path of a job."""


def job_document(session: Session, job_id: str, most: int) -> bytes:
    """The job as JSON: `name`, and `rows` with `index`, `kind`, `state`, `request`, `answer` and
    `problem`.

    Raises UnknownJob, or InvalidRequest for more than `most` requests.
    """
    job = jobs.view(session, job_id).job
    if job.total > most:
        msg = f"A report may have {most:,} requests: GET /jobs/{{id}}/results has all as a table."
        raise InvalidRequest([{"loc": ["body", "job"], "msg": msg}])
    rows = [
        {
            "index": row.number,
            "kind": row.kind,
            "state": row.state,
            "problem": row.problem,
            "request": orjson.Fragment(unpacked(row.body)),
            "answer": None if body is None else orjson.Fragment(unpacked(body)),
        }
        for row, body in jobs.whole(session, job_id)
    ]
    return orjson.dumps({"name": job.name, "rows": rows})
