"""Validation of arrays from files and callers: numeric, finite, of the right shape, read-only."""

from __future__ import annotations

import numpy as np

from joulepath.models.immutable import numbers
from joulepath.models.robot import Array


def read_only(values: object, shape: tuple[int, ...], name: str) -> Array:
    """A read-only array with a copy of `values`.

    Args:
        values: the numbers.
        shape: the shape required; -1 stands for any length.
        name: subject of the error message.

    Raises:
        ValueError: the values are not numbers, not finite, or of another shape.
    """
    array = np.array(numbers(values, name))
    if array.ndim != len(shape) or any(
        want not in (-1, got) for want, got in zip(shape, array.shape, strict=True)
    ):
        raise ValueError(f"{name} must be {_size(shape)} numbers, not {_size(array.shape)}.")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite.")
    array.setflags(write=False)
    return array


def _size(shape: tuple[int, ...]) -> str:
    """A shape in words: `6`, `4×4`, `n×3`."""
    return "×".join("n" if length == -1 else str(length) for length in shape) or "1"
