"""The fastest motion: refusals name an attainable duration; no known motion is faster."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath import Bus, DurationTooShort, Payload, Problem, optimize
from joulepath.app.convert.request import to_problem
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.optimizer.problem.problem import DURATIONS, MethodName
from joulepath.optimizer.solve.methods.fastest_motion import FastestSettings
from tests.optimizer.clocks import CountingClock
from tests.optimizer.moves import (
    CEILING,
    GOAL,
    PAYLOAD,
    ROBOT,
    START,
    fixed,
    limits,
    problem,
    tcp_pose,
)
from tests.selection import long_but

# a move with a minimum-time solve that, from one start, ends at four times the fastest motion
LOCAL = [-1.477, -1.808, 1.483, 1.913, 0.829, -1.357], [-0.341, -2.823, 1.001, 1.472, 0.493, -2.509]
# relative; a motion within this share of the fastest one counts as the fastest
PROVEN = FastestSettings().proven
# a time too short for any arm [s]
TOO_SHORT = 0.05


def local(**given: Any) -> Problem:
    return problem(*map(np.array, LOCAL), **given)


def refused(asked: Problem, duration: float = TOO_SHORT) -> DurationTooShort:
    with pytest.raises(DurationTooShort) as caught:
        optimize(replace(asked, **fixed(duration)))
    return caught.value


def named(error: DurationTooShort) -> float:
    """The duration [s] named by a refusal."""
    assert error.shortest is not None
    return error.shortest


def assert_answered(
    asked: Problem, error: DurationTooShort, shares: tuple[float, ...] = (1.0, 1.02)
) -> None:
    """The named duration is attainable: fixed, as the longest one, and a little longer."""
    assert error.shortest is not None
    for share in shares:
        answer = optimize(replace(asked, **fixed(share * error.shortest)))
        assert answer.certificate.valid and answer.duration == share * error.shortest
    answer = optimize(replace(asked, duration_min=None, duration_max=error.shortest))
    assert answer.certificate.valid and answer.duration <= error.shortest


@pytest.mark.long
def test_one_bad_local_optimum_is_not_the_shortest_duration() -> None:
    asked = local()
    error = refused(asked, 0.7301)
    assert error.proven and not error.cut_short
    assert error.bound <= named(error) <= 0.7311
    assert_answered(asked, error)
    # A motion at the proven bound is answered, too: Ruckig's takes no more time than the bound.
    exact = optimize(replace(asked, **fixed(error.bound * (1 + 1e-6))))
    assert exact.certificate.valid
    # The motion stays as found, and is not called optimal.
    assert exact.status == "feasible"


@pytest.mark.long
@pytest.mark.parametrize("index", long_but([5], range(16)))
def test_no_motion_in_hand_is_faster(index: int) -> None:
    """Moves of ±1.5 rad, every other one with 4 kg.

    Of 118 such moves, 16 were refused with durations of up to ten times the shortest.
    """
    rng = np.random.default_rng([11, index])
    start, goal = rng.uniform(-1.5, 1.5, (2, 6))
    payload = (
        Payload(4.0, rng.uniform([-0.05, -0.05, 0.0], [0.05, 0.05, 0.12]))
        if index % 2
        else Payload()
    )
    asked = problem(start, goal, payload=payload)
    free, error = optimize(asked), refused(asked)
    theirs = [each.duration for each in free.baselines if each.within_limits]
    others: list[MethodName] = ["lagrange", "uniform_scaling", "time_scaling"]
    theirs += [refused(replace(asked, method=method)).shortest or np.inf for method in others]
    assert named(error) <= min([free.duration, *theirs]) * (1 + PROVEN)


MOVES: dict[str, Problem] = {
    "time_scaling": problem(method="time_scaling", payload=PAYLOAD),
    "lagrange": problem(method="lagrange", payload=PAYLOAD),
    "uniform_scaling": problem(method="uniform_scaling", payload=PAYLOAD),
    "polynomial_ga": problem(method="polynomial_ga", payload=PAYLOAD),
    "one joint": problem(goal=START + np.array([0.0, 0.0, 0.7, 0.0, 0.0, 0.0])),
    "hardly any torque": problem(
        payload=Payload(5.0, np.array([0.05, -0.05, 0.12])),
        limits=limits(tau_max=[40, 105, 60, 14, 14, 14]),
    ),
    "on a wall": problem(
        gravity=np.array([9.81, 0.0, 0.0]), payload=Payload(4.0, np.array([0.0, 0.0, 0.1]))
    ),
    "on the ceiling": problem(gravity=CEILING, payload=PAYLOAD),
    "between poses": problem(
        tcp_pose(START), tcp_pose(GOAL), payload=Payload(4.5, np.array([0.05, 0.05, 0.12]))
    ),
    "storage on the bus": problem(bus=Bus(mode="storage")),
    "mechanical": problem(objective="mechanical", duration_max=3.0),
    "slow tool": problem(tcp_speed=0.25, elbow_speed=0.5),
    "through a pass": problem(passes=(0.5 * (START + GOAL) + 0.2,)),
}


@pytest.mark.parametrize("name", long_but(["lagrange", "uniform_scaling"], MOVES))
def test_what_is_named_is_answered(name: str) -> None:
    assert_answered(MOVES[name], refused(MOVES[name]))


def test_equal_ends_take_the_least_duration() -> None:
    error = refused(problem(goal=START), DURATIONS.least / 2)
    # The duration of a motion at rest is divided and multiplied again.
    assert named(error) == pytest.approx(DURATIONS.least, rel=1e-12)
    assert error.bound == DURATIONS.least and error.proven


@pytest.mark.long
def test_phases_of_milliseconds_in_minutes() -> None:
    """With joint 4 at 1 mrad/s, phases of jerk last 4 ms of 300 s, too short for a
    spline's knots.
    """
    v_max = ROBOT.limits.v_max.copy()
    v_max[3] = 1e-3
    asked = problem(limits=replace(ROBOT.limits, v_max=v_max))
    error = refused(asked, 5.0)
    assert error.proven and named(error) <= error.bound * (1 + FastestSettings().proven)
    assert_answered(asked, error, (1.0,))


@pytest.mark.long
def test_without_a_limit_on_jerk() -> None:
    """Without a limit on jerk, acceleration may jump, unlike any spline's.

    The motion takes at most 3 ms more than the proven bound.
    """
    robot = replace(ROBOT, limits=replace(ROBOT.limits, j_max=np.full(6, np.inf)))
    asked = problem(robot=robot, payload=Payload(4.5, np.array([0.05, 0.05, 0.12])))
    error = refused(asked)
    assert error.bound <= named(error) <= error.bound + 3e-3
    assert_answered(asked, error)


BODIES: dict[str, dict[str, Any]] = {
    "along a path": {
        "start": {"pose": {"position": [0.4, -0.15, 0.15], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
        "goal": {"pose": {"position": [0.4, 0.15, 0.15], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
        "path": {},
    },
    "to any turn of the tool": {
        "start": {"q": START.tolist()},
        "goal": {"pose": {"position": [0.4, 0.2, 0.35], "orientation": "free"}},
        "collisions": False,
    },
    "among obstacles": {
        "start": {"q": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]},
        "goal": {"q": [1.6, -1.2, 1.4, -1.77, -1.57, 0.0]},
        "payload": {"mass": 4.0, "com": [0.0, 0.0, 0.08]},
        "scene": {
            "obstacles": [
                {
                    "name": "post",
                    "shape": "box",
                    "size": [0.2, 0.2, 0.9],
                    "pose": {"position": [-0.45, -0.45, 0.45], "quaternion": [0.0, 0.0, 0.0, 1.0]},
                }
            ]
        },
    },
}


BODIES["a Panda with a heavy part between obstacles"] = {
    "robot": "panda",
    "start": {"q": [-0.9, 0.2, 0.0, -1.9, 0.0, 2.1, 0.8]},
    "goal": {"q": [0.9, 0.2, 0.0, -1.9, 0.0, 2.1, 0.8]},
    "payload": {"mass": 2.9, "com": [0.0, 0.0, 0.06]},
    "objective": "mechanical",
    "duration": TOO_SHORT,
    "scene": {
        "obstacles": [
            {
                "name": name,
                "shape": "box",
                "size": [0.2, 0.08, height],
                "pose": {"position": [0.5, y, height / 2], "quaternion": [0.0, 0.0, 0.0, 1.0]},
            }
            for name, y, height in (("low", -0.1, 0.7), ("high", 0.2, 0.85))
        ]
    },
}


@pytest.mark.long
@pytest.mark.parametrize("name", BODIES)
def test_requests_of_other_kinds(name: str) -> None:
    asked = to_problem(OptimizeRequest.model_validate(BODIES[name]), 300.0)
    assert_answered(asked, refused(asked))


@pytest.mark.parametrize("tick", long_but([0.02], [0.002, 0.005, 0.02, 0.1, 0.5]))
def test_a_search_that_is_cut_short_says_so(tick: float) -> None:
    """The clock moves at each reading, so the search ends between its first and its last start."""
    tight = replace(MOVES["hardly any torque"], **fixed(TOO_SHORT))
    with pytest.raises(DurationTooShort) as caught:
        optimize(replace(tight, deadline=2.0), clock=CountingClock(tick))
    error = caught.value
    assert not error.proven and ("deadline" in str(error)) == error.cut_short
    # At such a pace, no start ends in time.
    assert error.cut_short or tick < 0.02
    if error.shortest is None:
        assert error.cut_short and error.bound > TOO_SHORT
    else:
        answer = optimize(replace(tight, **fixed(error.shortest)))
        assert answer.certificate.valid


def test_the_words_of_a_refusal_are_enough() -> None:
    """The duration in words is rounded up, so a person who types it gets an answer."""
    asked = problem()
    error = refused(asked)
    told = float(next(each for each in str(error).split() if each[0].isdigit()))
    assert told >= named(error)
    assert optimize(replace(asked, **fixed(told))).certificate.valid
