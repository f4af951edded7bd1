"""Bytes in base64 fields of requests."""

from __future__ import annotations

import base64

from joulepath.optimizer.exceptions import InvalidProblem


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
