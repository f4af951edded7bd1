"""Known motions change the time of a search, and never its answer."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from joulepath import (
    Arm,
    Box,
    Cycle,
    CycleSolution,
    Obstacle,
    Payload,
    Problem,
    Scene,
    Spline,
    Stop,
    plan_cycle,
)
from joulepath.optimizer.cycle.known_motions import KnownMotion, KnownMotions, knowing
from tests.optimizer.cycle.cycles import HOME, pick_and_place
from tests.optimizer.cycle.test_optimize_cycle import assert_true
from tests.optimizer.moves import ROBOT

ASKED = pick_and_place(1, 2, windings=False)
PROBLEM = Problem(arm=Arm(robot=ROBOT), start=HOME, goal=HOME + 0.1, windings=False)


@cache
def searched() -> tuple[CycleSolution, KnownMotions]:
    motions = KnownMotions()
    with knowing(motions):
        return plan_cycle(ASKED), motions


def again(asked: Cycle, motions: KnownMotions) -> CycleSolution:
    with knowing(motions):
        return plan_cycle(asked)


def solves(found: CycleSolution) -> int:
    return sum(move.solution.solver.nlp_solves for move in found.moves)


def assert_same(found: CycleSolution, other: CycleSolution) -> None:
    assert (found.status, found.duration, found.lower_bound) == (
        other.status,
        other.duration,
        other.lower_bound,
    )
    for own, its in zip(found.moves, other.moves, strict=True):
        assert own.solution.status == its.solution.status
        assert own.solution.solver.stationarity == its.solution.solver.stationarity
        for name in ("q", "v", "tau_motor", "power"):
            np.testing.assert_array_equal(
                getattr(own.solution.trajectory, name), getattr(its.solution.trajectory, name)
            )
    assert [each.electrical for each in found.baselines] == [
        each.electrical for each in other.baselines
    ]


def test_the_same_cycle_solves_nothing_again_and_has_the_same_answer() -> None:
    found, motions = searched()
    known = KnownMotions(motions.used)
    other = again(ASKED, known)
    assert solves(found) > 0
    assert solves(other) == 0
    assert known.used.keys() == motions.used.keys()
    assert_same(other, found)
    assert_true(ASKED, other)


def test_of_an_edited_cycle_only_the_moves_that_changed_are_solved() -> None:
    last = ASKED.stops[-1]
    edited = replace(ASKED, stops=[*ASKED.stops[:-1], replace(last, payload=Payload(mass=1.0))])
    known, fresh = KnownMotions(searched()[1].used), KnownMotions()
    found = again(edited, known)
    assert_same(found, again(edited, fresh))
    of_before = known.used.keys() & searched()[1].used.keys()
    assert known.used.keys() == fresh.used.keys()
    assert of_before
    # the move home carries something else now
    assert fresh.used.keys() - of_before
    assert (
        found.moves[0].solution.solver.nlp_solves == 0 < found.moves[-1].solution.solver.nlp_solves
    )


@pytest.mark.long
def test_a_motion_that_is_not_certified_is_solved_for() -> None:
    _, motions = searched()
    wrong = {key: replace(each, spline=_twice_as_fast(each)) for key, each in motions.used.items()}
    assert_true(ASKED, again(ASKED, KnownMotions(wrong)))


def _twice_as_fast(motion: KnownMotion) -> Spline:
    return replace(motion.spline, knots=motion.spline.knots / 2)


@pytest.mark.parametrize(
    "other",
    [
        replace(PROBLEM, goal=HOME + 0.2),
        replace(PROBLEM, duration_max=3.0),
        replace(PROBLEM, method="time_scaling"),
        replace(PROBLEM, arm=replace(PROBLEM.arm, payload=Payload(mass=1.0))),
        replace(PROBLEM, arm=replace(PROBLEM.arm, tcp_speed=0.5)),
        replace(
            PROBLEM,
            arm=replace(PROBLEM.arm, limits=ROBOT.limits.tightened(v_max=ROBOT.limits.v_max * 0.9)),
        ),
        replace(PROBLEM, arm=replace(PROBLEM.arm, scene=Scene([Obstacle("box", Box(np.ones(3)))]))),
        replace(PROBLEM, arm=replace(PROBLEM.arm, robot=replace(ROBOT, torque_side="link"))),
    ],
)
def test_another_question_has_another_key(other: Problem) -> None:
    keys = KnownMotions().key
    assert keys("tried", PROBLEM) != keys("tried", other)
    assert keys("tried", PROBLEM) == keys(
        "tried", replace(PROBLEM, arm=replace(PROBLEM.arm), deadline=1.0)
    )
    assert (
        len({keys("tried", PROBLEM), keys("finished", PROBLEM), keys("tried", PROBLEM, 1.0)}) == 3
    )


def test_numbers_out_of_arrays_are_numbers() -> None:
    arm = Arm(robot=ROBOT, payload=Payload(mass=1.0), tcp_speed=0.5)
    from_arrays = replace(
        arm, payload=Payload(mass=np.arange(3)[1]), tcp_speed=np.full(1, 0.5, dtype=np.float32)[0]
    )
    asked = Cycle(
        arm=from_arrays, start=HOME, stops=[Stop(name="near", target=HOME + 0.1)], windings=False
    )
    assert_true(asked, plan_cycle(asked))
    keys = KnownMotions().key
    assert keys("tried", replace(PROBLEM, arm=from_arrays)) == keys(
        "tried", replace(PROBLEM, arm=arm)
    )
