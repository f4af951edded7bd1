"""From exceptions to problems: one table, and the bytes that go out. Used by the service and by its workers alike.

ServiceError
├── InvalidRequest      does not fit the schema
├── Busy                the queue is full
├── NotReady            no worker is warm
├── ShuttingDown        given up because the service stops
├── WorkerDied          its worker process ended under it
├── StoreUnavailable    the database cannot be reached
├── UnknownAnswer       no answer is kept under that id
├── UnknownStudy        no study has that id
│   └── UnknownIteration
├── EmptyStudy          the study has no iteration yet
├── KeyReused           the Idempotency-Key came with another request before
└── NotFound, MethodNotAllowed, BodyTooLarge, UnsupportedMediaType
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import orjson

from app.convert import candidate_fields, fields, unreachable_fields
from app.schemas import problems
from app.schemas.common import KEY_HEADER
from app.schemas.common import Request as RequestModel
from optimizer import exceptions as optimizer_errors

MOST_ERRORS = 20
"""A body can be wrong in thousands of places; the first few tell enough."""


class ServiceError(Exception):
    """Base of the service's own errors; the message is one sentence that says what to do."""


class InvalidRequest(ServiceError):
    """The request does not fit the schema; `errors` holds {loc, msg} each."""

    def __init__(self, errors: Sequence[Mapping[str, Any]]) -> None:
        super().__init__("Correct the fields listed under `errors`.")
        self.errors = list(errors)

    @classmethod
    def by_pydantic(cls, errors: Sequence[Any], *where: str) -> InvalidRequest:
        """From pydantic's errors; `where` goes before their locations.

        Location and message only: pydantic's `input` repeats what was sent, and so may a location that is no field.
        """
        known = _field_names()
        return cls(
            [
                {
                    "loc": [*where, *(part for part in error["loc"] if isinstance(part, int) or part in known)],
                    "msg": error["msg"],
                }
                for error in errors[:MOST_ERRORS]
            ]
        )


@cache
def _field_names() -> set[str]:
    def names(model: type[RequestModel]) -> set[str]:
        return set(model.model_fields).union(*(names(child) for child in model.__subclasses__()))

    return names(RequestModel) | {"body", "path", "query", "header", KEY_HEADER}


class Busy(ServiceError):
    """The queue is full."""

    def __init__(self) -> None:
        super().__init__("Every worker is taken and the queue is full: try again after a few seconds.")


class NotReady(ServiceError):
    """No worker is warm."""

    def __init__(self) -> None:
        super().__init__("The workers are warming up: try again after a few seconds.")


class ShuttingDown(ServiceError):
    """The service stops before the request is done."""

    def __init__(self) -> None:
        super().__init__("The service is stopping: send the request again.")


class WorkerDied(ServiceError):
    """A worker process ended while it worked on the request."""

    def __init__(self) -> None:
        super().__init__("The process that worked on this request died: report it with the id in `instance`.")


class StoreUnavailable(ServiceError):
    """The database cannot be reached, read or written; the log says why."""

    def __init__(self) -> None:
        super().__init__("The database does not answer: try again later, or ask whoever runs the service.")


class UnknownAnswer(ServiceError):
    """No answer is kept under that id."""

    def __init__(self) -> None:
        super().__init__("No answer is kept under this id: send the request that gave it again.")


class UnknownStudy(ServiceError):
    """No study has that id."""

    def __init__(self, detail: str = "No study has this id: see GET /studies for those there are.") -> None:
        super().__init__(detail)


class UnknownIteration(UnknownStudy):
    """The study has no iteration of that number."""

    def __init__(self) -> None:
        super().__init__("The study has no iteration of this number: see its history for those there are.")


class EmptyStudy(ServiceError):
    """The study has no iteration that a next one could start from."""

    def __init__(self) -> None:
        super().__init__("The study has no iteration yet: add a first one, then ask for the next.")


class KeyReused(ServiceError):
    """The Idempotency-Key came with another request before."""

    def __init__(self) -> None:
        super().__init__("This Idempotency-Key came with another request before: take a new key for a new request.")


class NotFound(ServiceError):
    """Nothing is at that path."""

    def __init__(self) -> None:
        super().__init__("Nothing is at this path: see /openapi.json for what there is.")


class MethodNotAllowed(ServiceError):
    """The path does not take that method."""

    def __init__(self) -> None:
        super().__init__("This path does not take that method: use one from the Allow header.")


class BodyTooLarge(ServiceError):
    """The body is over the limit."""

    def __init__(self) -> None:
        super().__init__("The body is larger than the service accepts: send a smaller one.")


class UnsupportedMediaType(ServiceError):
    """The body is of a kind that the path does not take."""

    def __init__(self) -> None:
        super().__init__("This path takes JSON or CSV: declare the body as application/json or text/csv.")


class ClientDisconnected(Exception):
    """The caller hung up: nobody is left to answer."""


TABLE: dict[type[Exception], type[problems.Problem]] = {
    InvalidRequest: problems.Validation,
    optimizer_errors.InvalidProblem: problems.Validation,
    optimizer_errors.OutsideLimits: problems.OutsideLimits,
    optimizer_errors.InvalidTable: problems.InvalidTable,
    optimizer_errors.UnknownRobot: problems.UnknownRobot,
    optimizer_errors.UnreachablePose: problems.UnreachablePose,
    optimizer_errors.SingularPose: problems.SingularPose,
    optimizer_errors.NoReachableTarget: problems.UnreachableTargets,
    optimizer_errors.StartInCollision: problems.StartInCollision,
    optimizer_errors.GoalInCollision: problems.GoalInCollision,
    optimizer_errors.DurationTooShort: problems.DurationTooShort,
    optimizer_errors.TorqueInfeasible: problems.TorqueInfeasible,
    optimizer_errors.NoCollisionFreeTrajectory: problems.NoCollisionFreeTrajectory,
    optimizer_errors.NoTrajectory: problems.NoTrajectory,
    optimizer_errors.DeadlineExceeded: problems.DeadlineExceeded,
    Busy: problems.Busy,
    NotReady: problems.NotReady,
    ShuttingDown: problems.ShuttingDown,
    StoreUnavailable: problems.StoreUnavailable,
    UnknownAnswer: problems.UnknownAnswer,
    UnknownStudy: problems.UnknownStudy,
    EmptyStudy: problems.EmptyStudy,
    KeyReused: problems.KeyReused,
    NotFound: problems.NotFound,
    MethodNotAllowed: problems.MethodNotAllowed,
    BodyTooLarge: problems.BodyTooLarge,
    UnsupportedMediaType: problems.UnsupportedMediaType,
    WorkerDied: problems.Internal,
}


@dataclass(frozen=True)
class Reply:
    """What goes back to a caller: status, body, and headers of its own.

    `kept` are whole answers that the body refers to by `reference(k)`, to be put into the store: see `app.kept`.
    """

    status: int
    body: bytes
    headers: dict[str, str] = field(default_factory=dict)
    kept: tuple[bytes, ...] = ()

    @property
    def media_type(self) -> str:
        """Content type of the body."""
        return "application/json" if self.status < 400 else "application/problem+json"


def problem_type(error: Exception) -> type[problems.Problem]:
    """The type of problem that an exception is; what is not in the table is a defect."""
    return next((TABLE[cls] for cls in type(error).__mro__ if cls in TABLE), problems.Internal)


def problem_reply(error: Exception, instance: str) -> Reply:
    """The answer to the request `instance` that failed with `error`."""
    problem = problem_type(error)
    known = isinstance(error, (ServiceError, optimizer_errors.JoulepathError))
    # an unforeseen exception's message is for the log, not for the caller
    detail = str(error) if known else "This is a defect of the service: report it with the id in `instance`."
    content = {name: problem.model_fields[name].default for name in ("type", "title", "status")}
    content |= {"detail": detail, "instance": instance}
    content |= {name: _own_field(error, name) for name in problem.own_fields()}
    headers = {} if problem.retry_after is None else {"Retry-After": str(problem.retry_after)}
    return Reply(content["status"], orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY), headers)


def _own_field(error: Exception, name: str) -> Any:
    if name == "errors" and isinstance(error, optimizer_errors.InvalidProblem):
        path = [int(part) if part.isdigit() else part for part in error.field.split(".")]
        return [{"loc": ["body", *path], "msg": str(error)}]
    value = getattr(error, name)
    if name == "unreachable":
        return [unreachable_fields(target) for target in value]
    if name == "branches":
        return [fields(branch, *problems.CollidingBranch.model_fields) for branch in value]
    return [candidate_fields(candidate) for candidate in value] if name == "candidates" else value
