"""The check of arrays from a file or a caller: numbers, of the right shape, finite. They are
read-only from then on.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array


def read_only(values: object, shape: tuple[int, ...], name: str) -> Array:
    """A read-only copy of `values` as an array of that shape, in which -1 stands for any length.

    Raises ValueError if the values are not numbers, not of that shape or not finite; the message
    begins with `name`.
    """
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be numbers.") from None
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
