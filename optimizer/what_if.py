"""Public entry point: `what_if(solution, problem)` compares a motion with that of a changed arm.

A change, such as lighter links, another payload or other drives, has two effects, reported
separately: the energy of the same motion on the changed arm (`same_motion`), and the energy of a
motion optimised for it (`reoptimised`).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from joulepath.optimizer.certificate import certify
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, watch
from joulepath.optimizer.dynamics.interval import with_interval
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.presentation.chart import Chart
from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.presentation.result import Result, Rows
from joulepath.optimizer.problem.declared_types import checked_arguments
from joulepath.optimizer.problem.problem import Problem, narrowed
from joulepath.optimizer.progress import Tell, no_listener
from joulepath.optimizer.result.certificate import Certificate
from joulepath.optimizer.result.energy import Energy, energy_text
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.search.state import ENERGY_TOLERANCE


@dataclass(frozen=True)
class WhatIfSettings:
    """Settings of `what_if`."""

    least_time: float = 1e-3
    """Least deadline of a search [s]."""
    kept_share: float = 0.05
    """Share of the deadline that the first search leaves to the known motion."""
    warm_start_share: float = 0.8
    """Share of the time left then for a search from the known motion."""


WHAT_IF = WhatIfSettings()


@dataclass(frozen=True, eq=False, repr=False)
class WhatIf(Result):
    """Result of a change.

    Attributes:
        same_motion: energy of the known motion on the changed arm.
        certificate: certificate of the known motion on the changed arm.
        reoptimised: best motion of the changed arm; None if none was found.
        error: reason if none was found.
    """

    same_motion: Energy
    certificate: Certificate
    reoptimised: Solution | None
    error: JoulepathError | None

    def _headline(self) -> str:
        same = energy_text(self.same_motion, "electrical")
        if self.reoptimised is None:
            return f"same motion {same}; {type(self.error).__name__}"
        best = self.reoptimised.energy
        saved = best.electrical.total - self.same_motion.electrical.total
        return f"same motion {same}; reoptimised {energy_text(best, 'electrical')}, {saved:+.3g} J"

    def _rows(self) -> Rows:
        columns = self._columns()
        titles = ("motion", "electrical [J]", "mechanical [J]", "within the limits")
        names = ("motion", "electrical", "mechanical", "valid")
        rows = zip(*(columns[name] for name in names), strict=True)
        return [titles, *([row[0], f"{row[1]:.4g}", f"{row[2]:.4g}", str(row[3])] for row in rows)]

    def _shown(self) -> Any:
        best = self.reoptimised
        return {
            "same_motion": self.same_motion,
            "certificate": self.certificate,
            "reoptimised": best and best.solved_motion(),
            "problem": self.error and str(self.error),
        }

    def _columns(self) -> dict[str, Any]:
        """One row for the known motion, and one for the best of the changed arm."""
        best = self.reoptimised
        energies = [self.same_motion, *([best.energy] if best else [])]
        return {
            "motion": ["same_motion", *(["reoptimised"] if best else [])],
            "electrical": [each.electrical.total for each in energies],
            "mechanical": [each.mechanical.total for each in energies],
            "valid": [self.certificate.valid, *([best.certificate.valid] if best else [])],
        }

    def _charts(self) -> Sequence[Chart]:
        return self.reoptimised._charts() if self.reoptimised else ()


@checked_arguments
@one_thread()
def what_if(
    solution: Solution,
    problem: Problem,
    clock: Clock = time.perf_counter,
    tell: Tell = no_listener,
    progress: bool = True,
) -> WhatIf:
    """Compare a motion with the best one of a changed arm.

    The changed problem is solved on its own. If the known motion is feasible on the changed arm and
    needs less energy than the new one, or there is no new one, the problem is solved again from the
    known motion; without enough time, the known motion is the answer. No answer thus needs more
    energy than a feasible known motion.

    Args:
        solution: solution of the problem without the change.
        problem: the problem with the change, as by `dataclasses.replace(problem, arm=…)`, of an arm
            with as many joints. Its `deadline` holds for the whole comparison.
        clock: function that returns the time [s].
        tell: gets the progress of the search for the changed arm.
        progress: whether a bar may show the progress, on a terminal or in a notebook, unless
            `tell` is given.

    Returns:
        Energy of the known motion on the changed arm, and the best motion of this arm.

    Raises:
        DeadlineExceeded: the deadline passed before the known motion was certified.
    """
    deadline = Deadline.after(problem.deadline, clock)
    spline, prepared = solution.trajectory.spline, PreparedProblem.of(problem)
    asked = narrowed(problem, solution.start.target, solution.goal.target)
    try:
        with watch(deadline):
            energy = prepared.energy(spline)
            certificate = certify(asked, spline, solution.start.q, solution.goal.q, energy)
            energy = with_interval(
                energy, prepared.sensitivity(spline), spline.duration, problem.arm
            )
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None
    found: Solution | None = None
    failure: JoulepathError | None = None
    try:
        time_left = deadline.left - WHAT_IF.kept_share * problem.deadline
        left = replace(problem, deadline=max(time_left, WHAT_IF.least_time))
        with progress_bar("Optimising the changed arm", tell, progress) as tell:
            found = optimize(left, clock, tell, progress=False)
    except JoulepathError as error:
        failure = error
    same, objective = energy.of(problem.objective), problem.objective
    if (
        certificate.valid
        and not deadline.passed
        and (found is None or same < found.energy.of(objective) * (1 - ENERGY_TOLERANCE))
    ):
        again = _from_known(problem, spline, deadline)
        known = [each for each in (found, again) if each is not None]
        found = min(known, key=lambda each: each.energy.of(objective), default=None)
    return WhatIf(energy, certificate, found, failure if found is None else None)


def _from_known(problem: Problem, spline: Spline, deadline: Deadline) -> Solution | None:
    """Solution by a search from a feasible motion, or with the motion itself; None without time for
    it.
    """

    def run(share: float, known: list[Spline]) -> Run:
        return Run(
            replace(problem, deadline=max(share * deadline.left, WHAT_IF.least_time)),
            known,
            deadline.clock,
        )

    with suppress(JoulepathError):
        return run(WHAT_IF.warm_start_share, [spline]).solution()
    with suppress(JoulepathError):
        last = run(1.0, [])
        return last.as_it_is(spline) if last.state.allows(spline.duration) else None
    return None
