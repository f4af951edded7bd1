"""Errors of requests, and of the service itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, TypedDict

from joulepath.optimizer.declared import Internal
from joulepath.optimizer.exceptions import DeclaredError


class ServiceError(DeclaredError):
    """Base of the service's own errors."""


class FieldError(TypedDict):
    """One error in the request."""

    loc: list[str | int]
    """Path of the field."""
    msg: str
    """The error of the field, and its remedy."""


@dataclass(eq=False)
class InvalidRequest(ServiceError):
    """The request is malformed or contradicts itself. The body is not JSON, or a field is missing,
    unknown, of the wrong type or length, out of range, or not finite. A payload beyond the robot's
    rating, a limit wider than the robot's, a deadline above the maximum and too many candidates
    belong here, too."""

    title = "Invalid request"
    remedy = "Correct the fields in `errors` and send the request again."

    errors: list[FieldError]
    """One entry per error, at most 20."""
    message: Annotated[str, Internal] = "Correct the fields listed under `errors`."
    """One sentence on the error, if there is one."""

    def __str__(self) -> str:
        return self.message


class InternalError(ServiceError):
    """A defect of the service. The log has an entry with the id of the request."""

    status = 500
    title = "Internal error"
    remedy = "Please report the defect with the value of `instance`."
    detail = "This is a defect of the service: report it with the id in `instance`."
