"""Warnings of an answer about figures of the request in a probably wrong unit."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from joulepath.app.schemas.common import Request
from joulepath.models.own_arm.plausible_units import UnitRule
from joulepath.models.robot import UPRIGHT

DEGREES = "if it is in degrees, divide it by 57.29578."
MILLIMETRES = "if it is in millimetres, divide it by 1000."


@dataclass(frozen=True)
class FieldRule:
    """The largest likely size of the value of a field."""

    rule: UnitRule
    size: Callable[[Any], float]


def _length(vector: list[float]) -> float:
    return math.hypot(*vector)


def _off_the_earth(gravity: list[float]) -> float:
    return abs(_length(gravity) - _length(UPRIGHT.tolist()))


# lengths are the sizes of tools and payloads, angles a full turn, both rounded up
RULES = {
    "rotvec": FieldRule(UnitRule("an angle", "rad", 6.3, DEGREES), _length),
    "rpy": FieldRule(UnitRule("an angle", "rad", 6.3, DEGREES), lambda rpy: max(map(abs, rpy))),
    "com": FieldRule(UnitRule("a distance from the flange", "m", 3.0, MILLIMETRES), _length),
    "tcp": FieldRule(
        UnitRule("a distance from the flange", "m", 3.0, MILLIMETRES),
        lambda tcp: _length(tcp.position),
    ),
    "gravity": FieldRule(
        UnitRule(
            "a difference from the Earth's gravity",
            "m/s²",
            0.1,
            "its length is 9.81 m/s² however the arm is mounted.",
        ),
        _off_the_earth,
    ),
    "t": FieldRule(
        UnitRule(
            "a duration", "s", 86_400.0, "if it is in milliseconds or nanoseconds, convert it."
        ),
        np.ptp,
    ),
}
"""Rules by field name, at any depth of a request."""


def unlikely_units(request: object) -> list[str]:
    """Warnings about figures of a `Request` far outside the range of real arms."""
    return [*_of_fields(request, "")] if isinstance(request, Request) else []


def _of_fields(part: Request, path: str) -> Iterator[str]:
    for name in type(part).model_fields:
        value, where = getattr(part, name), f"{path}{name}"
        if name in RULES and value is not None:
            found = RULES[name]
            yield from found.rule.warnings((where,), np.array([found.size(value)]))
        several = value if isinstance(value, list | tuple) else [value]
        for k, each in enumerate(several):
            if not isinstance(each, Request):
                # a list of numbers may have a million entries
                break
            yield from _of_fields(each, f"{where}/{k}/" if several is value else f"{where}/")
