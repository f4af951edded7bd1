"""The answer of a search: a motion with its certificate, energy, bound and report."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.optimizer.bounds.free_goal_bound import bound_of_free_goals
from joulepath.optimizer.bounds.missed_branches import all_branches_known, bound_of_missed_branches
from joulepath.optimizer.bounds.raised_bounds import raised_bounds
from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.dynamics.interval import MotionEnergy, with_interval
from joulepath.optimizer.progress import Improved
from joulepath.optimizer.result.baseline import Baseline
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.result.energy import Objective
from joulepath.optimizer.result.solution import Configuration, LimitsInForce, Solution, SolverReport
from joulepath.optimizer.search.baselines import standing, with_savings
from joulepath.optimizer.search.candidates import Candidate, Reason
from joulepath.optimizer.search.path_ends import bound_beside
from joulepath.optimizer.search.state import SearchState


@dataclass(frozen=True)
class AnswerSettings:
    """Settings of an answer."""

    overtime: float = 0.1
    """Time after the deadline at which a certificate is given up [s]: an answer a little late is
    better than none."""
    mechanical_gap: float = 0.01
    """Greatest `optimality_gap` of mechanical work that is called `optimal`.

    A motion has many local optima of mechanical work. Of 47 answers whose other candidates were all
    ruled out or solved, 25 were more than 0.5 % above the best motion known and one was 13 % above
    it, so convergence alone proves nothing. Electrical energy has hardly any local optima that
    matter: it suffices that the solver converges and that bounds rule out all other candidates.
    """


ANSWER = AnswerSettings()


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
        with watch(state.end.earlier_by(-ANSWER.overtime)):
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


def final_bound(state: SearchState, objective: float) -> tuple[float, bool]:
    """Lower bound of all motions, after raising the bounds of candidates below an objective.

    Candidates whose bounds are not below the objective are settled as pruned.

    Args:
        state: state of the search.
        objective: objective of the answer [J].

    Returns:
        The bound [J], and whether bounds prove that no unsolved candidate is better.
    """
    prepared, candidates, deadline = state.prepared, state.candidates, state.deadline
    raised = raised_bounds(prepared, candidates, objective, deadline)
    for candidate, bound in zip(candidates, raised, strict=True):
        candidate.lower_bound = bound
    unsolved = [
        each
        for each in candidates
        if each.status in (CandidateStatus.UNVISITED, CandidateStatus.FAILED)
    ]
    for candidate in unsolved:
        if candidate.lower_bound >= objective:
            candidate.settle(CandidateStatus.PRUNED, Reason.BOUND)
    # only samples of self-motions and free orientations are solved: a bound rules out the others
    unknown, beside = bound_of_missed_branches(prepared, candidates, deadline), np.inf
    if state.problem.tool_path is None:
        free = bound_of_free_goals(prepared, candidates, deadline, objective)
        unknown = min(unknown, free)
    else:
        beside = bound_beside(prepared, candidates, deadline, objective)
        if any(each.sampled for each in candidates):
            unknown = min(unknown, beside)
    # an end without the clearance reserve of the search may still have motions
    unsearched = min((each.lower_bound for each in candidates if not each.holdable), default=np.inf)
    is_ruled_out = (
        all(each.status is CandidateStatus.PRUNED for each in unsolved)
        and min(unknown, unsearched) >= objective
    )
    least = min([unknown, beside, *(each.lower_bound for each in candidates if not each.sampled)])
    return least, is_ruled_out and all_branches_known(state.problem)


def may_be_optimal(
    objective: Objective,
    energy: float,
    lower_bound: float,
    settings: AnswerSettings = ANSWER,
) -> bool:
    """Whether the gap between an energy and its lower bound allows the word `optimal`.

    Args:
        objective: the objective.
        energy: objective of the answer [J].
        lower_bound: lower bound of all motions [J].
        settings: settings of the condition.
    """
    if objective == "electrical":
        return True
    return energy <= (1 + settings.mechanical_gap) * lower_bound
