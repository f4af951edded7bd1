"""Ruckig's motion, evaluated from its phases, is the one that Ruckig evaluates instant by
instant."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.models.registry import load_robot
from joulepath.optimizer.motion import ruckig_motion

# rad, rad/s, rad/s²: rounding of polynomials whose jerk is up to some 1e4 rad/s³
ROUNDING = 1e-10


@pytest.mark.parametrize("robot", ["ur5e", "panda", "kr10_r1100"])
def test_its_states_are_those_of_ruckig(robot: str) -> None:
    limits, rng = load_robot(robot).limits, np.random.default_rng(0)
    for k in range(30):
        start, goal = rng.uniform(-2.0, 2.0, (2, len(limits.q_min)))
        if k % 3 == 1:
            goal[2] = start[2]
        if k % 3 == 2:
            # some joints stand still, others hardly move
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
    """There 0.05 rad are twice a³ / j²: of half of these moves Ruckig says that it has none."""
    limits = load_robot("ur5e").limits
    for first in np.round(np.arange(-3, 3, 0.25), 2):
        q_start = np.array([first, 0.0, 0.0, 0.0, 0.0, 0.0])
        q_goal = np.array([first + 0.05, 0.0, 0.0, 0.0, 0.0, 0.0])
        found = ruckig_motion.time_optimal(limits, q_start, q_goal)
        # jerk alone: 4 (d / 2j)^(1/3)
        assert found.duration == pytest.approx(4 * np.cbrt(0.05 / 400), rel=1e-6)
