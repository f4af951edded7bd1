"""Attributes of the library's dataclasses as JSON fields."""

from __future__ import annotations

from typing import Any

import numpy as np

from joulepath.optimizer.exceptions import InvalidProblem


def location(error: InvalidProblem, where: str) -> list[str | int]:
    """Path of the invalid field in the request; `where` is the part of the request."""
    return [where, *(int(part) if part.isdigit() else part for part in error.field.split("."))]


def fields(source: object, *names: str) -> dict[str, Any]:
    """Attributes by name, ready for orjson: it encodes arrays in C order only, and infinite numbers
    as null.
    """
    values = {name: getattr(source, name) for name in names}
    return {
        name: np.ascontiguousarray(value) if isinstance(value, np.ndarray) else value
        for name, value in values.items()
    }
