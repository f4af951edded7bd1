"""Declarations of the fields of results and errors beside their types: units, axes, and display.

The text below a field is its meaning. This module only names the markers;
`joulepath.optimizer.presentation` reads them to write JSON, `joulepath.app.answers.declared` to
write JSON Schema and the reference.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from joulepath.models.robot import Array


@dataclass(frozen=True, slots=True)
class Unit:
    """Unit of a number or of all numbers of an array: "J", "rad/s"; "1" for a ratio or a count."""

    symbol: str


@dataclass(frozen=True, slots=True)
class Axes:
    """Names of the axes of an array, slowest first."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Keys:
    """Keys of a dictionary: a TypedDict with their types and meanings."""

    of: type


class Internal:
    """Marks a field of the library that no answer shows."""


class NullIfNotFinite:
    """Marks a number that may be infinite or NaN, shown as null in JSON."""


class NotEmpty:
    """Marks a list with at least one entry."""


Joules = Annotated[float, Unit("J")]
Watts = Annotated[float, Unit("W")]
Seconds = Annotated[float, Unit("s")]
Metres = Annotated[float, Unit("m")]
MetresPerSecond = Annotated[float, Unit("m/s")]
NewtonMetres = Annotated[float, Unit("N·m")]
Radians = Annotated[float, Unit("rad")]
Ratio = Annotated[float, Unit("1")]
Count = Annotated[int, Unit("1")]

PerJoint = Annotated[Array, Axes(("joint",))]
PerSample = Annotated[Array, Axes(("sample",))]
PerSampleAndJoint = Annotated[Array, Axes(("sample", "joint"))]
