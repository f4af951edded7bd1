"""Validation of the body of a job, in a worker: it may have ten thousand requests."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import ValidationError

from joulepath.app.convert.json_text import parsed_json, sent
from joulepath.app.convert.packed import packed
from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.base import FieldError, InvalidRequest
from joulepath.app.http.problems import MOST_ERRORS, invalid_request
from joulepath.app.schemas.common import Request
from joulepath.app.schemas.deadline import given_deadline, too_long
from joulepath.app.schemas.jobs import KINDS
from joulepath.app.schemas.jobs import NewJob as JobModel
from joulepath.app.settings import Settings
from joulepath.app.store.jobs import NewJob, NewRequest
from joulepath.app.tasks.request_key import meaning_of


@dataclass(frozen=True)
class Deadlines:
    """Longest deadline [s] of a request, and the default deadline."""

    longest: float
    without: float

    @classmethod
    def of(cls, settings: Settings) -> Deadlines:
        """The deadlines of a service."""
        longest = settings.max_job_deadline
        return cls(longest, min(settings.max_deadline, longest))


@dataclass(frozen=True)
class Validated(TaskResult):
    """A valid job. Its document is empty."""

    job: NewJob = field(kw_only=True)


@dataclass(frozen=True)
class JobBodyTask:
    """The JSON body of `POST /jobs` in `file`; `fresh`: the answers of equal requests do not do."""

    file: str
    deadlines: Deadlines
    request_id: str
    fresh: bool

    def run(self, deadline: float) -> TaskResult:
        """The job. Raises InvalidRequest."""
        content = parsed_json(Path(self.file).read_bytes())
        try:
            asked = JobModel.model_validate(content)
        except ValidationError as error:
            raise invalid_request(error, "body") from None
        job = _job(asked, self.deadlines, self.fresh)
        return Validated(b"", "application/json", job=job)


def job_of_one(kind: str, asked: Request, deadlines: Deadlines) -> NewJob:
    """A validated request as a job, for which the answer of an equal one does not do. Raises
    InvalidRequest if its deadline is too long."""
    if wrong := too_long(given_deadline(asked), deadlines.longest, "body"):
        raise InvalidRequest(wrong)
    requests = [_new_request(kind, asked, deadlines, fresh=True)]
    return NewJob(requests, _fingerprint(requests, "one"))


def _job(asked: JobModel, deadlines: Deadlines, fresh: bool) -> NewJob:
    wrong: list[FieldError] = []
    requests = []
    for index, each in enumerate(asked.requests):
        kind = next(kind for kind in KINDS if hasattr(each, kind))
        request: Request = getattr(each, kind)
        where = ("body", "requests", index, kind)
        wrong += too_long(given_deadline(request), deadlines.longest, *where)
        requests.append(_new_request(kind, request, deadlines, fresh, each.name))
    if wrong:
        raise InvalidRequest(wrong[:MOST_ERRORS])
    told_apart_by = f"{asked.keep_going} {asked.name}"
    return NewJob(requests, _fingerprint(requests, told_apart_by), asked.name, asked.keep_going)


def _new_request(
    kind: str, asked: Request, deadlines: Deadlines, fresh: bool, name: str | None = None
) -> NewRequest:
    given = getattr(asked, "deadline", None)
    deadline = min(deadlines.without if given is None else given, deadlines.longest)
    meaning = None if fresh else meaning_of(kind, asked)
    return NewRequest(kind, packed(sent(asked)), deadline, meaning, name)


def _fingerprint(requests: Iterable[NewRequest], rest: str) -> str:
    digest = hashlib.sha256(rest.encode())
    for each in requests:
        digest.update(f"\0{each.kind}\0{each.name}\0{len(each.body)}\0".encode() + each.body)
    return digest.hexdigest()
