"""Public entry point: `compare(problem)` solves a problem by several methods."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Clock, Deadline, DeadlineShares
from joulepath.optimizer.exceptions import DeadlineExceeded, InvalidProblem, JoulepathError
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.presentation.chart import Chart
from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.presentation.result import Result, Rows
from joulepath.optimizer.problem.declared_types import checked_arguments
from joulepath.optimizer.problem.problem import MethodName, Problem
from joulepath.optimizer.progress import (
    CandidatesFound,
    CandidateTried,
    Improved,
    Tell,
    no_listener,
    only_news,
)
from joulepath.optimizer.result.energy import Objective, energy_text
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.solve.methods import METHODS


@dataclass(frozen=True, eq=False)
class Compared:
    """Outcome of a method: its solution, or the error."""

    method: MethodName
    solution: Solution | None
    error: JoulepathError | None


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Result):
    """Solutions of one problem by several methods, with at least one motion.

    `methods` has an entry for every method, in the requested order.
    """

    objective: Objective
    methods: tuple[Compared, ...]

    @cached_property
    def solutions(self) -> dict[MethodName, Solution]:
        """Solution of every method with a motion."""
        return {each.method: each.solution for each in self.methods if each.solution is not None}

    @cached_property
    def best(self) -> MethodName:
        """Method with the motion of least objective."""
        return min(self.solutions, key=self._energy)

    @property
    def lower_bound(self) -> float:
        """Largest proven lower bound [J]; it holds for the motions of all methods."""
        return max(solution.lower_bound for solution in self.solutions.values())

    def excess(self, method: MethodName) -> float:
        """Relative excess of a method's energy over the least one [1].

        Args:
            method: method with a motion.

        Returns:
            energy / least energy - 1; 0 if the least energy is not positive.
        """
        least = self._energy(self.best)
        return self._energy(method) / least - 1 if least > 0 else 0.0

    def _headline(self) -> str:
        others = (
            f"{each.method} {self.excess(each.method):+.1%}"
            if each.error is None
            else f"{each.method} {type(each.error).__name__}"
            for each in self.methods
            if each.method != self.best
        )
        best = energy_text(self.solutions[self.best].energy, self.objective)
        return "; ".join([f"best {self.best} {best}", *others])

    def _rows(self) -> Rows:
        names = ("method", "energy", "excess", "duration", "status")
        columns = self._columns()
        rows = zip(*(columns[name] for name in names), strict=True)
        cells = ([_cell(each) for each in row] for row in rows)
        return [("method", "energy [J]", "excess", "duration [s]", "status"), *cells]

    def _shown(self) -> Any:
        return {
            "objective": self.objective,
            "lower_bound": self.lower_bound,
            "best": self.best,
            "methods": [
                {
                    "method": each.method,
                    "solution": each.solution and each.solution.solved_motion(),
                    "problem": each.error and str(each.error),
                }
                for each in self.methods
            ],
        }

    def _columns(self) -> dict[str, Any]:
        """One row per method, without figures where it found no motion."""
        found = [each.solution for each in self.methods]
        return {
            "method": [each.method for each in self.methods],
            "energy": [each and each.energy.of(self.objective) for each in found],
            "excess": [each.solution and self.excess(each.method) for each in self.methods],
            "electrical": [each and each.energy.electrical.total for each in found],
            "mechanical": [each and each.energy.mechanical.total for each in found],
            "duration": [each and each.duration for each in found],
            "wall_time": [each and each.solver.wall_time for each in found],
            "status": [
                type(each.error).__name__ if each.solution is None else each.solution.status
                for each in self.methods
            ],
        }

    def _charts(self) -> Sequence[Chart]:
        """Power of each method over the longest motion; 0 W after the end of a shorter one."""
        trajectories = {name: each.trajectory for name, each in self.solutions.items()}
        t = np.unique(np.concatenate([each.t for each in trajectories.values()]))
        power: dict[str, Array] = {
            name: np.interp(t, each.t, each.power, right=0.0) for name, each in trajectories.items()
        }
        return [Chart(t, "t [s]", "power [W]", power)]

    def _energy(self, method: MethodName) -> float:
        return self.solutions[method].energy.of(self.objective)


def _cell(value: float | str | None) -> str:
    return "" if value is None else value if isinstance(value, str) else f"{value:.4g}"


@checked_arguments
def compare(
    problem: Problem,
    methods: Sequence[MethodName] = tuple(METHODS),
    clock: Clock = time.perf_counter,
    tell: Tell = no_listener,
    progress: bool = True,
) -> Comparison:
    """Solve one problem by several methods, one after another.

    The methods run in the order of `METHODS`. A method gets an equal share of the time left.

    Args:
        problem: the problem; its own `method` is ignored.
        methods: distinct names of methods.
        clock: function that returns the time [s].
        tell: receives the progress, with the methods as candidates and the best motion so far.
        progress: whether a bar may show the progress, on a terminal or in a notebook, unless
            `tell` is given.

    Returns:
        The outcome of every method, in the order of `methods`.

    Raises:
        InvalidProblem: `methods` is empty, names a method twice, or an unknown one.
        JoulepathError: no method found a motion; the error of the first of `methods`.
    """
    if not methods or len(set(methods)) < len(methods):
        raise InvalidProblem(
            "methods", f"methods must name some of {', '.join(METHODS)}, each once."
        )
    shares = DeadlineShares(Deadline.after(problem.deadline, clock), len(methods))
    found = dict[MethodName, Compared]()
    with progress_bar("Comparing methods", tell, progress) as tell:
        tell = only_news(tell)
        tell(CandidatesFound(len(methods)))
        for k, method in enumerate(each for each in METHODS if each in methods):
            share = shares.next()
            if shares.used_up:
                found[method] = Compared(method, None, DeadlineExceeded([]))
                continue
            found[method] = _solved(replace(problem, method=method, deadline=share), clock)
            _tell_outcome(tell, k, found[method], problem.objective)
    first = found[methods[0]]
    if all(each.solution is None for each in found.values()):
        assert first.error is not None
        raise first.error
    return Comparison(problem.objective, tuple(found[method] for method in methods))


def _solved(problem: Problem, clock: Clock) -> Compared:
    try:
        return Compared(problem.method, optimize(problem, clock, progress=False), None)
    except JoulepathError as error:
        return Compared(problem.method, None, error)


def _tell_outcome(tell: Tell, index: int, found: Compared, objective: Objective) -> None:
    if found.solution is None:
        tell(CandidateTried(index, "failed", None, None))
        return
    solution = found.solution
    energy, bound = solution.energy.of(objective), solution.lower_bound
    tell(CandidateTried(index, "solved", bound, energy))
    tell(Improved(energy, solution.duration, bound, solution.goal.q))
