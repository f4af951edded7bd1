"""Fields of requests and answers: the library's attributes as JSON, errors at their paths in a
request, and bytes in base64.
"""

from __future__ import annotations

import base64
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import numpy as np

from joulepath.optimizer.exceptions import InvalidProblem

E = TypeVar("E", bound=Exception)


def location(error: InvalidProblem, where: str) -> list[str | int]:
    """Path of the invalid field in the request; `where` is the part of the request."""
    return [where, *(int(part) if part.isdigit() else part for part in error.field.split("."))]


def moved(error: E, field: str, own: Collection[str] | None = None) -> E | InvalidProblem:
    """Move an error of a part of the body to its path in the body.

    Errors besides InvalidProblem are returned unchanged.

    Args:
        error: error of the request.
        field: path of the request in the body.
        own: fields of the request, by default all. An error in another field becomes an error of
            `field` itself.
    """
    if not isinstance(error, InvalidProblem):
        return error
    has = own is None or error.field.partition(".")[0] in own
    return InvalidProblem(f"{field}.{error.field}" if has else field, str(error))


@contextmanager
def inside(field: str, own: Collection[str] | None = None) -> Iterator[None]:
    """Move the InvalidProblem of the body by `moved`."""
    try:
        yield
    except InvalidProblem as error:
        raise moved(error, field, own) from None


def fields(source: object, *names: str) -> dict[str, Any]:
    """Attributes by name, ready for orjson: it encodes arrays in C order only, and infinite numbers
    as null.
    """
    values = {name: getattr(source, name) for name in names}
    return {
        name: np.ascontiguousarray(value) if isinstance(value, np.ndarray) else value
        for name, value in values.items()
    }


def decoded(data: str, field: str) -> bytes:
    """The bytes of a base64 field. Raises InvalidProblem at the field."""
    try:
        return base64.b64decode(data, validate=True)
    except ValueError:
        raise InvalidProblem(
            field,
            f"{field} is not valid base64: use its alphabet only, and fill it to a multiple of 4 "
            "characters.",
        ) from None
