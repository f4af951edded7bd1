"""Checks of numbers, texts and choices in a request; errors name the field."""

from __future__ import annotations

from itertools import chain
from numbers import Real
from re import fullmatch
from reprlib import repr as short
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

import numpy as np

from joulepath.optimizer.exceptions import InvalidProblem


def check_number(
    field: str,
    value: object,
    unit: str = "",
    *,
    least: float = 0.0,
    most: float = np.inf,
    positive: bool = False,
    infinite: bool = False,
    optional: bool = False,
) -> None:
    """Check that a value is a number within a range. NaN is refused.

    Args:
        field: name of the field in the error.
        value: the value.
        unit: unit of the number in words, for the error; empty for a ratio.
        least: smallest number allowed.
        most: largest number allowed.
        positive: whether zero is refused.
        infinite: whether infinity is allowed.
        optional: whether None is allowed.

    Raises:
        InvalidProblem: the value is no number, or out of range.
    """
    if optional and value is None:
        return
    number = _as_float(value)
    # negated comparisons refuse NaN
    if not (
        least <= number <= most
        and (infinite or np.isfinite(number))
        and not (positive and number == 0)
    ):
        raise InvalidProblem(
            field, f"{field} must be {_described(unit, least, most, positive)}, not {short(value)}."
        )


def check_within(field: str, value: object, range: tuple[float, float], unit: str = "") -> None:
    """Check that a value is a number between the ends of a range.

    Raises:
        InvalidProblem: the value is no number, or out of range.
    """
    least, most = range
    check_number(field, value, unit, least=least, most=most)


def check_speed(field: str, value: object, least: float = 0.0) -> None:
    """Check an optional speed of a point of the arm [m/s]: above zero, and `least` or more.

    Raises:
        InvalidProblem: the value is no number, or out of range.
    """
    check_number(field, value, "metres per second", least=least, positive=least == 0, optional=True)


def check_text(field: str, value: object, pattern: str) -> None:
    """Check that a regular expression matches a whole text.

    Raises:
        InvalidProblem: the value is no text, or has another form.
    """
    if not (isinstance(value, str) and fullmatch(pattern, value)):
        raise InvalidProblem(field, f"{field} must match {pattern}, not {short(value)}.")


def check_choice(field: str, value: object, choices: Any) -> None:
    """Check that a value is among the literals of a type.

    Args:
        field: name of the field in the error.
        value: the value.
        choices: a `Literal`, or a union of literals and None.

    Raises:
        InvalidProblem: the value is no literal of the type.
    """
    known = literals_of(choices)
    # comparisons of arrays with text have no truth value
    if not (isinstance(value, str | int | NoneType) and value in known):
        named = ", ".join(str(choice) for choice in known if choice is not None)
        raise InvalidProblem(field, f"{field} must be one of {named}, not {short(value)}.")


def literals_of(hint: Any) -> tuple[object, ...]:
    """Values of a type made of literals and None; empty for another type."""
    if hint is NoneType:
        return (None,)
    if get_origin(hint) is Literal:
        return get_args(hint)
    if get_origin(hint) not in (Union, UnionType):
        return ()
    parts = [literals_of(part) for part in get_args(hint)]
    return tuple(chain(*parts)) if all(parts) else ()


def _as_float(value: object) -> float:
    """A real number as float, infinity for a larger integer, NaN for everything else."""
    if not isinstance(value, Real):
        return np.nan
    try:
        return float(value)
    except OverflowError:
        return np.inf


def _described(unit: str, least: float, most: float, positive: bool) -> str:
    """A range in words."""
    number = f"number of {unit}" if unit else "number"
    if np.isfinite(most):
        return f"a {number} {'above' if positive else 'from'} {least:g} to {most:g}"
    if positive:
        return f"a positive {number}"
    return f"a {number}, {least:g} or more" if np.isfinite(least) else f"a {number}"
