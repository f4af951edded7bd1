"""Public entry point: `what_if(solution, problem)` compares a motion with that of another arm.

The change may be lighter links, another payload or other drives. It has two effects, reported
apart: the energy of the same motion on the changed arm (`same_motion`), and the energy of a motion
optimised for it (`reoptimised`).
"""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass, replace

from joulepath.optimizer.certificate import certify
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, watch
from joulepath.optimizer.dynamics.interval import with_interval
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import Problem, narrowed
from joulepath.optimizer.result.certificate import Certificate
from joulepath.optimizer.result.energy import Energy
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.search.state import ENERGY_TOLERANCE

# least deadline of a search [s]; shares of the time that the first search leaves to the known
# motion, and of what is left then for a search from it
LEAST_TIME, KEPT, SOLVED = 1e-3, 0.05, 0.8


@dataclass(frozen=True)
class WhatIf:
    """Result of a change.

    `same_motion` is the energy [J] of the known motion on the changed arm, `certificate` says
    whether it is feasible there. `reoptimised` is the best motion of the changed arm; None, with
    the `error`, if none was found.
    """

    same_motion: Energy
    certificate: Certificate
    reoptimised: Solution | None
    error: JoulepathError | None


@one_thread()
def what_if(solution: Solution, problem: Problem, clock: Clock = time.perf_counter) -> WhatIf:
    """Compare a motion with the best one of a changed arm.

    The changed problem is solved on its own. If the known motion is feasible on the changed arm and
    needs less energy than the new one, or there is none, the problem is solved again with a warm
    start from it; where time is too short for that, the known motion is the answer. So no answer
    needs more energy than a feasible known motion.

    Args:
        solution: solution of the problem without the change.
        problem: the same problem with the change, as by `dataclasses.replace(problem, arm=…)`, of
            an
            arm with as many joints. Its `deadline` holds for the whole comparison.
        clock: function that returns the time [s].

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
        found = optimize(
            replace(problem, deadline=max(deadline.left - KEPT * problem.deadline, LEAST_TIME)),
            clock,
        )
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
    """The solution from a feasible motion on, or this motion as it is; None if there is no time for
    that either.
    """

    def run(share: float, known: list[Spline]) -> Run:
        return Run(
            replace(problem, deadline=max(share * deadline.left, LEAST_TIME)), known, deadline.clock
        )

    with suppress(JoulepathError):
        return run(SOLVED, [spline]).solution()
    with suppress(JoulepathError):
        last = run(1.0, [])
        return last.as_it_is(spline) if last.state.allows(spline.duration) else None
    return None
