"""Goals of free orientation with a joint turned the other way around, if this needs less energy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath import Arm, Bus, ConeOrientedPose, Payload, Pose, Problem, load_robot
from joulepath.optimizer.kinematics.end_configuration import FULL_TURN
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.near_goals import OTHER_TURNS, other_turns
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.search.seeds import estimates_between, expected
from tests.optimizer.search.runs import explored, prepared

# s: far more than any search takes, even on a busy machine
AMPLE = 300.0
# UR5e: the second joint has 3.0 rad to go one way around, and 3.2 rad the other
START = np.array([-0.56, 2.62, -0.15, -2.88, -1.61, 1.48])
GOAL = np.array([-0.53, 5.82, 0.81, -1.87, -1.16, 0.96])
# rad: far less than the difference of a joint that turns the other way
SAME = 2e-3
# relative: unrefined motions end in different local optima, due to corners in the joints' powers
LOCAL = 3e-2
# relative: an estimate of one duration and half the instants
ROUGH = 0.1


def task(**given: Any) -> Problem:
    """A hanging arm with a heavy part, lifted less on one of two ways around.

    The bus burns all energy from lowering the part.
    """
    payload = Payload(mass=4.3, com=np.array([0.0, 0.0, 0.05]))
    hanging, bus = np.array([0.0, 0.0, 9.81]), Bus(mode="isolated")
    arm = Arm(robot=load_robot("ur5e"), payload=payload, gravity=hanging, bus=bus, collisions=False)
    goal = ConeOrientedPose(tcp_pose(arm, GOAL)[:3, 3])
    return Problem(**({"arm": arm, "start": START, "goal": goal, "deadline": AMPLE} | given))


def test_the_other_way_around_is_found_where_it_needs_less() -> None:
    problem = task()
    best, known = explored(problem), explored(replace(problem, goal=GOAL))
    one_way = explored(replace(problem, windings=False))
    assert best.energy is not None and known.energy is not None and one_way.energy is not None
    assert best.energy <= known.energy * (1 + LOCAL)
    # friction alone would have it the other way
    assert abs(best.q_goal[1] - START[1]) > np.pi > abs(one_way.q_goal[1] - START[1])
    assert best.energy < one_way.energy


def turned(problem: Problem) -> tuple[Run, list[Candidate], list[Candidate], float]:
    run = prepared(problem)
    samples = [each for each in run.state.candidates if each.holdable]
    least = float(expected(run.state.prepared, samples).min())
    return run, samples, other_turns(run.state.prepared, samples, least), least


@pytest.mark.parametrize("start", [START, "pose"])
def test_one_joint_is_turned_within_the_limits(start: Any) -> None:
    problem = task()
    if isinstance(start, str):
        problem = replace(problem, start=Pose(tcp_pose(problem.arm, START)))
    run, samples, others, least = turned(problem)
    limits = problem.arm.active_limits
    known = {(each.start, each.goal): each for each in samples}
    assert 0 < len(others) <= OTHER_TURNS.most
    for each in others:
        sample = known[each.start, each.goal]
        way, least_way = each.q_goal - each.q_start, sample.q_goal - sample.q_start
        (joint,) = np.flatnonzero(np.abs(way - least_way) > SAME)
        assert abs(way[joint] - least_way[joint]) == pytest.approx(FULL_TURN)
        assert way[joint] * least_way[joint] <= 0
        assert abs(way[joint]) <= FULL_TURN
        for q in (each.q_start, each.q_goal):
            assert (q >= limits.q_min).all() and (q <= limits.q_max).all()
        assert (each.q_start == sample.q_start).all() or not sample.start.fixed
        assert each.lower_bound >= sample.lower_bound
        assert each.lower_bound <= (least + (OTHER_TURNS.energy_ratio - 1) * abs(least)) * (
            1 + ROUGH
        )
    assert not other_turns(run.state.prepared, samples, 0.0)


def test_without_full_turns_nothing_is_turned() -> None:
    assert not turned(task(windings=False))[2]


def test_a_rough_estimate_is_near_that_of_several_durations() -> None:
    run = prepared(task())
    some = [each for each in run.state.candidates if each.holdable][:40]
    q_start, q_goal = (
        np.array([getattr(each, name) for each in some]) for name in ("q_start", "q_goal")
    )
    shortest = np.asarray(shortest_duration(q_goal - q_start, run.problem.arm.active_limits))
    rough, exact = (
        estimates_between(run.state.prepared, q_start, q_goal, shortest, rough=rough)
        for rough in (True, False)
    )
    ratio = rough / exact
    assert np.median(np.abs(ratio - 1)) < ROUGH
