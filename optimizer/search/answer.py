"""The answer of a search: a motion with its certificate, energy, bound and report."""

from __future__ import annotations

from joulepath.optimizer.bounds.missed_branches import all_branches_known
from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.dynamics.interval import MotionEnergy, with_interval
from joulepath.optimizer.progress import Improved
from joulepath.optimizer.result.baseline import Baseline
from joulepath.optimizer.result.solution import Configuration, LimitsInForce, Solution, SolverReport
from joulepath.optimizer.search.baselines import standing, with_savings
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.final_bound import final_bound
from joulepath.optimizer.search.optimality import may_be_optimal
from joulepath.optimizer.search.state import SearchState

OVERTIME = 0.1
"""Time after the deadline at which a certificate is given up [s].

An answer a little late is better than none.
"""


def answer(state: SearchState, best: Candidate, baselines: list[Baseline]) -> Solution | None:
    """The solution with the motion of a candidate; None if its certificate is not valid.

    Args:
        state: state of the search.
        best: solved candidate.
        baselines: baselines of its motion.

    Raises:
        DeadlineExceeded: the certificate was not ready in time.
    """
    spline, prepared, problem = best.spline, state.prepared, state.problem
    try:
        with watch(state.end.earlier_by(-OVERTIME)):
            energy = prepared.energy(spline)
            certificate = state.certified(best, spline, energy)
            if not certificate.valid:
                return None
            trajectory = prepared.trajectory(spline, problem.sample_period)
            sensitivity = prepared.sensitivity(spline)
            unmodelled = prepared.surroundings.unmodelled_contacts(spline)
    except DeadlinePassed:
        raise state.too_late() from None
    objective = energy.of(problem.objective)
    bound, is_ruled_out = final_bound(state, objective)
    is_proven = (
        is_ruled_out and not state.cut_short and may_be_optimal(problem.objective, objective, bound)
    )
    assert best.attempt is not None
    state.tell(Improved(objective, spline.duration, bound, best.q_goal))
    arm = problem.arm
    return Solution(
        status="optimal" if is_proven and state.method.converges else "feasible",
        start=Configuration(best.start.label, best.q_start, best.start.target),
        goal=Configuration(best.goal.label, best.q_goal, best.goal.target),
        trajectory=trajectory,
        energy=with_interval(energy, sensitivity, spline.duration, arm),
        sensitivity=sensitivity,
        objective=problem.objective,
        lower_bound=bound,
        limits=LimitsInForce.of(arm.active_limits, arm.tcp_speed, arm.elbow_speed),
        complete=all_branches_known(problem),
        baselines=with_savings(
            baselines,
            problem,
            MotionEnergy(energy.electrical.total, sensitivity, spline.duration),
            standing(arm, best.q_goal, prepared.torques),
        ),
        candidates=[each.report() for each in state.candidates],
        unreachable=state.unreachable,
        certificate=certificate,
        unmodelled=unmodelled,
        solver=SolverReport(
            wall_time=state.clock() - state.began,
            iterations=state.iterations,
            nlp_solves=state.solves,
            stationarity=best.attempt.stationarity,
        ),
    )
