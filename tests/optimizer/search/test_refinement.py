"""Refinement of the best motion: cheaper baselines, other goals, energy storage, sharper corners
and a sharper cost.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.agreement import P95, request
from joulepath import Arm, Bus, Problem, load_robot, optimize
from joulepath.app.convert.request import to_problem
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.attempts import solve
from joulepath.optimizer.search.branch_and_bound import explore
from joulepath.optimizer.search.sharpening import sharpen
from joulepath.optimizer.search.sharper_cost import SHARPER_COST, SharperCostSettings, sharpen_cost
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods.duration_intervals import duration_intervals
from tests.optimizer.clocks import still
from tests.optimizer.moves import AMPLE, PAYLOAD, ROBOT, fixed, problem
from tests.optimizer.search.runs import prepared

# relative: a spline is slower than its original motion by Ruckig if jumps of jerk are close
MERGED = 2e-5
# relative: solves of one optimum end this far apart
SCATTER = 1e-3
# relative: half of the saving of another goal, since optima depend on the processor
SAVED = 6e-4
ELBOW_UP = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
# a motion by Ruckig with jumps of jerk so close that its spline exceeds the jerk limit by 6e-6
CLOSE_JUMPS = np.array(
    [
        [
            -0.72865225814,
            0.18652150697,
            0.42934765888,
            1.10586557770,
            -1.58408477987,
            -1.51099084960,
            -0.46547461087,
        ],
        [
            -0.02886765135,
            -0.51326309981,
            0.73086005908,
            1.13263774297,
            -0.78191909962,
            -0.58701496522,
            0.28848547281,
        ],
    ]
)


def test_a_better_baseline_is_taken_even_if_rounding_breaks_a_limit() -> None:
    found = optimize(problem(*CLOSE_JUMPS, robot=load_robot("gen3")))
    assert found.certificate.valid
    assert min(each.saving for each in found.baselines if each.within_limits) > -MERGED


@pytest.mark.long
def test_no_motion_of_near_duration_stores_more_to_advantage() -> None:
    """The answer stores as much to advantage as any motion of a similar duration.

    The storage just takes all surplus. The value of a joule of surplus in the best motion is then
    nearly the highest one: coarser values cost 1.6 % here.
    """
    rng = np.random.default_rng(0)
    q_start, q_goal = ELBOW_UP + rng.uniform(-0.8, 0.8, (2, 6))
    bus = Bus("storage", 0.9, 5.0, 200.0)
    asked = problem(q_start, q_goal, payload=PAYLOAD, bus=bus)
    found = optimize(asked, still)
    assert found.energy.storage is not None and found.energy.storage.charged > 0
    least = found.energy.electrical.total * (1 - SCATTER)
    for ratio in (0.95, 1.05):
        other = optimize(replace(asked, **fixed(ratio * found.duration)), still)
        assert other.energy.electrical.total > least
    bounded = replace(asked, duration_min=0.99 * found.duration, duration_max=found.duration)
    within = optimize(bounded, still)
    assert bounded.duration_min is not None
    assert bounded.duration_min <= within.duration <= found.duration
    assert within.energy.electrical.total > least


# relative; promised against the best of many starts with as many control points
PROMISED = 5e-3
# a motion in a given time [s], and its least known mechanical energy [J]
BEST_START = np.array(
    [-1.0563769171, 0.7030631375, 0.0479574165, -2.1595422481, 1.9102876515, -3.0230673183]
)
BEST_GOAL = np.array(
    [-2.6596545658, -0.3932695539, 2.8468960492, 1.9756345344, -1.3513098591, 0.5445385554]
)
BEST_DURATION = 3.977043743
BEST_ENERGY = 44.05294296


def explored(**given: Any) -> SearchState:
    """A search with solved but unrefined candidates."""
    run = prepared(problem(**given))
    state = run.state
    explore(
        state.prepared,
        state.candidates,
        lambda each: solve(state, each),
        state.deadline,
    )
    return state


def test_as_good_as_the_best_of_many_starts() -> None:
    """The least work at a fixed duration matches the best of 16 starts on 40 control points."""
    task = Problem(
        arm=Arm(robot=ROBOT, collisions=False),
        start=BEST_START,
        goal=BEST_GOAL,
        objective="mechanical",
        duration_min=BEST_DURATION,
        duration_max=BEST_DURATION,
        deadline=AMPLE,
    )
    assert optimize(task).energy.mechanical.total <= BEST_ENERGY * (1 + PROMISED)


@pytest.mark.parametrize(
    "given",
    [
        {"objective": "mechanical", "duration_max": 1.5},
        pytest.param({"bus": Bus(mode="isolated")}, marks=pytest.mark.long),
    ],
)
def test_sharper_corners_need_less(given: dict[str, Any]) -> None:
    state = explored(**given)
    before = state.best()
    assert before is not None and before.energy is not None
    energy = before.energy
    sharpen(state, before)
    after = state.best()
    assert after is not None and after.energy is not None
    assert after.energy < energy
    # the candidate's energy is the energy of its motion by the exact formulas
    prepared: PreparedProblem = state.prepared
    assert after.energy == prepared.objective_of(prepared.energy(after.spline))


@pytest.mark.parametrize(
    "given", [{}, {"method": "uniform_scaling", "objective": "mechanical", "duration_max": 1.5}]
)
def test_nothing_is_solved_again_without_corners_or_even_spacing(given: dict[str, Any]) -> None:
    state = explored(**given)
    best = state.best()
    assert best is not None
    spline, solves = best.spline, state.solves
    sharpen(state, best)
    assert best.spline is spline and state.solves == solves


def test_no_time_is_left() -> None:
    """After the deadline, sharpening leaves the motion unchanged."""
    state = explored(objective="mechanical", duration_max=1.5)
    best = state.best()
    assert best is not None
    spline = best.spline
    state.end = Deadline.after(-1.0)
    sharpen(state, best)
    assert best.spline is spline


# request of the benchmark with a heavy payload going down: 280 J flow for a net use of 7 J
DESCENT = 13
SHORTER = 0.97


def descent() -> Problem:
    """The request, with the goal configuration of its answer as the goal."""
    given = to_problem(OptimizeRequest.model_validate(request(0, DESCENT)[1]), AMPLE)
    run = prepared(given)
    nearest = min(run.state.candidates, key=lambda each: each.shortest)
    return replace(given, goal=nearest.q_goal)


@pytest.mark.long
def test_a_shorter_duration_needs_no_less_where_little_energy_is_left() -> None:
    given = descent()
    free = optimize(given)
    duration = SHORTER * free.duration
    fixed = optimize(replace(given, duration_min=duration, duration_max=duration))
    assert free.certificate.valid
    least, energy = fixed.energy.electrical.total, free.energy.electrical.total
    assert energy < least * (1 + P95)


@pytest.mark.parametrize(
    ("given", "error", "is_solved"),
    [
        ({}, SHARPER_COST.error, False),
        ({}, 0.0, True),
        ({"duration_min": 2.0, "duration_max": 2.0}, 0.0, True),
        ({"bus": Bus(mode="isolated")}, 0.0, False),
    ],
)
def test_only_an_imprecise_cost_is_sharpened(
    given: dict[str, Any], error: float, is_solved: bool
) -> None:
    run = prepared(problem(**given))
    run.explore()
    best = run.state.best()
    assert best is not None
    solves = run.state.solves
    sharpen_cost(run.state, best, SharperCostSettings(error=error))
    assert (run.state.solves > solves) == is_solved


def test_sharper_corners_bring_the_cost_near_the_exact_power() -> None:
    """Sharper corners at least halve the error of the power.

    A slow joint against gravity has its friction and its power close to their corners.
    """
    run = prepared(descent())
    task, goal = run.state.prepared, run.state.candidates[0].q_goal
    (smooth,) = duration_intervals(task, goal)
    (sharp,) = duration_intervals(task, goal, width=0.1, friction_share=0.15)
    state = np.concatenate([goal, np.full(len(goal), 0.01), np.zeros(len(goal))])[None]
    (smoothed,), _ = task.kernel.value(state, smooth.p)
    (sharper,), _ = task.kernel.value(state, sharp.p)
    (exact,), _ = task.kernel.value(
        state, task.parameters(electrical=1.0, width=0.0, friction_share=0.05)
    )
    assert abs(sharper - exact) < abs(smoothed - exact) / 2
