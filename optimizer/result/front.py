"""Front of energy over duration, in SI units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from joulepath.optimizer.declared import Count, Joules, Seconds
from joulepath.optimizer.result.solution import Solution


@dataclass(frozen=True)
class Dropped:
    """A solved duration without a point on the front."""

    duration: Seconds
    """The duration."""
    energy: Joules | None
    """Energy of the motion found, of the objective; null if none was found."""
    reason: str
    """Why it is not a point: no motion was found, a faster motion needs no more energy, or the
    motion is the same optimum as the last point."""


@dataclass(frozen=True)
class FrontSolver:
    """Effort of the computation of the whole front."""

    wall_time: Seconds
    """Wall time."""
    nlp_solves: Count
    """Nonlinear programs solved."""


@dataclass(frozen=True)
class Front:
    """Motions in ascending duration and descending energy.

    Attributes:
        status: `optimal` if every chosen duration was solved and every motion is optimal;
            `feasible` if the deadline passed before.
        shortest: least feasible duration over all candidates [s].
        points: the motions, fastest first.
        dropped: solved durations without a point.
        solver: effort.
    """

    status: Literal["optimal", "feasible"]
    shortest: float
    points: list[Solution]
    dropped: list[Dropped]
    solver: FrontSolver
