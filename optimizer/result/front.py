"""Front of energy over duration, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from joulepath.optimizer.declared import Count, Joules, Seconds
from joulepath.optimizer.presentation.chart import Chart
from joulepath.optimizer.presentation.result import Result, Rows
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


@dataclass(frozen=True, eq=False, repr=False)
class Front(Result):
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

    def _headline(self) -> str:
        ends = [
            f"{each.energy.of(each.objective):.4g} J in {each.duration:.4g} s"
            for each in (self.points[0], self.points[-1])
        ]
        objective = self.points[0].objective
        return f"{len(self.points)} motions, {' to '.join(ends)}, {objective}, {self.status}"

    def _rows(self) -> Rows:
        rows = (
            (
                f"{each.duration:.4g}",
                f"{each.energy.of(each.objective):.4g}",
                f"{each.lower_bound:.4g}",
                each.status,
            )
            for each in self.points
        )
        return [("duration [s]", "energy [J]", "lower bound [J]", "status"), *rows]

    def _shown(self) -> Any:
        return {
            "status": self.status,
            "shortest": self.shortest,
            "points": [each.solved_motion() for each in self.points],
            "dropped": self.dropped,
            "solver": self.solver,
        }

    def _columns(self) -> dict[str, Any]:
        points = self.points
        return {
            "duration": [each.duration for each in points],
            "energy": [each.energy.of(each.objective) for each in points],
            "electrical": [each.energy.electrical.total for each in points],
            "mechanical": [each.energy.mechanical.total for each in points],
            "peak_power": [each.energy.peak_power for each in points],
            "lower_bound": [each.lower_bound for each in points],
            "start": [each.start.label for each in points],
            "goal": [each.goal.label for each in points],
            "status": [each.status for each in points],
        }

    def _charts(self) -> Sequence[Chart]:
        columns = self._columns()
        curves = {name: np.array(columns[name]) for name in ("energy", "lower_bound")}
        return [Chart(np.array(columns["duration"]), "duration [s]", "energy [J]", curves, True)]
