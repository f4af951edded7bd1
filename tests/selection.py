"""The choice of parameters for every run and for `make test-long` alone."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest

from joulepath import robot_names


def long_but(quick: Collection[Any], values: Iterable[Any]) -> list[Any]:
    """The values, or tuples of values, as parameters of a test, `long` unless in `quick`."""
    found = list(values)
    assert all(each in found for each in quick), "a quick parameter is none of the test's"
    return [each if each in quick else _long(each) for each in found]


def _long(each: Any) -> Any:
    return pytest.param(*(each if isinstance(each, tuple) else (each,)), marks=pytest.mark.long)


ROBOTS = long_but(["ur5e", "kr10_r1100", "panda"], robot_names())
"""All robots; every run has one of each form: parallel axes, a spherical wrist, seven joints."""
