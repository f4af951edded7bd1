"""Slow moves need no more than other searches find, and tiny moves no more than standing still."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest

import joulepath
from benchmarks.slow_moves import MOST_EXCESS, compare, slow_problem
from joulepath import Bus, Problem, Solution, load_robot, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.motion.seven_segment import shortest_duration
from tests.compilers import with_compiler
from tests.optimizer.moves import GOAL, ROBOT, START, fixed, limits, problem
from tests.selection import long_but

# A move with joint 6 limited to so many rad/s, and the least known energies [J] of it. All least
# energies of this file come from spaces with four times the answer's control points
# (`benchmarks.slow_moves.more_points`).
SLOW_START = np.array([0.5, -0.3, 0.4, -1.2, -1.1, 0.0])
SLOW_GOAL = np.array([-0.5, -0.3, -0.4, -1.2, -1.1, 2.0])
LEAST_KNOWN = {0.3: 331.8, 0.1: 823.9, 0.05: 1562.8, 0.02: 3783.0}
# share of the shortest duration left for ramps slower than the limits of jerk allow
RAMPS = 5e-3


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:
    """Compiles the kernel: many motions of the default robot are slow without it."""
    with with_compiler():
        compile_kernel(load_robot("ur5e"))


def slow(speed: float, **given: Any) -> Problem:
    """The move with joint 6 limited to a speed [rad/s]."""
    v_max = ROBOT.limits.v_max.copy()
    v_max[5] = speed
    return problem(SLOW_START, SLOW_GOAL, limits=limits(v_max=v_max), **given)


def energy(solution: Solution) -> float:
    return solution.energy.electrical.total


def shortest(task: Problem) -> float:
    assert isinstance(task.start, np.ndarray) and isinstance(task.goal, np.ndarray)
    return float(shortest_duration(task.goal - task.start, task.arm.active_limits))


@pytest.mark.parametrize("speed", long_but([0.3], LEAST_KNOWN))
def test_a_slow_joint_ramps_as_fast_as_it_can(speed: float) -> None:
    """Evenly spaced knots would need 2 to 21 % more energy, because their ramps take seconds."""
    found = optimize(slow(speed))
    assert energy(found) < LEAST_KNOWN[speed] * (1 + MOST_EXCESS)
    assert found.status == "optimal" and found.certificate.valid


@pytest.mark.long
def test_the_excess_of_slow_moves_is_small() -> None:
    assert compare(seed=1, count=30, json=None) == 0


@pytest.mark.parametrize(
    ("speed", "ratio"),
    long_but([(0.3, 1.1)], [(0.3, 1.1), *product([0.05], [1.0005, 1.003, 1.02])]),
)
def test_a_duration_next_to_the_shortest_is_kept(speed: float, ratio: float) -> None:
    """At 40 s, a margin of half a thousandth is shorter than a ramp."""
    task = slow(speed)
    longest = ratio * shortest(task)
    found = optimize(replace(task, duration_max=longest))
    assert found.duration <= longest * (1 + 1e-9)
    assert energy(found) < LEAST_KNOWN[speed] * (1 + MOST_EXCESS)


@pytest.mark.parametrize(
    ("goal", "duration", "least"),
    [
        (START, 20.0, 768.3),
        pytest.param(GOAL, 60.0, 2260.1, marks=pytest.mark.long),
        pytest.param(START + 1e-3, 20.0, 768.4, marks=pytest.mark.long),
    ],
)
def test_much_more_time_than_a_move_needs_is_used(
    goal: Array, duration: float, least: float
) -> None:
    """The arm visits a posture with cheaper holding, even if it has to come back from it."""
    assert energy(optimize(problem(START, goal, **fixed(duration)))) < least * (1 + MOST_EXCESS)


@pytest.mark.long
@pytest.mark.parametrize(
    "bus", [Bus("isolated"), Bus("storage", efficiency=0.9, capacity=50.0, power=500.0)]
)
def test_other_buses_ramp_as_fast(bus: Bus) -> None:
    """Isolated buses have a corner of power for every joint and solve finer motions one by one."""
    task = slow(0.1, bus=bus)
    found = optimize(task)
    assert found.duration < shortest(task) * (1 + RAMPS)


@pytest.mark.long
@pytest.mark.parametrize(("index", "speed"), [(2, 0.25), (4, 0.08), (5, 0.25)])
def test_a_slow_tcp_is_within_its_limit_in_short_spans(index: int, speed: float) -> None:
    """Evenly spaced path points once missed short knot spans.

    Then no motion was confirmed, or only one of half again the energy.
    """
    _, task = slow_problem(0, index)
    task = replace(task, arm=replace(task.arm, tcp_speed=speed))
    found = optimize(task)
    assert found.certificate.worst_ratio["tcp_speed"] <= 1 + 1e-6
    # A lower limit of speed allows no faster motions, so the search missed none of less time and
    # energy.
    lower = optimize(replace(task, arm=replace(task.arm, tcp_speed=0.9 * speed)))
    assert energy(found) < energy(lower) * (1 + MOST_EXCESS)


PLACES = {
    "ur5e": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0],
    "kr10_r1100": [0.0, -1.2, 1.3, 0.1, 0.4, 0.0],
    "panda": [0.0, -0.5, 0.2, -1.9, 0.1, 1.5, 0.3],
}
# relative: most that a displacement of 1e-7 rad may add to the energy_of_displacement at rest
MORE = 2e-3
# s: out of reach on a loaded machine
DEADLINE = 60.0


def energy_of_displacement(robot: str, displacement: float, duration: float | None) -> float:
    """Energy [J] of a motion of all joints."""
    q = np.array(PLACES[robot])
    problem = joulepath.Problem(
        arm=joulepath.Arm(robot=joulepath.load_robot(robot)),
        start=q,
        goal=q + displacement,
        duration_min=duration,
        duration_max=duration,
        deadline=DEADLINE,
    )
    return joulepath.optimize(problem, progress=False).energy.electrical.total


@pytest.mark.parametrize(
    ("robot", "duration"),
    long_but([("ur5e", None)], product(PLACES, (None, 1.0))),
)
def test_a_displacement_of_nothing_needs_what_standing_still_needs(
    robot: str, duration: float | None
) -> None:
    still = energy_of_displacement(robot, 0.0, duration)
    for displacement in (1e-16, 1e-14, 1e-12, 1e-10, 1e-9, 1e-8):
        assert energy_of_displacement(robot, displacement, duration) == pytest.approx(
            still, rel=MORE
        )


@pytest.mark.parametrize("robot", long_but(["panda"], PLACES))
@pytest.mark.parametrize("displacement", long_but([1e-6], [1e-7, 1e-6]))
def test_a_certified_motion_is_answered_where_better_ones_are_refused(
    robot: str, displacement: float
) -> None:
    """The certificate refuses the best motion of the Panda and of the KR 10.

    It confirms their fastest motion, slowed down.
    """
    still = energy_of_displacement(robot, 0.0, 1.0)
    assert energy_of_displacement(robot, displacement, 1.0) == pytest.approx(still, rel=MORE)
