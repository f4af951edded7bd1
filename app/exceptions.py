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
from functools import cache
from typing import Any

from app.schemas.common import KEY_HEADER
from app.schemas.common import Request as RequestModel

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
