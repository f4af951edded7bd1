"""Searches from other starts: from the time-optimal motion, and from ends with shorter durations.

The first kind helps motions held back by path constraints.
"""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.agreement import request
from joulepath import Arm, Bus, ConeOrientedPose, Pose, Problem, load_robot, optimize
from joulepath.app.convert.request import to_problem
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.search import refinement
from joulepath.optimizer.search.attempts import in_time, solver_of
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.least_duration_ends import with_shorter_duration
from joulepath.optimizer.search.refinement import refine, start_from_fastest
from joulepath.optimizer.search.sampled_ends import fastest_samples
from joulepath.optimizer.search.state import ENERGY_TOLERANCE, SearchState
from joulepath.optimizer.solve.methods.duration_intervals import duration_intervals
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from tests.optimizer.moves import AMPLE, problem
from tests.optimizer.search.runs import prepared
from tests.selection import long_but

# requests of the benchmark: motions held back by the speed limit of the TCP
HELD_BACK_TO_POSE = 37
HELD_BACK = 16


def asked(index: int) -> Problem:
    """A random request of the benchmark."""
    return to_problem(OptimizeRequest.model_validate(request(0, index)[1]), AMPLE)


def refined(given: Problem) -> tuple[SearchState, Candidate]:
    """The search for a problem after the best candidate is refined, without any start from the
    time-optimal motion.
    """
    run = prepared(given)
    run.explore()
    best = run.state.best()
    assert best is not None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(refinement, "start_from_fastest", lambda state, candidate: None)
        refine(run.state, best)
    return run.state, best


def from_fastest(state: SearchState, best: Candidate) -> float:
    """Least energy [J] of the motions found from the time-optimal motion."""
    (interval,) = duration_intervals(state.prepared, best.q_goal)
    found = [
        in_time(state, lambda t=t: solver_of(state, best, interval).solve_from_fastest(t))
        for t in (0.0, best.spline.duration)
    ]
    return min(state.prepared.cost_of(each.spline) for each in found if each.spline is not None)


@pytest.mark.parametrize("index", long_but([HELD_BACK], [HELD_BACK_TO_POSE, HELD_BACK]))
def test_an_answer_needs_no_more_than_what_the_time_optimal_motion_leads_to(index: int) -> None:
    state, best = refined(asked(index))
    least = from_fastest(state, best)
    # the refined motion alone is not the answer
    assert best.energy is not None and least < best.energy * (1 - 5e-4)
    found = optimize(asked(index))
    assert found.certificate.valid
    assert found.energy.electrical.total <= least * (1 + ENERGY_TOLERANCE)


def test_a_slowed_guess_lasts_as_long_as_asked() -> None:
    state, best = refined(asked(HELD_BACK))
    (interval,) = duration_intervals(state.prepared, best.q_goal)
    solver = solver_of(state, best, interval)
    assert isinstance(solver, FreeSpline)
    fastest, slowed = (
        solver.time_optimal_guess(),
        solver.time_optimal_guess(2 * best.spline.duration),
    )
    assert slowed.duration == 2 * best.spline.duration > fastest.duration
    for guess in (fastest, slowed):
        assert np.abs(guess.points[[0, -1]] - [best.q_start, best.q_goal]).max() < 1e-9


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"tcp_speed": 5.0},
        pytest.param({"bus": Bus(mode="isolated")}, marks=pytest.mark.long),
    ],
)
def test_a_motion_that_nothing_holds_back_is_not_solved_again(given: dict[str, object]) -> None:
    state, best = refined(problem(**given))
    solves, energy = state.solves, best.energy
    start_from_fastest(state, best)
    assert (state.solves, best.energy) == (solves, energy)


# m, rad: the certificate's tolerance at an end
REACHED = 1e-6


def between_samples(robot: str, seed: int, free: bool) -> Problem:
    """A problem from joint positions to a pose with a sampled posture or a free orientation."""
    arm = Arm(robot=load_robot(robot), collisions=False)
    rng = np.random.default_rng(seed)
    limits = arm.robot.limits
    start, goal = rng.uniform(0.8 * limits.q_min, 0.8 * limits.q_max, (2, arm.robot.nq))
    pose = Pose(tcp_pose(arm, goal))
    target = ConeOrientedPose(pose.T[:3, 3]) if free else pose
    return Problem(arm=arm, start=start, goal=target, deadline=AMPLE)


@pytest.mark.long
@pytest.mark.parametrize(("robot", "free"), [("panda", False), ("ur5e", True)])
def test_they_reach_the_target_in_less_time(robot: str, free: bool) -> None:
    helped = 0
    for seed in range(3):
        problem = between_samples(robot, seed, free)
        run = prepared(problem)
        pose = problem.goal.T if isinstance(problem.goal, Pose) else None
        for candidate in fastest_samples(run.state.candidates)[:4]:
            found = with_shorter_duration(run.state.prepared, candidate)
            if found is None:
                continue
            helped += 1
            assert found.shortest < candidate.shortest
            least = shortest_duration(found.q_goal - found.q_start, problem.arm.active_limits)
            assert found.shortest == pytest.approx(float(least))
            assert (found.q_start == candidate.q_start).all()
            T = tcp_pose(problem.arm, found.q_goal)
            if pose is not None:
                assert np.abs(T - pose).max() < REACHED
            else:
                assert isinstance(problem.goal, ConeOrientedPose)
                assert np.abs(T[:3, 3] - problem.goal.position).max() < REACHED
    assert helped > 3


def test_few_samples_are_tried_also_where_many_are_open() -> None:
    """Few samples get a fastest motion, even if many candidates are open.

    Otherwise the search would compute the fastest motions of all neighbours on a self-motion.
    """
    run = prepared(between_samples("panda", 0, free=False))
    candidates = run.state.candidates
    deferred = fastest_samples(candidates)
    for each in candidates:
        each.activate()
    assert [*map(id, fastest_samples(candidates))] == [*map(id, deferred)]
    assert 0 < len(deferred) < len(candidates) / 4
