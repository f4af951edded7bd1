"""The service's own errors. How each looks over HTTP is in `app.http.problem_details`.

ServiceError
├── InvalidRequest      the request does not fit the schema
├── Busy                the queue is full
├── NotReady            no worker is warm
├── ShuttingDown        the service stops before the request is done
├── WorkerDied          the worker process ended during the task
├── TaskFailed          the task raised an unforeseen exception
├── StoreUnavailable    the database cannot be reached
├── UnknownAnswer       no stored answer has that id
├── UnknownStudy        no study has that id
│   └── UnknownIteration
├── EmptyStudy          the study has no iteration yet
├── RobotExists         the name of a robot is taken
├── TooManyRobots       the service holds as many robots of users as it may
├── KeyReused           the Idempotency-Key was used for a different request
└── NotFound, MethodNotAllowed, BodyTooLarge, UnsupportedMediaType
"""

from __future__ import annotations

import copyreg
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar


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


class StoreUnavailable(ServiceError):
    """The database cannot be reached, read or written; the log has the cause."""

    MESSAGE = "The database does not answer: try again later, or ask the operator of the service."


class UnknownAnswer(ServiceError):
    """No stored answer has that id."""

    MESSAGE = "No stored answer has this id: send the request that produced the answer again."


class UnknownStudy(ServiceError):
    """No study has that id."""

    MESSAGE = "No study has this id: GET /studies lists all studies."


class UnknownIteration(UnknownStudy):
    """The study has no iteration of that number."""

    MESSAGE = "The study has no iteration of this number: GET /studies/{id} lists its iterations."


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


class NotFound(ServiceError):
    """The path does not exist."""

    MESSAGE = "This path does not exist: GET /openapi.json lists all paths."


class MethodNotAllowed(ServiceError):
    """The path does not accept the HTTP method."""

    MESSAGE = "This path does not accept this HTTP method: use one from the Allow header."


class BodyTooLarge(ServiceError):
    """The body is larger than the limit."""

    MESSAGE = "The body is larger than the service accepts: send a smaller body."


class UnsupportedMediaType(ServiceError):
    """The path does not accept the media type of the body."""

    MESSAGE = "This path takes JSON or CSV: declare the body as application/json or text/csv."


class ClientDisconnected(Exception):
    """The client closed the connection: nobody is left to answer."""
