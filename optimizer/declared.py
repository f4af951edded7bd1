"""What the fields of results and errors declare beside their types: units, axes, and how they are
shown.

The text below a field is its meaning. This module only names the markers;
`joulepath.app.answers.declared` reads them to write JSON, JSON Schema and the reference.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from joulepath.models.robot import Array


@dataclass(frozen=True, slots=True)
class Unit:
    """Unit of a number, or of every number in an array: "J", "rad/s"; "1" for a ratio or a
    count."""

    symbol: str


@dataclass(frozen=True, slots=True)
class Axes:
    """Names of the axes of an array, the slowest first."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Keys:
    """The keys of a dictionary: those of a TypedDict, which has their types and their meanings."""

    of: type


class Internal:
    """Marks a field that the library has and no answer shows."""


class NullIfInfinite:
    """Marks a number that may be infinite, which JSON shows as null."""


class NotEmpty:
    """Marks a list that has at least one entry."""


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
