"""The field `deadline` of requests. Its upper limit is a setting of the service, so the schemas do
not have it."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, Field

from joulepath.app.exceptions.base import FieldError

DeadlineSeconds = Annotated[float, Field(ge=1e-3)]
"""Longest wall time of a request [s]; `too_long` checks its upper limit."""


def given_deadline(asked: BaseModel) -> float | None:
    """The deadline in a request [s]; None if it has none, and its default holds."""
    return getattr(asked, "deadline", None) if "deadline" in asked.model_fields_set else None


def too_long(given: float | None, longest: float, *where: str | int) -> list[FieldError]:
    """The error of a deadline above the limit in force; none if it is in order.

    Args:
        given: the deadline of the request [s]; None for the default.
        longest: the limit [s].
        where: location of the field in the request.
    """
    if given is None or given <= longest:
        return []
    msg = f"Give a number of at most {longest:g}: no longer deadline is allowed here."
    return [{"loc": [*where, "deadline"], "msg": msg}]
