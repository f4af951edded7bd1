"""Candidates that are left out by their first motions: none of them needs less than the answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.gaps import asked
from optimizer.optimize import optimize
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.problem import Problem
from optimizer.search.candidates import Candidate, Reason
from optimizer.search.first_motions import MOST, FirstMotions
from optimizer.search.run import Run
from optimizer.solution import CandidateStatus
from optimizer.trajectories import bspline
from optimizer.trajectories.ruckig_motion import time_optimal_positions
from optimizer.trajectories.spline import spline_of
from tests.optimizer.moves import AMPLE

SEED, ASKED_ALONE = 2, 3


def to_pose() -> Problem:
    """The first motion to a pose of least mechanical work."""
    return next(problem for kind, problem in asked(SEED, 1, AMPLE) if kind == "pose, mechanical")


def test_what_is_left_out_needs_no_less() -> None:
    run = Run(to_pose())
    solution = run.solution()
    assert solution.status == "optimal"
    left_out = [each for each in run.incumbent.candidates if each.reason is Reason.FIRST_MOTION]
    solved = sum(each.status is CandidateStatus.SOLVED for each in run.incumbent.candidates)
    assert 1 < solved <= MOST
    assert len(left_out) > 20
    assert all(each.status is CandidateStatus.PRUNED and each.energy is None for each in left_out)
    # those of least bound, and of least travel among them, are the likeliest to need less
    for each in sorted(left_out, key=lambda each: (each.lower_bound, each.shortest))[:ASKED_ALONE]:
        alone = optimize(replace(run.problem, goal=each.q_goal))
        assert alone.energy.mechanical.total > solution.energy.mechanical.total


def test_work_of_first_motions_is_that_of_their_splines() -> None:
    run = Run(to_pose())
    run.prepare()
    prepared, candidates = run.incumbent.prepared, run.incumbent.candidates[:5]
    first = FirstMotions.of(prepared, candidates)
    for each in candidates:
        assert first.of_candidate(each) == pytest.approx(_work(prepared, each), rel=1e-2)


def _work(prepared: PreparedProblem, candidate: Candidate) -> float:
    """Mechanical work [J] of the smoothed time-optimal motion of the longest duration, by the exact formulas."""
    space, longest = bspline.uniform(13), prepared.problem.duration_max
    assert longest is not None
    at = bspline.greville(space.knots)
    points = time_optimal_positions(prepared.arm.active_limits, candidate.q_start, candidate.q_goal, at)
    points[:3], points[-3:] = candidate.q_start, candidate.q_goal
    assert np.isfinite(points).all()
    return prepared.energy(spline_of(space, points, longest)).mechanical.total


def test_a_rejected_motion_opens_what_it_left_out() -> None:
    run = Run(to_pose())
    run.prepare()
    run.explore()
    incumbent = run.incumbent
    while (best := incumbent.best()) is not None:
        incumbent.reject(best)
    assert any(each.status is CandidateStatus.UNVISITED for each in incumbent.candidates)
    run.explore()
    assert incumbent.best() is not None
