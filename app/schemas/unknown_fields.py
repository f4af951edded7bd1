"""Unknown fields of a request, reported together with the errors of its known fields."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from joulepath.app.schemas.names import nearest

UNKNOWN_FIELD = "unknown_field"
"""Type of the error. Its context lists the `known` fields of the model and the first `unknown`
names."""
_Model = TypeVar("_Model")


@dataclass(frozen=True)
class UnknownFieldSettings:
    """Limits of the error about unknown fields."""

    names: int = 20
    """Largest number of unknown names: a body may contain thousands, and the search for a similar
    known name takes some 60 us per name."""
    errors: int = 100
    """Largest number of errors of known fields; more errors are left out."""


UNKNOWN_FIELDS = UnknownFieldSettings()


def without_unknown_fields(
    data: Any, fields: Sequence[str], validate: Callable[[Any], _Model]
) -> _Model:
    """Validate data, and refuse objects with unknown fields.

    Pydantic's own `extra="forbid"` would repeat unknown names of any form, which may be secrets.

    Args:
        data: the data.
        fields: names of the known fields.
        validate: validates data without unknown fields.

    Raises:
        ValidationError: the object has unknown fields, or the validation failed. Known fields are
            not reported as missing if an unknown name is a misspelling of theirs.
    """
    if not isinstance(data, dict) or data.keys() <= set(fields):
        return validate(data)
    names = (str(name) for name in data if name not in fields)
    unknown = list(islice(names, UNKNOWN_FIELDS.names))
    error = PydanticCustomError(
        UNKNOWN_FIELD, "Unknown field", {"known": fields, "unknown": unknown}
    )
    errors = [InitErrorDetails(type=error, input=None)]
    try:
        validate({name: data[name] for name in fields if name in data})
    except ValidationError as other:
        if other.error_count() <= UNKNOWN_FIELDS.errors:
            misspelt = {(nearest(name, fields),) for name in unknown}
            errors += [
                _repeated(each)
                for each in other.errors(include_url=False, include_input=False)
                if each["type"] != "missing" or each["loc"] not in misspelt
            ]
    raise ValidationError.from_exception_data("request", errors)


def _repeated(error: ErrorDetails) -> InitErrorDetails:
    """The same error in the form in which pydantic raises errors."""
    same = PydanticCustomError(error["type"], error["msg"], error.get("ctx"))
    return InitErrorDetails(type=same, loc=error["loc"], input=None)
