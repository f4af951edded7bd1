"""The check of arrays: valid ones become read-only copies, errors name invalid ones."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.models.arrays import read_only


def test_an_array_is_a_read_only_copy() -> None:
    given = np.arange(6.0)
    array = read_only(given, (6,), "q")
    given[0] = 9.0
    assert array.tolist() == [0, 1, 2, 3, 4, 5] and array.dtype == np.float64
    with pytest.raises(ValueError, match="read-only"):
        array[0] = 1.0


@pytest.mark.parametrize(
    ("shape", "values"), [((-1, 3), np.ones((7, 3))), ((-1, -1), [[1, 2]]), ((), 3), ((0,), [])]
)
def test_any_length(shape: tuple[int, ...], values: object) -> None:
    assert read_only(values, shape, "vertices").tolist() == np.array(values).tolist()


@pytest.mark.parametrize(
    ("values", "shape", "message"),
    [
        ([1, 2], (3,), "com must be 3 numbers, not 2."),
        (1.0, (3,), "com must be 3 numbers, not 1."),
        (np.eye(3), (4, 4), "com must be 4×4 numbers, not 3×3."),
        (np.eye(2), (-1, 3), "com must be n×3 numbers, not 2×2."),
        ([[1], [2, 3]], (2, 2), "com must be numbers."),
        ("abc", (3,), "com must be numbers."),
        (None, (), "com must be finite."),
        ([1, 2, 1j], (3,), "com must be numbers."),
        ([0, np.nan, 0], (3,), "com must be finite."),
        ([0, -np.inf, 0], (3,), "com must be finite."),
    ],
)
def test_refusals_say_what_is_wrong(values: object, shape: tuple[int, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_only(values, shape, "com")
