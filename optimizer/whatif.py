"""What an arm's motion would cost were the arm another: lighter links, another payload, other drives.

Two effects are told apart: what the change does to the motion that was best before it (`same_motion`), and what a
motion found for the changed arm does beside that (`reoptimised`).
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

from optimizer.certificate import certify
from optimizer.deadline import Clock, Deadline
from optimizer.exceptions import JoulepathError
from optimizer.linear_algebra import one_thread
from optimizer.optimize import optimize
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.problem import Problem, narrowed
from optimizer.search.incumbent import SLACK
from optimizer.search.run import Run
from optimizer.solution import Certificate, Energy, Solution


@dataclass(frozen=True)
class Changed:
    """A change's outcome.

    `same_motion` is the energy [J] of the base's motion on the changed arm, `certificate` whether it holds there.
    `reoptimised` is the best motion of the changed arm; None, with the `error`, where none was found.
    """

    same_motion: Energy
    certificate: Certificate
    reoptimised: Solution | None
    error: JoulepathError | None


@one_thread()
def whatif(base: Solution, problem: Problem, clock: Clock = time.perf_counter) -> Changed:
    """Hold the answer `base` against `problem`, the same motion asked of a changed arm of as many joints.

    The changed problem is solved on its own. Where the base's motion holds on the changed arm and costs less than what
    was found, it is solved again from that motion: re-optimising never costs more than not to. `problem.deadline` [s]
    holds for all of it.
    """
    deadline = Deadline.after(problem.deadline, clock)
    spline, prepared = base.trajectory.spline, PreparedProblem.of(problem)
    energy = prepared.energy(spline)
    asked = narrowed(problem, base.start.target, base.goal.target)
    certificate = certify(asked, spline, base.start.q, base.goal.q, energy)
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
            # too little time was left: the first answer stands
            return Changed(energy, certificate, found, None)
        found = min(found, again, key=lambda each: each.energy.of(problem.objective))
    return Changed(energy, certificate, found, None)
