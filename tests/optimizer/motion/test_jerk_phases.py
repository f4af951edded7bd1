"""Ruckig's motion from its phases of jerk: as a spline, and instant by instant as Ruckig evaluates
it.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from joulepath.optimizer.motion import ruckig_motion
from joulepath.optimizer.motion.ruckig_motion import time_optimal_positions, time_optimal_spline
from joulepath.optimizer.motion.spline import least_time_scale, sample
from joulepath.optimizer.problem.robots import load_robot
from tests.selection import long_but

NAMES = ("ur5e", "kr10_r1100", "panda")
MOVES = 40
# relative: merged jumps of jerk change the jerk of short phases
MOSTLY = {False: 1e-4, True: 1e-3}
ALWAYS = 0.02
# rad: a jump shifted by a ten thousandth of the duration, at the greatest speed
AWAY = 1e-3
HARDLY = 0.5  # the same as ALWAYS, of moves of which some joints move by a billionth of others
NEARLY = 1e-5  # relative, of limits that are nearly equal


@pytest.mark.parametrize(
    ("name", "nearly_equal"),
    long_but([("ur5e", False), ("panda", True)], product(NAMES, (False, True))),
)
def test_it_is_ruckigs_motion(name: str, nearly_equal: bool) -> None:
    """Under nearly equal limits, jumps of all joints are too close to be apart, and too far to be
    one.
    """
    limits, rng = load_robot(name).limits, np.random.default_rng(5)
    lower, upper = np.maximum(limits.q_min, -np.pi), np.minimum(limits.q_max, np.pi)
    scales = []
    for _ in range(MOVES):
        start, goal = rng.uniform(lower, upper, (2, len(lower)))
        own = limits
        if nearly_equal:
            near = 1 + NEARLY * rng.normal(size=(3, len(lower)))
            rates = limits.rates.min(axis=1, keepdims=True) * near
            own = replace(limits, v_max=rates[0], a_max=rates[1], j_max=rates[2])
            goal = start + np.where(
                rng.random(len(lower)) < 0.8, 0.7 * near[0], rng.uniform(-0.7, 0.7, len(lower))
            )
        spline = time_optimal_spline(own, start, goal)
        scales.append(least_time_scale(spline, own.rates))
        at = np.linspace(0, 1, 60)
        q, v, a = sample(spline, at * spline.duration)
        assert np.abs(q - time_optimal_positions(own, start, goal, at)).max() < AWAY
        assert np.abs(v[[0, -1]]).max() < 1e-9 and np.abs(a[[0, -1]]).max() < 1e-7
        assert max(np.abs(q[0] - start).max(), np.abs(q[-1] - goal).max()) < 1e-12
    assert np.percentile(scales, 90) < 1 + MOSTLY[nearly_equal]
    assert max(scales) < 1 + ALWAYS


@pytest.mark.parametrize("name", long_but(["kr10_r1100"], NAMES))
def test_some_joints_hardly_move(name: str) -> None:
    """Their phases of jerk are too short to be separate; every joint still reaches its goal."""
    limits, rng, scales = load_robot(name).limits, np.random.default_rng(1), []
    for _ in range(MOVES):
        goal = rng.uniform(-2, 2, len(limits.q_min)) * 10.0 ** rng.uniform(-9, 0, len(limits.q_min))
        spline = time_optimal_spline(limits, np.zeros_like(goal), goal)
        scales.append(least_time_scale(spline, limits.rates))
        at = np.linspace(0, 1, 60)
        away = sample(spline, at * spline.duration)[0] - time_optimal_positions(
            limits, np.zeros_like(goal), goal, at
        )
        assert np.abs(away).max() < 10 * AWAY
    assert np.percentile(scales, 80) < 1 + ALWAYS and max(scales) < 1 + HARDLY


def test_joints_that_stay() -> None:
    limits = load_robot("ur5e").limits
    start = np.zeros(6)
    goal = np.array([0.0, 0.5, 0.0, 0.0, -1e-7, 0.0])
    spline = time_optimal_spline(limits, start, goal)
    q = sample(spline, np.linspace(0, spline.duration, 50))[0]
    assert np.abs(q[:, [0, 2, 3, 5]]).max() < 1e-12
    assert least_time_scale(spline, limits.rates) < 1 + ALWAYS


# rad, rad/s, rad/s²: rounding of polynomials with a jerk of up to 1e4 rad/s³
ROUNDING = 1e-10


@pytest.mark.parametrize("robot", ["ur5e", "panda", "kr10_r1100"])
def test_its_states_are_those_of_ruckig(robot: str) -> None:
    limits, rng = load_robot(robot).limits, np.random.default_rng(0)
    for k in range(30):
        start, goal = rng.uniform(-2.0, 2.0, (2, len(limits.q_min)))
        if k % 3 == 1:
            goal[2] = start[2]
        if k % 3 == 2:
            # some joints are at rest, others hardly move
            goal = start + (rng.random(len(start)) < 0.5) * 10.0 ** rng.uniform(-9, -1, len(start))
        found = ruckig_motion._ruckig(limits, start, goal)
        if found.duration == 0:
            continue
        t = np.concatenate([[0.0], rng.uniform(0.0, found.duration, 20), [found.duration]])
        expected = np.array([found.at_time(instant) for instant in t.tolist()])
        assert np.abs(np.stack(ruckig_motion._states(found, t), axis=1) - expected).max() < ROUNDING
        whole = ruckig_motion.time_optimal_positions(limits, start, goal, np.array([0.0, 1.0]))
        assert np.abs(whole - [start, goal]).max() < ROUNDING


def test_a_joint_that_just_reaches_its_greatest_acceleration() -> None:
    """At 0.05 rad = 2 a³ / j², Ruckig finds no solution for half of these moves."""
    limits = load_robot("ur5e").limits
    for first in np.round(np.arange(-3, 3, 0.25), 2):
        q_start = np.array([first, 0.0, 0.0, 0.0, 0.0, 0.0])
        q_goal = np.array([first + 0.05, 0.0, 0.0, 0.0, 0.0, 0.0])
        found = ruckig_motion.time_optimal(limits, q_start, q_goal)
        # jerk alone: 4 (d / 2j)^(1/3)
        assert found.duration == pytest.approx(4 * np.cbrt(0.05 / 400), rel=1e-6)
