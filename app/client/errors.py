"""Errors of the client: no service, and the error of a problem document."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import orjson

from joulepath.app.exceptions.base import InternalError, ServiceError
from joulepath.app.exceptions.error_types import types_of_error
from joulepath.optimizer.exceptions import DeclaredError, JoulepathError

Json = dict[str, Any]


@dataclass(eq=False)
class ServiceUnreachable(ServiceError, JoulepathError):
    """No service answers at this address, or the connection broke."""

    url: str
    """Address of the service."""
    reason: str
    """What happened instead."""

    def __str__(self) -> str:
        return (
            f"No service answers at {self.url}: {self.reason}. Check the address; "
            "`joulepath serve` starts a service."
        )


def error_in(answer: Any, url: str) -> DeclaredError:
    """Convert a response of httpx to an error.

    Args:
        answer: the response.
        url: address of the service.

    Returns:
        The error of the problem document, or `ServiceUnreachable` if the body is none.
    """
    try:
        return error_of(json_in(answer.content, url))
    except (ServiceUnreachable, KeyError, AttributeError):
        where = answer.headers.get("location")
        told = f" and refers to {where}" if where else ""
        reason = f"it answers {answer.status_code}{told}, but not as joulepath does"
        return ServiceUnreachable(url, reason)


def json_in(content: bytes, url: str) -> Json:
    """The JSON object of a successful answer. Raises ServiceUnreachable if it is none."""
    try:
        found = orjson.loads(content)
    except orjson.JSONDecodeError:
        found = None
    if not isinstance(found, dict):
        raise ServiceUnreachable(url, "another program answers, without a JSON object")
    return found


def error_of(document: Json) -> DeclaredError:
    """Convert a problem document (RFC 9457) to an error.

    Args:
        document: the document. Its fields except `type`, `title` and `status` become attributes
            of the error; `instance` is the id of the request.

    Returns:
        An error of the class with the slug of `type`, or of `InternalError` if there is none.
    """
    slug = document["type"].rpartition("/")[2]
    kind = next((each for each in types_of_error() if each.slug() == slug), InternalError)
    # mypy considers classes of dataclass exceptions unhashable, like their instances
    error = _told(kind)  # type: ignore[arg-type]
    told = error.__new__(error)
    fixed = ("type", "title", "status")
    vars(told).update({name: value for name, value in document.items() if name not in fixed})
    vars(told)["document"] = document
    return told


def wrong_fields(document: Json) -> list[str]:
    """Wrong fields of a problem document, one line per field: `start.q.1: must be …`."""
    return [f"{_place(each['loc'])}: {each['msg']}" for each in document.get("errors", ())]


def _place(loc: list[str | int]) -> str:
    """The name of a field: `start.q.1` of `["body", "start", "q", 1]`."""
    inner = loc[1:] if loc[:1] in (["body"], ["query"]) else loc
    return ".".join(map(str, inner)) or "the request"


@cache
def _told(kind: type[DeclaredError]) -> type[DeclaredError]:
    """A subclass of an error with the message of the service."""

    def message(self: Any) -> str:
        return "\n".join([str(vars(self)["detail"]), *wrong_fields(vars(self)["document"])])

    def reduce(self: Any) -> tuple[Any, ...]:
        return error_of, (vars(self)["document"],)

    own = {"__str__": message, "__reduce__": reduce, "__module__": kind.__module__}
    bases = (kind,) if issubclass(kind, JoulepathError) else (kind, JoulepathError)
    return type(kind.__name__, bases, own | {"__doc__": kind.__doc__})
