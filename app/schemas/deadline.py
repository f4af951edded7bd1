"""The field `deadline` of requests.

The upper limit depends on the service, and on whether the request is a job. Schemas therefore have
no upper limit; `too_long` checks it.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, Field, field_validator
from pydantic_core import PydanticCustomError

from joulepath.app.exceptions.base import FieldError
from joulepath.app.schemas.common import Request
from joulepath.app.settings import LONGEST_DEADLINE

DeadlineSeconds = Annotated[float, Field(ge=1e-3)]
"""Longest wall time of a request [s]."""


def given_deadline(asked: BaseModel) -> float | None:
    """The deadline given in a request [s]; None if the request leaves it out."""
    return getattr(asked, "deadline", None) if "deadline" in asked.model_fields_set else None


def too_long(given: float | None, longest: float, *where: str | int) -> list[FieldError]:
    """Errors of a given deadline: one if it exceeds the limit, else none.

    Args:
        given: the deadline of the request [s]; None for the default.
        longest: the limit [s].
        where: location of the field in the request.
    """
    if given is None or given <= longest:
        return []
    msg = f"Give a number of at most {longest:g}: no longer deadline is allowed here."
    return [{"loc": [*where, "deadline"], "msg": msg}]


class WithBodies(Request):
    """A request with bodies of other requests.

    The deadline of the whole request also ends the work on its bodies. A body may nevertheless have
    a longer deadline, as a body taken from a job does: up to the longest deadline of jobs.
    """

    @field_validator("optimize", "cycle", "evaluate", "placement", check_fields=False)
    @classmethod
    def _not_too_long(cls, body: Request | None) -> Request | None:
        if body is not None and too_long(given_deadline(body), LONGEST_DEADLINE):
            raise PydanticCustomError(
                "deadline_too_long",
                "Give a `deadline` of at most {most}",
                {"most": f"{LONGEST_DEADLINE:g}"},
            )
        return body
