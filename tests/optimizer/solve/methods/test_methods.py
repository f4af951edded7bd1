"""The methods against each other: answers are certified, and none is below a wider space's answer.

Limits, fixed durations and deadlines of the methods are tested in `test_sqp_method`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest

from joulepath import DurationTooShort, Solution, optimize
from joulepath.optimizer.deadline import NEVER
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.motion.ruckig_motion import time_optimal_spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.search.candidates import bound, pairs
from joulepath.optimizer.search.ends import ends
from joulepath.optimizer.solve.methods import METHODS, polynomial_ga
from joulepath.optimizer.solve.methods.method import with_excess
from joulepath.optimizer.solve.methods.polynomial_ga import PolynomialGA
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import SolveResult
from tests.optimizer.clocks import LAST_READINGS, CountingClock
from tests.optimizer.moves import (
    GOAL,
    PAYLOAD,
    ROBOT,
    START,
    TILTED,
    fixed,
    limits,
    problem,
    random_moves,
    tcp_pose,
)
from tests.selection import long_but

# relative excess of the energy in a wider space over a narrower space: both are solved to 5e-5,
# with smoothed friction
WIDER_SPACE = 2e-3
# relative tolerance of the least energy over factors, with factors found to 1e-5
LEAST_ENERGY = 1e-6


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:
    compile_kernel(ROBOT)


def electrical(solution: Solution) -> float:
    return solution.energy.electrical.total


def solved(method: str, start: Any = START, goal: Any = GOAL, **given: Any) -> Solution:
    solution = optimize(problem(start, goal, method=method, **given))
    assert solution.certificate.valid
    assert solution.lower_bound <= electrical(solution)
    return solution


def test_every_method_is_there() -> None:
    assert set(METHODS) == set(get_args(MethodName))


CONDITIONS: list[dict[str, Any]] = [
    {},
    {"payload": PAYLOAD, "gravity": TILTED},
    {"limits": limits(j_max=40.0)},
]


@pytest.mark.parametrize("number", long_but([1], range(len(CONDITIONS))))
def test_a_free_spline_spends_least(number: int) -> None:
    """Other methods give splines too, or motions close to splines."""
    given = CONDITIONS[number]
    for start, goal in random_moves(51, 3):
        best = electrical(solved("bspline", start, goal, **given))
        for method in METHODS:
            if method != "bspline":
                assert best <= electrical(solved(method, start, goal, **given)) * (
                    1 + WIDER_SPACE
                ), method


def test_a_polynomial_is_one() -> None:
    spline = solved("lagrange").trajectory.spline
    assert len(np.unique(spline.knots)) == 2 and len(spline.control_points) == spline.degree + 1


def test_a_polynomial_keeps_inside_its_joint_range() -> None:
    """Joints free to move draw the load in while the base swings."""
    goal = START + np.array([2.5, 0, 0, 0, 0, 0])
    lower, upper = np.minimum(START, goal) - 0.003, np.maximum(START, goal) + 0.003
    q = solved("lagrange", START, goal).trajectory.q
    assert (q < lower).any() or (q > upper).any()
    solution = solved(
        "lagrange", START, goal, limits=replace(ROBOT.limits, q_min=lower, q_max=upper)
    )
    q = solution.trajectory.q
    assert (q >= lower).all() and (q <= upper).all()


def test_a_polynomial_may_start_and_end_on_its_limits() -> None:
    own = replace(ROBOT.limits, q_min=np.minimum(START, GOAL), q_max=np.maximum(START, GOAL))
    assert electrical(solved("lagrange", limits=own)) >= electrical(solved("lagrange")) * (
        1 - WIDER_SPACE
    )


def test_a_polynomial_spends_no_more_than_the_quintic_that_it_could_be() -> None:
    for start, goal in random_moves(52, 4):
        solution = solved("lagrange", start, goal)
        quintic = next(each for each in solution.baselines if each.name == "quintic")
        assert not quintic.within_limits or electrical(solution) <= quintic.electrical * (1 + 1e-4)


def test_the_factor_is_the_best_of_many() -> None:
    """No other factor gives less energy, in a comparison with a hundred factors."""
    for start, goal in random_moves(53, 4):
        task = PreparedProblem.of(problem(start, goal, method="uniform_scaling"))
        solution = solved("uniform_scaling", start, goal)
        given = time_optimal_spline(ROBOT.limits, start, goal)
        shortest = solution.trajectory.spline.knots / solution.duration * given.duration
        assert shortest == pytest.approx(given.knots, abs=1e-12)
        for factor in np.geomspace(1.0, 6.0, 100):
            slower = replace(given, knots=given.knots * factor)
            tau = solution.certificate.worst_ratio["torque"]
            if tau < 0.99:  # else the factor may be that at which torque holds
                other = task.energy(slower).electrical.total
                assert electrical(solution) <= other * (1 + LEAST_ENERGY)


def test_a_tighter_torque_limit_needs_a_greater_time_scale() -> None:
    """The motion of an arm with little torque takes longer and stays within the limit."""
    weak = limits(tau_max=[45, 70, 50, 28, 28, 28])
    strong, slow = solved("uniform_scaling"), solved("uniform_scaling", limits=weak)
    assert slow.duration > strong.duration
    assert 0.99 < slow.certificate.worst_ratio["torque"] <= 1


@pytest.mark.parametrize("method", ["lagrange", "uniform_scaling"])
def test_a_duration_below_the_method_s_own_is_refused(method: str) -> None:
    with pytest.raises(DurationTooShort) as caught:
        solved(method, **fixed(0.3))
    again = solved(method, **fixed(caught.value.shortest * 1.02))
    assert again.duration == pytest.approx(caught.value.shortest * 1.02)


@pytest.mark.parametrize("method", ["lagrange", "uniform_scaling"])
def test_poses_are_searched_over_all_branches(method: str) -> None:
    solution = solved(method, tcp_pose(START), tcp_pose(GOAL), windings=False)
    assert solution.status == "optimal" and len(solution.candidates) > 8
    assert {each.status for each in solution.candidates} <= {"solved", "pruned", "infeasible"}


@pytest.mark.parametrize("method", ["lagrange", "uniform_scaling"])
def test_mechanical_work(method: str) -> None:
    quick, slow = (solved(method, objective="mechanical", duration_max=most) for most in (1.2, 3.0))
    assert slow.energy.mechanical.total < quick.energy.mechanical.total
    assert slow.duration <= 3.0


# all generations of the genetic algorithm, for the test of its improvement
ALL = polynomial_ga.POLYNOMIAL_GA


def by_genetic_algorithm(
    start: Any = START, goal: Any = GOAL, **given: Any
) -> tuple[PolynomialGA, SolveResult]:
    task = PreparedProblem.of(problem(start, goal, method="polynomial_ga", **given))
    solver = PolynomialGA(SolveContext.of(task, start, goal, NEVER))
    return solver, solver.solve()


@pytest.mark.long
def test_the_genetic_algorithm_is_deterministic_and_improves_on_its_first_population(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(polynomial_ga, "POLYNOMIAL_GA", ALL)
    solver, attempt = by_genetic_algorithm()
    _, again = by_genetic_algorithm()
    assert attempt.spline is not None and again.spline is not None
    assert (attempt.spline.control_points == again.spline.control_points).all()
    assert attempt.spline.duration == again.spline.duration
    # the improvement exceeds the cost of bringing the motion within its limits
    assert solver.prepared.energy(attempt.spline).electrical.total < 0.999 * solver.first_cost
    assert attempt.iterations == solver.generations > 0


def test_the_deadline_ends_the_genetic_algorithm() -> None:
    readings = 30
    solution = optimize(problem(method="polynomial_ga", deadline=float(readings)), CountingClock())
    assert solution.certificate.valid and solution.status == "feasible"
    assert 0 < solution.solver.iterations < readings
    assert solution.solver.wall_time < readings + LAST_READINGS


def test_the_genetic_algorithm_solves_a_few_candidates_and_says_so_of_the_others() -> None:
    solution = optimize(
        problem(tcp_pose(START), tcp_pose(GOAL), method="polynomial_ga", windings=False)
    )
    solved_ones = [each for each in solution.candidates if each.status == "solved"]
    left = [each for each in solution.candidates if each.status == "unvisited"]
    assert 0 < len(solved_ones) <= 3 and solution.status == "feasible"
    assert all("no more than 3 candidates" in each.reason for each in left)
    # in the order of their bounds, before these are raised
    asked = PreparedProblem.of(problem(tcp_pose(START), tcp_pose(GOAL), windings=False))
    known = pairs(asked, ends(asked, "start")[0], ends(asked, "goal")[0])
    bound(asked, known)
    plain = {each.q_start.tobytes() + each.q_goal.tobytes(): each.lower_bound for each in known}
    first, last = (
        [plain[e.q_start.tobytes() + e.q_goal.tobytes()] for e in some]
        for some in (solved_ones, left)
    )
    assert not left or max(first) <= min(last)


@pytest.mark.parametrize("cost", [5.0, -5.0])
def test_a_torque_beyond_its_limit_costs_more_even_if_the_cost_is_below_zero(cost: float) -> None:
    """Costs are negative if less waiting is a gain: infeasible durations must not be preferred."""
    own = ROBOT.limits
    within, beyond = (with_excess(cost, share * own.tau_max[None], own) for share in (0.9, 1.5))
    assert within == cost and beyond == pytest.approx(cost + 2.5)
