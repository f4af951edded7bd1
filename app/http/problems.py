"""Problem details (RFC 9457): documents and schemas from the declarations of error classes."""

from __future__ import annotations

from itertools import islice
from typing import Any, Literal

from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, Field, ValidationError, create_model

from joulepath.app.answers.declared import model_of
from joulepath.app.convert.fields import location
from joulepath.app.exceptions.base import FieldError, InternalError, InvalidRequest
from joulepath.app.http.validation_messages import told
from joulepath.app.schemas.problem_details import ProblemDetails
from joulepath.optimizer.exceptions import DeclaredError, InvalidProblem
from joulepath.optimizer.presentation.declared_fields import shown_fields

PREFIX = "/problems/"
MOST_ERRORS = 20
"""Most errors listed by an `invalid-request` problem; a body can have thousands."""


def reported(error: Exception) -> DeclaredError:
    """The error reported to the client."""
    if isinstance(error, InvalidProblem):
        return InvalidRequest([FieldError(loc=location(error, "body"), msg=str(error))], str(error))
    # the message of an unforeseen exception is for the log, not for the client
    return error if isinstance(error, DeclaredError) else InternalError()


def problem_of(error: Exception, instance: str) -> dict[str, Any]:
    """The document, for `json_document`: the request `instance` failed with `error`."""
    error = reported(error)
    fixed = {"type": path_of(type(error)), "title": error.title, "status": error.status}
    own = {name: getattr(error, name) for name in _names(error.type_of_error())}
    return fixed | {"detail": str(error), "instance": instance} | own


def path_of(kind: type[DeclaredError]) -> str:
    """The `type` of a document: the path of the page about it."""
    return PREFIX + kind.slug()


def invalid_request(error: ValidationError | RequestValidationError, *where: str) -> InvalidRequest:
    """The InvalidRequest for errors of pydantic or FastAPI; their locations start with `where`.

    `validation_messages` has the messages.
    """
    entries = (entry for each in error.errors()[:MOST_ERRORS] for entry in told(each, where))
    return InvalidRequest(list(islice(entries, MOST_ERRORS)))


def model_of_problem(kind: type[DeclaredError]) -> type[ProblemDetails]:
    """The pydantic model of the documents of a type of error."""
    fixed = {"type": path_of(kind), "title": kind.title, "status": kind.status}
    fields: dict[str, Any] = {
        name: (
            Literal[value],
            Field(default=value, description=ProblemDetails.model_fields[name].description),
        )
        for name, value in fixed.items()
    }
    fields |= {name: (field.annotation, field) for name, field in _model(kind).model_fields.items()}
    return create_model(kind.__name__, __base__=ProblemDetails, __doc__=explanation(kind), **fields)


def own_fields(kind: type[DeclaredError]) -> dict[str, str]:
    """Fields of the documents of a type beyond the common ones, with their meaning."""
    fields = model_of_problem(kind).model_fields
    return {name: fields[name].description or "" for name in _names(kind)}


def explanation(kind: type[DeclaredError]) -> str:
    """Cause and remedy of an error of this type."""
    return f"{occasion(kind)} {kind.remedy}"


def occasion(kind: type[DeclaredError]) -> str:
    """When an error of this type occurs."""
    return " ".join((kind.__doc__ or "").split())


# mypy considers classes of dataclass exceptions unhashable, like their instances.
def _names(kind: type) -> tuple[str, ...]:
    return shown_fields(kind)


def _model(kind: type) -> type[BaseModel]:
    return model_of(kind)
