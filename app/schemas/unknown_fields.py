"""Errors about fields that a model does not have, beside the errors of its other fields."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import islice
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from joulepath.app.schemas.names import nearest

UNKNOWN_FIELD = "unknown_field"
"""Type of the error about unknown fields. Its context has the names of the fields of the model,
`known`, and the first unknown names, `unknown`."""
MOST_UNKNOWN = 20
"""Most unknown names in an error: a body can have thousands, each of which would take time."""
MOST_BESIDE = 100
"""Most errors of other fields that are listed beside the unknown ones."""
_Model = TypeVar("_Model")


def without_unknown_fields(
    data: Any, fields: Sequence[str], validate: Callable[[Any], _Model]
) -> _Model:
    """The model of some data, if it is no object with other fields than `fields`.

    Unlike the error of `extra="forbid"`, the error about them does not echo their names.

    Raises:
        ValidationError: there are unknown fields, or the data is wrong in another way. The missing
            field that a misspelt name stands for is not listed.
    """
    if not isinstance(data, dict) or data.keys() <= set(fields):
        return validate(data)
    unknown = list(islice((str(name) for name in data if name not in fields), MOST_UNKNOWN))
    error = PydanticCustomError(
        UNKNOWN_FIELD, "Unknown field", {"known": fields, "unknown": unknown}
    )
    errors = [InitErrorDetails(type=error, input=None)]
    try:
        validate({name: data[name] for name in fields if name in data})
    except ValidationError as other:
        meant = {nearest(name, fields) for name in unknown}
        if other.error_count() <= MOST_BESIDE:
            errors += [
                _repeated(each)
                for each in other.errors(include_url=False, include_input=False)
                if each["type"] != "missing" or each["loc"][0] not in meant
            ]
    raise ValidationError.from_exception_data("request", errors)


def _repeated(error: ErrorDetails) -> InitErrorDetails:
    """An error as it was, to be raised again beside others."""
    same = PydanticCustomError(error["type"], error["msg"], error.get("ctx"))
    return InitErrorDetails(type=same, loc=error["loc"], input=None)
