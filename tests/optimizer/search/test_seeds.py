"""Seeds of redundant arms are at the least estimated energies of self-motions; ends then slide."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from benchmarks.tasks import collision_free
from joulepath import Arm, Bus, CandidateStatus, Payload, Pose, Problem, load_robot, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.search.seeds import (
    SEEDS,
    activate_seeds,
    estimates,
)
from tests.optimizer.search.runs import prepared
from tests.selection import long_but

# s: far more than any search takes, even on a busy machine
AMPLE = 300.0
# largest ratio of an estimate to the least energy; estimates are motions with two parameters
HIGHEST = 1.4
# m, rad
HELD = 1e-9
# s: several times the best duration
SLOW = 8.0
# relative: an estimate is a quadrature of a few points, of smoothed friction and corners
FEW_POINTS = 1e-2
# relative: from a seed, a motion comes to a local optimum
LOCAL = 0.1


def problem_of(name: str, index: int, both: bool = False) -> Problem:
    """A random task to a pose, from a pose too if `both`."""
    robot = load_robot(name)
    rng = np.random.default_rng([0, index])
    arm, start, goal = Arm(robot=robot), collision_free(rng, robot), collision_free(rng, robot)
    pose = [Pose(tcp_pose(arm, q)) for q in (start, goal)]
    return Problem(arm=arm, start=pose[0] if both else start, goal=pose[1], deadline=AMPLE)


@cache
def seeded(name: str, index: int, both: bool = False) -> Run:
    return prepared(problem_of(name, index, both))


@pytest.mark.parametrize("name", long_but(["gen3"], ["panda", "gen3"]))
def test_estimates_are_above_the_lower_bounds_and_near_the_least_energy(name: str) -> None:
    run = seeded(name, 1)
    known = [each for each in run.state.candidates if each.deferred]
    energy = estimates(run.state.prepared, known)
    assert (energy >= np.array([each.lower_bound for each in known])).all()
    least = optimize(run.problem).energy.electrical.total
    assert least <= energy.min() <= HIGHEST * least


def test_estimates_are_of_motions_in_the_time_that_is_asked_for() -> None:
    asked = replace(problem_of("panda", 1), duration_min=SLOW, duration_max=SLOW)
    run = prepared(asked)
    some = run.state.candidates[::9]
    energy = [
        run.state.prepared.energy(quintic_spline(each.q_start, each.q_goal, SLOW)).electrical.total
        for each in some
    ]
    np.testing.assert_allclose(estimates(run.state.prepared, some), energy, rtol=FEW_POINTS)


@pytest.mark.long
def test_of_work_more_is_tried_than_what_the_straight_line_says() -> None:
    """For mechanical work, the search also tries postures with a costly straight line.

    Such a posture may need less than others on its best motion.
    """
    robot, rng = load_robot("panda"), np.random.default_rng([77, 0])
    arm, start, goal = Arm(robot=robot), collision_free(rng, robot), collision_free(rng, robot)
    given: dict[str, Any] = {
        "arm": arm,
        "objective": "mechanical",
        "duration_max": 3.0,
        "deadline": AMPLE,
    }
    found = optimize(Problem(start=start, goal=Pose(tcp_pose(arm, goal)), **given))
    good = np.array([2.4536, -0.9365, -0.8697, -0.7589, -0.7433, 0.4103, 0.4834])
    assert np.abs(tcp_pose(arm, good) - tcp_pose(arm, goal)).max() < 1e-3
    known = optimize(Problem(start=start, goal=good, **given))
    assert found.energy.mechanical.total <= known.energy.mechanical.total * (1 + LOCAL)


@pytest.mark.parametrize("both", [False, True], ids=["to a pose", "between poses"])
def test_seeds_are_the_least_along_their_self_motions(both: bool) -> None:
    run = prepared(problem_of("panda", 7, both))
    state = run.state
    before = [each for each in state.candidates if each.deferred]
    assert activate_seeds(state.prepared, state.candidates)
    seeds = [each for each in before if not each.deferred]
    assert 0 < len(seeds) <= SEEDS.count
    assert all(each.status is CandidateStatus.UNVISITED for each in seeds)
    energy = dict(zip(before, estimates(state.prepared, before), strict=True))
    assert max(energy[each] for each in seeds) <= SEEDS.ratio * min(energy[each] for each in seeds)
    ends: list[Array] = [end.q for end in dict.fromkeys(each.goal for each in before)]
    for seed in seeds:
        beside = [
            each
            for each in before
            if each.start is seed.start
            and each.goal.self_motion is seed.goal.self_motion
            and each is not seed
        ]
        place = next(k for k, q in enumerate(ends) if q is seed.goal.q)
        near = [
            each
            for each in beside
            if any(each.goal.q is q for q in ends[max(place - 1, 0) : place + 2])
        ]
        assert all(energy[each] >= energy[seed] for each in near)


def test_the_next_seeds_follow_until_none_is_left() -> None:
    run = prepared(problem_of("panda", 4))
    state, rounds = run.state, 0
    while activate_seeds(state.prepared, state.candidates):
        rounds += 1
        assert rounds <= len(state.candidates)
    assert not any(
        each.deferred and each.status is CandidateStatus.UNVISITED for each in state.candidates
    )


def downwards(name: str, high: list[float], low: list[float], bus: Bus) -> Problem:
    """A problem between two poses, downwards with the rated payload."""
    robot = load_robot(name)
    arm = Arm(robot=robot, payload=Payload(mass=robot.rated_payload), collisions=False, bus=bus)
    start, goal = (Pose(tcp_pose(arm, np.array(q))) for q in (high, low))
    return Problem(arm=arm, start=start, goal=goal, deadline=AMPLE)


def test_pairs_whose_lower_bounds_are_all_the_same_have_seeds_too() -> None:
    """Pairs with equal lower bounds have seeds too.

    Gravity drives the motion, so the lower bound of most pairs is zero.
    """
    run = prepared(
        downwards(
            "panda", [0, 0.2, 0, -0.6, 0, 0.8, 0.785], [0, 1.2, 0, -1.6, 0, 2.8, 0.785], Bus()
        )
    )
    state = run.state
    before = [
        each
        for each in state.candidates
        if each.deferred and each.status is CandidateStatus.UNVISITED
    ]
    assert sum(each.lower_bound == 0 for each in before) > SEEDS.most_estimated
    assert activate_seeds(state.prepared, state.candidates)
    assert 0 < sum(not each.deferred for each in before) <= SEEDS.count


@pytest.mark.long
def test_motions_that_give_energy_back_have_seeds_too() -> None:
    bus = Bus(mode="recuperating", efficiency=1.0)
    asked = downwards("iiwa14", [0, 0.2, 0, -0.5, 0, 0.5, 0], [0, 1.4, 0, -1.2, 0, 0.9, 0], bus)
    run = prepared(asked)
    state = run.state
    before = [
        each
        for each in state.candidates
        if each.deferred and each.status is CandidateStatus.UNVISITED
    ]
    assert estimates(state.prepared, before).min() < 0
    assert activate_seeds(state.prepared, state.candidates)
    assert any(not each.deferred for each in before)
    assert run.search().energy.electrical.total < 0


def test_an_end_may_slide_onto_a_joint_limit() -> None:
    """The goal may slide until a joint is on its limit.

    The best goal has its sixth joint on the limit; samples beside it need some percent more.
    """
    run = seeded("iiwa14", 4)
    answer = optimize(run.problem)
    limits = run.problem.arm.robot.limits
    on_limit = np.minimum(answer.goal.q - limits.q_min, limits.q_max - answer.goal.q)
    assert 0 <= on_limit.min() < 1e-9
    assert answer.certificate.valid and max(answer.certificate.goal_error) < HELD
