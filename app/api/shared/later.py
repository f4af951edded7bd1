"""`Prefer: respond-async` (RFC 7240): the request becomes a job, and its answer is fetched
later."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Any

import orjson
from fastapi import Depends, Header, Request, Response

from joulepath.app.api.shared.dependencies import ServiceJobs, ServiceSettings
from joulepath.app.api.shared.parameters import CREATED_HEADERS, Key, is_fresh, set_location
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.convert.packed import unpacked
from joulepath.app.http.handlers import PROBLEM_MEDIA_TYPE
from joulepath.app.jobs.answers import summary
from joulepath.app.schemas.common import Request as RequestModel
from joulepath.app.schemas.jobs import Job
from joulepath.app.store import jobs as stored_jobs
from joulepath.app.store.jobs import NewJob
from joulepath.app.tasks.job_body import Deadlines, JobBodyTask, JobOfOneTask, Validated, job_of_one
from joulepath.app.tasks.read_body import HeldBody

ACCEPTED: dict[int | str, dict[str, Any]] = {
    202: {
        "model": Job,
        "description": "With `Prefer: respond-async`: the request is a job, at the path in "
        "`Location`.",
        "headers": {
            **CREATED_HEADERS,
            "Preference-Applied": {"description": "`respond-async`.", "schema": {"type": "string"}},
        },
    }
}
"""The response of an endpoint to a request that becomes a job."""

_PREFER = Header(
    alias="Prefer",
    description="`respond-async`: the request becomes a job, see `POST /jobs`, and the status is "
    "202. With "
    "`respond-async, wait=5`, the answer comes with 200 if it is there within 5 s. Anything else "
    "has no effect.",
    examples=["respond-async"],
)


@dataclass(frozen=True)
class Later:
    """Preference of the client for a response now or later."""

    wanted: bool
    """Whether the client prefers an asynchronous response."""
    wait: int
    """Time for which the response waits for the answer [s]."""
    jobs: ServiceJobs
    tasks: ServiceTasks
    key: str | None

    async def respond(self, kind: str, asked: RequestModel | HeldBody) -> Response:
        """Create a job of one validated request, and respond to the request.

        Args:
            kind: the endpoint.
            asked: the request.

        Returns:
            The answer if it is there within `wait`, else the job with the status 202.

        Raises:
            InvalidRequest: the request is malformed.
            KeyReused: another request had the same idempotency key.
            TooManyWaiting: too many requests wait already.
            StoreUnavailable: the store cannot be read or written.
        """
        longest = deadlines(self.jobs.settings)
        fresh = is_fresh(self.tasks.request)
        if isinstance(asked, HeldBody):
            new = await self.validated(
                JobOfOneTask(kind, asked, longest, self.tasks.request_id, fresh)
            )
        else:
            new = job_of_one(kind, asked, longest, fresh)
        return await self.respond_with(new)

    async def validated(self, task: JobBodyTask | JobOfOneTask) -> NewJob:
        """Validate a body in a worker.

        Returns:
            The new job.

        Raises:
            InvalidRequest: the body is malformed; further errors as of `Engine.run`.
        """
        result = await self.tasks.result(task)
        assert isinstance(result, Validated)
        return result.job

    async def respond_with(self, new: NewJob) -> Response:
        """Create a job, and respond to its request; errors as of `respond`."""
        job_id, again = await self.jobs.create(new, self.key, self.tasks.client.owner)
        view = await self.jobs.ended(job_id, self.wait)
        if self.wait and view.job.ended is not None:
            response = await self._ended(job_id)
            applied = f"wait={self.wait}"
        else:
            content = Job(**summary(view)).model_dump_json()
            response = Response(content, 202, media_type="application/json")
            applied = "respond-async" + (f", wait={self.wait}" if self.wait else "")
        response.headers["Preference-Applied"] = applied
        set_location(self.tasks.request, response, f"/jobs/{job_id}", again)
        return response

    async def _ended(self, job_id: str) -> Response:
        """Answer or problem of an ended job of one request."""
        request, body = await self.jobs.store.read(
            lambda session: stored_jobs.outcome(session, job_id, 0)
        )
        if body is not None:
            return Response(unpacked(body), media_type="application/json")
        if request.problem is None:  # somebody cancelled it meanwhile
            view = await self.jobs.view(job_id)
            return Response(
                Job(**summary(view)).model_dump_json(), 202, media_type="application/json"
            )
        content = orjson.dumps(request.problem | {"instance": self.tasks.request_id})
        return Response(content, request.problem["status"], media_type=PROBLEM_MEDIA_TYPE)


def deadlines(settings: ServiceSettings) -> Deadlines:
    """Deadlines of the requests of jobs."""
    return Deadlines(
        settings.max_job_deadline, min(settings.max_deadline, settings.max_job_deadline)
    )


async def _later(
    request: Request,
    jobs: ServiceJobs,
    tasks: ServiceTasks,
    prefer: Annotated[str | None, _PREFER] = None,
    key: Key = None,
) -> Later:
    given = ", ".join(request.headers.getlist("prefer")) if prefer is not None else ""
    preferences = {text.partition(";")[0].replace(" ", "").lower() for text in given.split(",")}
    waits = [
        int(found[1])
        for text in preferences
        if (found := re.fullmatch(r'wait="?([0-9]{1,9})"?', text))
    ]
    longest = int(jobs.settings.max_deadline)
    wanted = "respond-async" in preferences
    return Later(wanted, min(*waits, longest) if waits else 0, jobs, tasks, key)


ServiceLater = Annotated[Later, Depends(_later)]
