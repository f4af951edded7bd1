"""Least mechanical work at a fixed duration: fates of candidates, and conditions of this search."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from joulepath import CandidateStatus, Solution, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.candidates import Reason
from joulepath.optimizer.search.coarse_motions import COARSE, CoarseSolver, best_of_each
from joulepath.optimizer.search.least_work import explore_least_work
from joulepath.optimizer.search.run import Run
from tests.optimizer.clocks import CountingClock, still
from tests.optimizer.moves import GOAL, START, fixed, problem, tcp_pose
from tests.optimizer.search.runs import prepared

DURATION = 3.0
# relative difference between local optima of two searches
LOCAL = 0.02


def run(**given: Any) -> Run:
    """A search with a preparation in no time, as the preparation time affects the deadline."""
    return prepared(
        problem(goal=tcp_pose(GOAL), **{"objective": "mechanical", **fixed(DURATION)} | given),
        clock=still,
    )


@cache
def answer(collisions: bool) -> Solution:
    return optimize(
        problem(
            goal=tcp_pose(GOAL), objective="mechanical", collisions=collisions, **fixed(DURATION)
        )
    )


def rough_work(own: Run) -> CoarseSolver:
    return CoarseSolver(own.state.prepared, DURATION)


@pytest.mark.long
@pytest.mark.parametrize("collisions", [False, True])
def test_what_becomes_of_the_candidates(collisions: bool) -> None:
    found = answer(collisions)
    work = found.energy.mechanical.total
    assert found.certificate.valid
    assert found.duration == pytest.approx(DURATION)
    assert min(each.energy for each in found.candidates if each.energy is not None) == work
    for each in found.candidates:
        if each.status is CandidateStatus.UNVISITED:
            assert (
                each.reason in (Reason.FAMILY.value, Reason.ROUGHLY.value)
                and each.lower_bound < work
            )
        if each.reason == Reason.BOUND.value:
            assert each.lower_bound >= work
    left = any(each.status is CandidateStatus.UNVISITED for each in found.candidates)
    assert found.status == ("feasible" if left else "optimal")


@pytest.mark.long
def test_as_good_as_if_all_are_solved() -> None:
    every = optimize(
        problem(goal=tcp_pose(GOAL), objective="mechanical", bound="tight", **fixed(DURATION))
    )
    assert answer(False).energy.mechanical.total <= every.energy.mechanical.total * (1 + LOCAL)


@pytest.mark.parametrize(
    "given",
    [
        {"objective": "electrical"},
        {"bound": "tight"},
        {"method": "time_scaling"},
        {"duration_min": None},
        {"deadline": 2.0},
    ],
)
def test_others_are_explored_as_before(given: dict[str, Any]) -> None:
    own = run(**given)
    assert not explore_least_work(own.state, lambda: pytest.fail("explored"))
    assert own.state.best() is None


def test_time_that_is_over_on_the_way() -> None:
    """If time runs out, every candidate is still open or reported as not reached."""
    own = run()
    own.state.end = Deadline.after(4.0, CountingClock(0.05))
    assert not explore_least_work(own.state, lambda: None)
    assert own.state.cut_short
    statuses = {each.status for each in own.state.candidates if each.holdable}
    assert statuses <= {CandidateStatus.UNVISITED, CandidateStatus.INFEASIBLE}
    assert not any(each.deferred for each in own.state.candidates)


@pytest.mark.long
def test_coarse_motions_are_sought_once_also_beside_a_known_motion() -> None:
    own = run()
    own.warm_start(answer(False).trajectory.spline)
    assert explore_least_work(own.state, lambda: None)
    assert not explore_least_work(own.state, lambda: pytest.fail("explored"))


def test_guesses_rest_at_their_ends() -> None:
    own = run()
    candidate = own.state.candidates[0]
    work = rough_work(own)
    guesses = [*work.first([candidate]), *work.random([candidate] * 4)]
    assert len(guesses) == 5
    rest = bspline.REST_POINTS
    for each in guesses:
        assert each.points.shape == (COARSE.control_points, 6)
        assert (each.points[:rest] == candidate.q_start).all()
        assert (each.points[-rest:] == candidate.q_goal).all()
        finer = each.on(24)
        assert (finer[:rest] == candidate.q_start).all() and (
            finer[-rest:] == candidate.q_goal
        ).all()


def test_rough_work_is_that_of_the_motion() -> None:
    """The rough work is nearly the exact work, and the best motion of a candidate comes first.

    The rough work uses few nodes and no penalties.
    """
    own = run()
    prepared: PreparedProblem = own.state.prepared
    chosen = [
        each for each in own.state.candidates if each.holdable and each.shortest < DURATION / 2
    ][:2]
    work = rough_work(own)
    found = work.solved(
        [*work.first(chosen), *(work.random([each])[0] for each in chosen)],
        COARSE.control_points,
        0.5,
        1e-2,
        np.inf,
    )
    assert [each.work for each in found] == sorted(each.work for each in found)
    for each in found:
        exact = prepared.objective_of(prepared.energy(each.spline(DURATION)))
        assert each.work == pytest.approx(exact, rel=0.05)
    best = best_of_each(found)
    assert len(best) == len(chosen)
    for each in best:
        others: list[Array] = [other.points for other in found if other.candidate is each.candidate]
        assert each.work == min(other.work for other in found if other.candidate is each.candidate)
        assert len(others) == 2
        assert (each.points[0] == START).all()
