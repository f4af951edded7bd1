"""Types of error about the request, the service or what it stores. A docstring is the text of the type's page."""

from __future__ import annotations

from typing import ClassVar, Literal

from joulepath.app.exceptions import StoreFault
from joulepath.app.schemas.common import Response, described, part
from joulepath.app.schemas.errors.problem_details import ProblemDetails, fixed


class FieldError(Response):
    """One error in the request."""

    loc: list[str | int] = described("Path of the field.", None, ["body", "start", "q"])
    msg: str = described("What is wrong with the field.", None, "List should have at least 1 item")


class Validation(ProblemDetails):
    """The request is malformed or contradicts itself. The body is no JSON, or a field is missing, unknown, of the wrong
    type or length, out of range, or not finite. Correct the fields in `errors` and send the request again."""

    type: Literal["/problems/validation"] = fixed("type", "/problems/validation")
    title: Literal["Invalid request"] = fixed("title", "Invalid request")
    status: Literal[422] = fixed("status", 422)
    errors: list[FieldError] = part("One entry per error; of more than 20 errors, the first ones.")


class Busy(ProblemDetails):
    """All workers are taken and the queue is full, too many requests of jobs wait, or the service has as many
    connections, or bytes of bodies and answers in flight, as it may. Try again after the time [s] in the header
    `Retry-After`."""

    retry_after: ClassVar[int | None] = 2
    type: Literal["/problems/busy"] = fixed("type", "/problems/busy")
    title: Literal["Busy"] = fixed("title", "Busy")
    status: Literal[503] = fixed("status", 503)


class TooManyRequests(ProblemDetails):
    """You have your share of the service: of requests in flight and waiting, of connections, or of bytes of bodies and
    answers in flight; `detail` says of which. Others are served meanwhile. Wait for your answers, read them, and send
    fewer requests at a time. Try again after the time [s] in the header `Retry-After`."""

    retry_after: ClassVar[int | None] = 2
    type: Literal["/problems/too-many-requests"] = fixed("type", "/problems/too-many-requests")
    title: Literal["Too many requests"] = fixed("title", "Too many requests")
    status: Literal[429] = fixed("status", 429)


class NotReady(ProblemDetails):
    """The workers are still starting, or all of them have ended and are being replaced: requests wait, and none is at
    work. Try again after the time [s] in the header `Retry-After`."""

    retry_after: ClassVar[int | None] = 2
    type: Literal["/problems/not-ready"] = fixed("type", "/problems/not-ready")
    title: Literal["Not ready"] = fixed("title", "Not ready")
    status: Literal[503] = fixed("status", 503)


class ShuttingDown(ProblemDetails):
    """The service is stopping and did not finish this request. Send it again after the time [s] in the header
    `Retry-After`: another instance, or the restarted one, answers."""

    retry_after: ClassVar[int | None] = 5
    type: Literal["/problems/shutting-down"] = fixed("type", "/problems/shutting-down")
    title: Literal["Shutting down"] = fixed("title", "Shutting down")
    status: Literal[503] = fixed("status", 503)


class StoreUnavailable(ProblemDetails):
    """The database of studies and answers cannot be reached, read or written; `cause` says why, and the service's log
    has more. Nothing of the request was stored. Requests that need no database, for example `POST /optimize`, still
    work. On a full disk, `DELETE` works, so that space can be freed. Try again after the time [s] in the header
    `Retry-After`."""

    retry_after: ClassVar[int | None] = 5
    type: Literal["/problems/store-unavailable"] = fixed("type", "/problems/store-unavailable")
    title: Literal["Database unavailable"] = fixed("title", "Database unavailable")
    status: Literal[503] = fixed("status", 503)
    cause: StoreFault = described(
        "`full`: no space is left. `read-only`: it takes no changes. `locked`: another process locks it. `deleted`: "
        "its file was deleted or replaced while the service ran. `unreachable`: it does not answer, or cannot be read.",
        None,
        "full",
    )


class UnknownAnswer(ProblemDetails):
    """No answer with this id is stored. It never existed, its study was deleted, or it was deleted to make space for
    newer answers. To get it again, repeat the request that produced it."""

    type: Literal["/problems/unknown-answer"] = fixed("type", "/problems/unknown-answer")
    title: Literal["Unknown answer"] = fixed("title", "Unknown answer")
    status: Literal[404] = fixed("status", 404)


class UnknownStudy(ProblemDetails):
    """No study has this id, or the study has no iteration with this number. It never existed, or the study was deleted.
    `GET /studies` lists all studies."""

    type: Literal["/problems/unknown-study"] = fixed("type", "/problems/unknown-study")
    title: Literal["Unknown study"] = fixed("title", "Unknown study")
    status: Literal[404] = fixed("status", 404)


class ClusterUnavailable(ProblemDetails):
    """The scheduler of the cluster that works on jobs cannot be reached, or does not have the same version of joulepath
    as the service, whose log says which. Jobs are accepted, and wait until it can be used. Requests that are answered
    at once are computed by the service itself. Try again after the time [s] in the header `Retry-After`."""

    retry_after: ClassVar[int | None] = 5
    type: Literal["/problems/cluster-unavailable"] = fixed("type", "/problems/cluster-unavailable")
    title: Literal["Cluster unavailable"] = fixed("title", "Cluster unavailable")
    status: Literal[503] = fixed("status", 503)


class UnknownJob(ProblemDetails):
    """No job has this id. It never existed, it was deleted, or it ended longer ago than jobs are kept. `GET /jobs`
    lists all jobs."""

    type: Literal["/problems/unknown-job"] = fixed("type", "/problems/unknown-job")
    title: Literal["Unknown job"] = fixed("title", "Unknown job")
    status: Literal[404] = fixed("status", 404)


class JobNotCancellable(ProblemDetails):
    """The job has ended, so that there is nothing left to cancel. Its answers stay until it is deleted with
    `DELETE /jobs/{id}`."""

    type: Literal["/problems/job-not-cancellable"] = fixed("type", "/problems/job-not-cancellable")
    title: Literal["Job not cancellable"] = fixed("title", "Job not cancellable")
    status: Literal[409] = fixed("status", 409)


class WorkerDied(ProblemDetails):
    """Each of the three processes that worked on this request of a job died, for example because it ran out of memory.
    The service does not try it again by itself. Make the request smaller, and send it again; if that does not help,
    please report it with the value of `instance`."""

    type: Literal["/problems/worker-died"] = fixed("type", "/problems/worker-died")
    title: Literal["Worker died"] = fixed("title", "Worker died")
    status: Literal[500] = fixed("status", 500)


class WorkerLost(ProblemDetails):
    """Two processes that worked on this request died, one after the other, most often because the machine ran out of
    memory. The service does not try it a third time by itself. Try again after the time [s] in the header
    `Retry-After`; if that does not help, make the request smaller, or report it with the value of `instance`."""

    retry_after: ClassVar[int | None] = 5
    type: Literal["/problems/worker-lost"] = fixed("type", "/problems/worker-lost")
    title: Literal["Worker lost"] = fixed("title", "Worker lost")
    status: Literal[503] = fixed("status", 503)


class EmptyStudy(ProblemDetails):
    """The request needs an iteration of the study, but the study has none. Add one with
    `POST /studies/{id}/iterations`."""

    type: Literal["/problems/empty-study"] = fixed("type", "/problems/empty-study")
    title: Literal["Empty study"] = fixed("title", "Empty study")
    status: Literal[409] = fixed("status", 409)


class RobotExists(ProblemDetails):
    """The name of the robot is taken. Use another name, or `PUT /robots/{name}` to replace a robot that was added. The
    robots that come with the service can be neither replaced nor deleted."""

    type: Literal["/problems/robot-exists"] = fixed("type", "/problems/robot-exists")
    title: Literal["Robot exists"] = fixed("title", "Robot exists")
    status: Literal[409] = fixed("status", 409)


class TooManyRobots(ProblemDetails):
    """The service holds as many added robots as `JOULEPATH_MAX_ROBOTS` allows. Delete one that is not used with
    `DELETE /robots/{name}`."""

    type: Literal["/problems/too-many-robots"] = fixed("type", "/problems/too-many-robots")
    title: Literal["Too many robots"] = fixed("title", "Too many robots")
    status: Literal[409] = fixed("status", 409)


class KeyReused(ProblemDetails):
    """This `Idempotency-Key` was already used for a different request. A key belongs to one request and its
    repetitions: use a new key for each new request."""

    type: Literal["/problems/key-reused"] = fixed("type", "/problems/key-reused")
    title: Literal["Idempotency-Key reused"] = fixed("title", "Idempotency-Key reused")
    status: Literal[422] = fixed("status", 422)


class Unauthenticated(ProblemDetails):
    """The service needs an API key, and the request has none, or one that is not valid. Send the key in the header
    `Authorization: Bearer KEY`. The operator of the service makes keys with `joulepath keys add`. A key that was
    removed is no longer valid."""

    type: Literal["/problems/unauthenticated"] = fixed("type", "/problems/unauthenticated")
    title: Literal["API key needed"] = fixed("title", "API key needed")
    status: Literal[401] = fixed("status", 401)


class RoleTooLow(ProblemDetails):
    """The API key may not do this. A key of the role `read` may look at everything, `compute` may also compute and
    create, and change what it created, and `admin` may change everything."""

    type: Literal["/problems/role-too-low"] = fixed("type", "/problems/role-too-low")
    title: Literal["Role too low"] = fixed("title", "Role too low")
    status: Literal[403] = fixed("status", 403)
    role: Literal["read", "compute", "admin"] = described("Role of the API key.", None, "read")
    needed: Literal["read", "compute", "admin"] = described("Role that the request needs.", None, "compute")


class NotOwner(ProblemDetails):
    """Another client created this study, robot or answer. Only the client that created it, or an API key of the role
    `admin`, may change or delete it. What was created while the service had no API keys has no owner."""

    type: Literal["/problems/not-owner"] = fixed("type", "/problems/not-owner")
    title: Literal["Not the owner"] = fixed("title", "Not the owner")
    status: Literal[403] = fixed("status", 403)
    owner: str | None = described("Name of the API key that created it; null without one.", None, "press_shop")


class AnswerInUse(ProblemDetails):
    """The answer belongs to a study or a job, which refers to it. It is deleted with that: `DELETE /studies/{id}` or
    `DELETE /jobs/{id}`."""

    type: Literal["/problems/answer-in-use"] = fixed("type", "/problems/answer-in-use")
    title: Literal["Answer in use"] = fixed("title", "Answer in use")
    status: Literal[409] = fixed("status", 409)


class CrossSite(ProblemDetails):
    """A browser sent this request for a web page of another site (headers `Origin` and `Sec-Fetch-Site`). The service
    refuses this, because any page that a user opens could otherwise post and delete. The operator can allow a page's
    origin with `JOULEPATH_CORS_ORIGINS`. A reverse proxy must pass on the header `Host`."""

    type: Literal["/problems/cross-site"] = fixed("type", "/problems/cross-site")
    title: Literal["Cross-site request"] = fixed("title", "Cross-site request")
    status: Literal[403] = fixed("status", 403)


class WrongHost(ProblemDetails):
    """The name in the header `Host` is none of the service's names. The service refuses this, because a web page could
    otherwise give a name of its own the service's address, and read everything (DNS rebinding). Use the service's
    address, or a name that the operator allows with `JOULEPATH_ALLOWED_HOSTS`."""

    type: Literal["/problems/wrong-host"] = fixed("type", "/problems/wrong-host")
    title: Literal["Wrong host"] = fixed("title", "Wrong host")
    status: Literal[421] = fixed("status", 421)


class NotFound(ProblemDetails):
    """The service has nothing at this path. `GET /openapi.json` lists all paths."""

    type: Literal["/problems/not-found"] = fixed("type", "/problems/not-found")
    title: Literal["Not found"] = fixed("title", "Not found")
    status: Literal[404] = fixed("status", 404)


class MethodNotAllowed(ProblemDetails):
    """This path does not support the HTTP method of the request. Use one of the methods in the header `Allow`."""

    type: Literal["/problems/method-not-allowed"] = fixed("type", "/problems/method-not-allowed")
    title: Literal["Method not allowed"] = fixed("title", "Method not allowed")
    status: Literal[405] = fixed("status", 405)


class BodyTooLarge(ProblemDetails):
    """The body exceeds the service's limit. A normal request needs a few kilobytes. Motions sent to `POST /evaluate`
    may be about a thousand times larger. If yours is too large, send fewer samples."""

    type: Literal["/problems/body-too-large"] = fixed("type", "/problems/body-too-large")
    title: Literal["Body too large"] = fixed("title", "Body too large")
    status: Literal[413] = fixed("status", 413)


class HeadTooLarge(ProblemDetails):
    """The request's line and headers exceed `JOULEPATH_MAX_HEAD_BYTES`. Requests to this service need few headers:
    leave out cookies and headers that it does not use. The connection is closed."""

    type: Literal["/problems/head-too-large"] = fixed("type", "/problems/head-too-large")
    title: Literal["Request head too large"] = fixed("title", "Request head too large")
    status: Literal[431] = fixed("status", 431)


class RequestTimeout(ProblemDetails):
    """The request did not arrive in time: its line and headers within `JOULEPATH_HEAD_TIMEOUT`, its body within
    `JOULEPATH_BODY_TIMEOUT`. Send it again, over a faster connection or with a smaller body."""

    type: Literal["/problems/request-timeout"] = fixed("type", "/problems/request-timeout")
    title: Literal["Request not received in time"] = fixed("title", "Request not received in time")
    status: Literal[408] = fixed("status", 408)


class UnsupportedMediaType(ProblemDetails):
    """The header `Content-Type` declares a body that this path does not take. JSON is `application/json`; the CSV of
    `POST /evaluate` and `POST /logs` is `text/csv`. `text/plain`, a form, and no header at all are read as JSON, too,
    where a path takes JSON. The body is the document itself: `curl --data-binary @file`, not `curl -F file=@file`."""

    type: Literal["/problems/unsupported-media-type"] = fixed("type", "/problems/unsupported-media-type")
    title: Literal["Unsupported media type"] = fixed("title", "Unsupported media type")
    status: Literal[415] = fixed("status", 415)


class UnsupportedCoding(ProblemDetails):
    """The header `Content-Encoding` names a coding that the service cannot unpack, or several at once. Pack the body
    with `gzip`, `deflate` or `zstd`, or send it as it is, without this header."""

    type: Literal["/problems/unsupported-coding"] = fixed("type", "/problems/unsupported-coding")
    title: Literal["Unsupported content coding"] = fixed("title", "Unsupported content coding")
    status: Literal[415] = fixed("status", 415)


class MalformedHttp(ProblemDetails):
    """What arrived at the port is no HTTP/1.1 request, or contradicts itself: a TLS handshake, a request line or header
    with other characters, two lengths of the body, or a chunk without a length. The service closes the connection.
    Speak HTTP to this port, or HTTPS to the proxy before it."""

    type: Literal["/problems/malformed-http"] = fixed("type", "/problems/malformed-http")
    title: Literal["Malformed HTTP"] = fixed("title", "Malformed HTTP")
    status: Literal[400] = fixed("status", 400)


class NotAcceptable(ProblemDetails):
    """The header `Accept-Encoding` allows no coding in which the service could answer: it has `zstd`, `gzip` and
    `identity`, which is no coding. Allow one of them, or leave the header out. Nothing was computed."""

    type: Literal["/problems/not-acceptable"] = fixed("type", "/problems/not-acceptable")
    title: Literal["No acceptable coding"] = fixed("title", "No acceptable coding")
    status: Literal[406] = fixed("status", 406)


class Internal(ProblemDetails):
    """A defect of the service. The log has an entry with the id of the request. Please report the defect with the value
    of `instance`."""

    type: Literal["/problems/internal"] = fixed("type", "/problems/internal")
    title: Literal["Internal error"] = fixed("title", "Internal error")
    status: Literal[500] = fixed("status", 500)
