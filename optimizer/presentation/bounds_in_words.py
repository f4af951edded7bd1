"""Bounds of requests in words, rounded into the allowed interval.

A request with the printed number is therefore accepted.
"""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Context

DIGITS = 6
"""Significant digits of a bound, as of 2.09439 rad/s."""


def least(bound: float) -> str:
    """A lower bound in words, rounded up."""
    return _rounded(bound, ROUND_CEILING)


def most(bound: float) -> str:
    """An upper bound in words, rounded down."""
    return _rounded(bound, ROUND_FLOOR)


def _rounded(bound: float, rounding: str) -> str:
    return f"{Context(prec=DIGITS, rounding=rounding).create_decimal_from_float(bound):f}"
