"""The service's own errors. How each looks over HTTP is in `app.http.problem_details`.

ServiceError
├── InvalidRequest      the request does not fit the schema
├── Busy                the queue is full
│   ├── TooManyConnections, TooManyBytes          so is what the service holds in all
│   ├── TooManyWaiting                            too many requests of jobs wait
│   └── TooManyRequests     the client has its share of the queue
│       └── TooManyConnectionsOfClient, TooManyBytesOfClient
├── NotReady            no worker is warm
├── ShuttingDown        the service stops before the request is done
├── WorkerDied          the worker process ended during the task
├── TaskFailed          the task raised an unforeseen exception
├── StoreUnavailable    the database cannot be reached, read or written
├── UnknownAnswer       no stored answer has that id
├── UnknownStudy        no study has that id
│   └── UnknownIteration
├── UnknownJob          no job has that id
├── JobNotCancellable   the job has ended
├── TooManyDeaths       the request ended its worker process again and again
├── EmptyStudy          the study has no iteration yet
├── RobotExists         the name of a robot is taken
├── TooManyRobots       the service holds as many robots of users as it may
├── KeyReused           the Idempotency-Key was used for a different request
├── NoKey               the request needs an API key
│   └── WrongKey        its API key is not valid
├── RoleTooLow          its API key may not do that
├── NotOwner            another client created the thing
├── AnswerInUse         the answer belongs to a study
├── CrossSite           a web page of another site sent the request
├── WrongHost           the request is for another host
├── HeadTooLarge        line and headers of the request are larger than the limit
├── RequestTimeout      the request did not arrive in time
└── NotFound, MethodNotAllowed, BodyTooLarge, UnsupportedMediaType, UnsupportedCoding, NotAcceptable, MalformedHttp
"""

from __future__ import annotations

import copyreg
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal


class ServiceError(Exception):
    """Base of the service's own errors; the message is one sentence that says what to do."""

    MESSAGE: ClassVar[str]

    def __init__(self) -> None:
        super().__init__(self.MESSAGE)

    def __reduce__(self) -> tuple[Any, ...]:
        # the default calls the constructor with the message, but the constructors take data or nothing
        return copyreg.__newobj__, (type(self), *self.args), vars(self)  # type: ignore[attr-defined]


class InvalidRequest(ServiceError):
    """The request does not fit the schema; `errors` has one entry {loc, msg} per fault."""

    MESSAGE = "Correct the fields listed under `errors`."

    def __init__(self, errors: Sequence[Mapping[str, Any]]) -> None:
        super().__init__()
        self.errors = list(errors)


class Busy(ServiceError):
    """The queue is full."""

    MESSAGE = "All workers are busy and the queue is full: try again after a few seconds."


class TooManyConnections(Busy):
    """The service has as many connections as it may."""

    MESSAGE = "The service has as many connections as it may: try again after a few seconds."


class TooManyBytes(Busy):
    """Bodies and answers in flight have as many bytes as the service may hold."""

    MESSAGE = "The service holds as many bytes of requests and answers as it may: try again after a few seconds."


class TooManyRequests(Busy):
    """The client has its share of the queue."""

    MESSAGE = (
        "You have as many requests in flight as one client may: wait for their answers before you send more, or send "
        "them one after another."
    )


class TooManyConnectionsOfClient(TooManyRequests):
    """The client has as many connections, or requests ahead of their answers, as it may."""

    MESSAGE = (
        "You have as many connections, or as many requests ahead on one of them, as one client may: close those that "
        "you do not need, and use one for several requests, one after another."
    )


class TooManyBytesOfClient(TooManyRequests):
    """The client's bodies and answers in flight have as many bytes as one client may."""

    MESSAGE = (
        "The bodies and answers of your requests in flight have as many bytes as one client may: wait for their "
        "answers, read them, and send fewer at a time."
    )


class TooManyWaiting(Busy):
    """Too many requests of jobs wait."""

    MESSAGE = "Too many requests of jobs wait: send this job again when others have ended, or send a smaller one."


class NotReady(ServiceError):
    """No worker is warm."""

    MESSAGE = "The workers are warming up: try again after a few seconds."


class ShuttingDown(ServiceError):
    """The service stops before the request is done."""

    MESSAGE = "The service is stopping: send the request again."


class WorkerDied(ServiceError):
    """The worker process ended during the task."""

    MESSAGE = "The process that worked on this request died: report it with the id in `instance`."


class TaskFailed(ServiceError):
    """The task raised an unforeseen exception; the worker's log has it with the request's id."""

    MESSAGE = "This is a defect of the service: report it with the id in `instance`."


StoreFault = Literal["full", "read-only", "locked", "deleted", "unreachable"]
"""What is wrong with the database."""


class StoreUnavailable(ServiceError):
    """The database cannot be reached, read or written; the log has the driver's words."""

    MESSAGES: ClassVar[dict[StoreFault, str]] = {
        "full": "The disk of the database is full: delete studies that are not needed, or enlarge the disk. Deleting "
        "works.",
        "read-only": "The database is read-only: reading works, and the operator of the service must make it writable.",
        "locked": "Another process locks the database: try again later, or ask the operator of the service to end that "
        "process.",
        "deleted": "The file of the database was deleted or replaced: the operator of the service must put it back, or "
        "restart the service, which then begins an empty one.",
        "unreachable": "The database does not answer: try again later, or ask the operator of the service.",
    }

    def __init__(self, cause: StoreFault) -> None:
        Exception.__init__(self, self.MESSAGES[cause])
        self.cause = cause


class UnknownAnswer(ServiceError):
    """No stored answer has that id."""

    MESSAGE = "No stored answer has this id: send the request that produced the answer again."


class UnknownStudy(ServiceError):
    """No study has that id."""

    MESSAGE = "No study has this id: GET /studies lists all studies."


class UnknownIteration(UnknownStudy):
    """The study has no iteration of that number."""

    MESSAGE = "The study has no iteration of this number: GET /studies/{id} lists its iterations."


class UnknownJob(ServiceError):
    """No job has that id."""

    MESSAGE = "No job has this id: GET /jobs lists all jobs."


class JobNotCancellable(ServiceError):
    """The job has ended."""

    MESSAGE = "The job has ended: there is nothing left to cancel. DELETE /jobs/{id} deletes it with its answers."


class TooManyDeaths(ServiceError):
    """The request ended its worker process again and again."""

    MESSAGE = (
        "Each process that worked on this request died: make the request smaller, or report it with the id in "
        "`instance`."
    )


class EmptyStudy(ServiceError):
    """The study has no iteration that suggestions could start from."""

    MESSAGE = "The study has no iteration yet: add a first iteration, then ask for suggestions."


class RobotExists(ServiceError):
    """The name of a robot is taken, or is that of a robot that comes with the service."""

    MESSAGE = (
        "A robot has this name: use another one. PUT replaces a robot that was added; the robots that come with the "
        "service cannot be changed or deleted."
    )


class TooManyRobots(ServiceError):
    """The service holds as many robots of users as it may."""

    MESSAGE = "The service holds as many added robots as it may: delete one that is not used."


class KeyReused(ServiceError):
    """The Idempotency-Key was used for a different request."""

    MESSAGE = "This Idempotency-Key was already used for a different request: use a new key for each new request."


class NoKey(ServiceError):
    """The request needs an API key and has none."""

    MESSAGE = "This service needs an API key: send it in the header Authorization, as `Bearer KEY`."


class WrongKey(NoKey):
    """The API key of the request is not valid, or no longer."""

    MESSAGE = "This API key is not valid: check it, or ask the operator of the service for a new one."


class RoleTooLow(ServiceError):
    """The API key has the role `role`, and the request needs `needed`."""

    def __init__(self, role: str, needed: str) -> None:
        Exception.__init__(self, f"Your API key has the role {role}, and this needs {needed}: use a key of that role.")
        self.role, self.needed = role, needed


class NotOwner(ServiceError):
    """The thing was created by the client `owner`, or while access was open (None)."""

    def __init__(self, owner: str | None) -> None:
        whose = "nobody with a key" if owner is None else f"another client, {owner},"
        Exception.__init__(
            self, f"This was created by {whose} and only its owner or an admin may change it: use such a key."
        )
        self.owner = owner


class AnswerInUse(ServiceError):
    """The answer belongs to a study, whose history refers to it."""

    MESSAGE = "This answer belongs to a study: delete the study."


class CrossSite(ServiceError):
    """A web page of another site sent the request."""

    MESSAGE = (
        "A web page of another site sent this request: call the service from its own pages or without a browser, or "
        "have the page's origin added to JOULEPATH_CORS_ORIGINS."
    )


class WrongHost(ServiceError):
    """The header Host names another host than this one."""

    MESSAGE = (
        "The name in the header Host is none of this service: use its address, or have the name added to "
        "JOULEPATH_ALLOWED_HOSTS."
    )


class NotFound(ServiceError):
    """The path does not exist."""

    MESSAGE = "This path does not exist: GET /openapi.json lists all paths."


class MethodNotAllowed(ServiceError):
    """The path does not accept the HTTP method."""

    MESSAGE = "This path does not accept this HTTP method: use one from the Allow header."


class BodyTooLarge(ServiceError):
    """The body is larger than the limit."""

    MESSAGE = "The body is larger than the service accepts: send a smaller body."


class HeadTooLarge(ServiceError):
    """Line and headers of the request are larger than the limit [byte]."""

    MESSAGE = "The line and the headers of the request are too large."

    def __init__(self, most: int) -> None:
        super().__init__()
        self.args = (f"The line and the headers of the request have more than {most} bytes: send shorter ones.",)


class RequestTimeout(ServiceError):
    """The request did not arrive within the limit [s]."""

    MESSAGE = "The request did not arrive in time."

    def __init__(self, most: float) -> None:
        super().__init__()
        self.args = (
            f"The request did not arrive whole within {most:g} s: send it again, over a faster connection or with a "
            "smaller body.",
        )


class UnsupportedMediaType(ServiceError):
    """The path does not accept the media type of the body."""

    MESSAGE = (
        "The header Content-Type declares something else than this path takes: send JSON as application/json, and to "
        "POST /evaluate also CSV as text/csv. The body is the document itself, not a form with a file."
    )


class UnsupportedCoding(ServiceError):
    """The body is packed in a way that the service cannot unpack."""

    MESSAGE = "The header Content-Encoding names something else than gzip or deflate: use one of them, or none."


class MalformedHttp(ServiceError):
    """What arrived is no HTTP."""

    MESSAGE = (
        "What arrived is no HTTP/1.1 request: check the address and that the client speaks HTTP, not HTTPS, to this "
        "port, and the request line, the headers and the chunks of the body."
    )


class NotAcceptable(ServiceError):
    """The header `Accept-Encoding` allows no coding that the service has."""

    MESSAGE = "The header Accept-Encoding excludes all of zstd, gzip and identity: allow one of them."


class ClientDisconnected(Exception):
    """The client closed the connection: nobody is left to answer."""


class Preempted(Exception):
    """Work that can wait had to give its worker to a caller that waits: it is to be run again."""
