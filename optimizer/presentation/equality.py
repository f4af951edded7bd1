"""Equality of values with arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from joulepath.models.immutable import ReadOnlyArrays
from joulepath.models.robot import Robot


class Comparable(ReadOnlyArrays):
    """Base of dataclasses with read-only arrays: equal if all fields are, number by number.

    Such a dataclass is declared with `eq=False`. Its values cannot be keys of a dictionary.
    """

    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        return same(self, other) if type(self) is type(other) else NotImplemented


def same(first: Any, second: Any) -> bool:
    """Whether two values have the same type and content, arrays included.

    A list may equal a tuple, and NaN equals NaN.
    """
    if first is second:
        return True
    if isinstance(first, np.ndarray) or isinstance(second, np.ndarray):
        kinds = {np.asarray(each).dtype.kind for each in (first, second)}
        return np.array_equal(first, second, equal_nan=kinds == {"f"})
    if isinstance(first, list | tuple) and isinstance(second, list | tuple):
        return len(first) == len(second) and all(map(same, first, second))
    if type(first) is not type(second):
        return False
    if isinstance(first, Robot):
        return bool(first.name == second.name and first.figures == second.figures)
    if is_dataclass(first):
        names = (each.name for each in fields(first) if each.compare)
        return all(same(getattr(first, name), getattr(second, name)) for name in names)
    if isinstance(first, Mapping):
        return first.keys() == second.keys() and all(
            same(first[name], second[name]) for name in first
        )
    return bool(first == second or (first != first and second != second))
