"""Public entry point: `whatif(base, problem)` compares a motion with the best one of a changed arm.

The change may be lighter links, another payload or other drives. It has two effects, reported apart: the energy of the
same motion on the changed arm (`same_motion`), and the energy of a motion optimised for it (`reoptimised`).
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

from optimizer.certificate import certify
from optimizer.deadline import Clock, Deadline, DeadlinePassed, watch
from optimizer.energy.interval import with_interval
from optimizer.exceptions import DeadlineExceeded, JoulepathError
from optimizer.linear_algebra import one_thread
from optimizer.optimize import optimize
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.problem import Problem, narrowed
from optimizer.search.incumbent import SLACK
from optimizer.search.run import Run
from optimizer.solution import Certificate, Energy, Solution

# least deadline of a search [s]
LEAST_TIME = 1e-3


@dataclass(frozen=True)
class Changed:
    """Result of a change.

    `same_motion` is the energy [J] of the base motion on the changed arm, `certificate` says whether it is feasible
    there. `reoptimised` is the best motion of the changed arm; None, with the `error`, if none was found.
    """

    same_motion: Energy
    certificate: Certificate
    reoptimised: Solution | None
    error: JoulepathError | None


@one_thread()
def whatif(base: Solution, problem: Problem, clock: Clock = time.perf_counter) -> Changed:
    """Compare the answer `base` with that of `problem`, the same motion for a changed arm with as many joints.

    The changed problem is solved on its own. If the base motion is feasible on the changed arm and needs less energy
    than the new motion, the problem is solved again with a warm start from it. The result then needs no more energy
    than the base motion, unless the deadline passes first. `problem.deadline` [s] holds for all of it. Raises
    DeadlineExceeded if it passes before the base motion is certified on the changed arm.
    """
    deadline = Deadline.after(problem.deadline, clock)
    spline, prepared = base.trajectory.spline, PreparedProblem.of(problem)
    asked = narrowed(problem, base.start.target, base.goal.target)
    try:
        with watch(deadline):
            energy = prepared.energy(spline)
            certificate = certify(asked, spline, base.start.q, base.goal.q, energy)
            energy = with_interval(energy, prepared.sensitivity(spline), spline.duration, problem.arm)
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None
    problem = replace(problem, deadline=max(deadline.left, LEAST_TIME))
    try:
        found = optimize(problem, clock)
    except JoulepathError as error:
        return Changed(energy, certificate, None, error)
    left = deadline.left
    same, best = energy.of(problem.objective), found.energy.of(problem.objective)
    if certificate.valid and same < best * (1 - SLACK) and left > 0:
        try:
            again = Run(replace(problem, deadline=left), [spline], clock).solution()
        except JoulepathError:
            # the time left was too short: the first answer counts
            return Changed(energy, certificate, found, None)
        found = min(found, again, key=lambda each: each.energy.of(problem.objective))
    return Changed(energy, certificate, found, None)
