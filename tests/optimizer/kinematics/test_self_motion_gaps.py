from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.tasks import flange
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.self_motion import SELF_MOTION, SelfMotion, spread
from joulepath.optimizer.kinematics.self_motion_members import up_to_limits, without_gaps
from joulepath.optimizer.problem.robots import load_robot

# one turn of the first joint while the second stays within 0.003 rad of the stretched shoulder
NEAR_SINGULAR = [0.57244, 0.00264, -2.87612, -1.45547, -0.40888, 2.9146, 0.92274]
COUNT = 24


class Corner:
    """Curve at rest except for a step of 3 rad within a thousandth of the parameter."""

    label, free, arcs = None, (0,), [(0.0, 1.0)]

    def at(self, parameter: Array) -> Array:
        return np.clip((parameter - 0.5) * 1e3, 0.0, 1.0)[:, None] * 3.0


def test_members_follow_a_redundant_arm_past_a_singularity() -> None:
    robot = load_robot("fr3")
    T = flange(robot, np.array(NEAR_SINGULAR))
    ends = required_inverse_kinematics(robot, "goal").solve(T, members=COUNT)
    nearest = min(float(np.abs(wrapped(each.q - NEAR_SINGULAR)).max()) for each in ends)
    assert nearest < SELF_MOTION.largest_gap


def test_evenly_spread_members_are_left_as_they_are() -> None:
    robot = load_robot("fr3")
    T = flange(robot, np.array([0.3, -0.8, 0.4, -1.9, 0.5, 1.7, 0.2]))
    solver: Any = required_inverse_kinematics(robot, "goal")._solver
    for motion in solver.self_motions(T, robot.limits):
        u = spread(motion, COUNT)
        q = motion.at(u)
        if np.abs(wrapped(np.diff(q, axis=0))).max() < SELF_MOTION.largest_gap:
            np.testing.assert_array_equal(without_gaps(motion, u, q), q)


def test_a_jump_ends_after_some_halvings_and_members_keep_their_order() -> None:
    motion: SelfMotion = Corner()  # type: ignore[assignment]
    u = np.linspace(0.0, 1.0, 9)
    filled = without_gaps(motion, u, motion.at(u))[:, 0]
    assert len(u) < len(filled) < 3 * len(u)
    assert filled == pytest.approx(np.sort(filled))


class Lines:
    """Curve with two arcs and one joint equal to the parameter."""

    label, free, arcs = None, (0,), [(0.0, 1.0), (2.0, 3.0)]

    def at(self, parameter: Array) -> Array:
        return np.array(parameter)[:, None]


@pytest.mark.parametrize(
    ("low", "high", "added"),
    [(0.3, 2.7, 2), (0.3, 2.6, 1), (0.3, 1.5, 1), (-1.0, 3.1, 0), (0.3, 0.35, 0)],
)
def test_members_reach_to_where_a_curve_leaves_the_limits(
    low: float, high: float, added: int
) -> None:
    """Members are added up to the limits of an arc.

    None is added across arcs, or to a curve without any member inside the limits.
    """
    motion: SelfMotion = Lines()  # type: ignore[assignment]
    robot = load_robot("ur5e")
    limits = replace(robot.limits, q_min=np.array([low]), q_max=np.array([high]))
    u = spread(motion, 9)
    parameters, q = up_to_limits(motion, u, motion.at(u), limits)
    assert len(parameters) == len(u) + added and np.isin(u, parameters).all()
    np.testing.assert_array_equal(q, motion.at(parameters))
    assert (np.diff(parameters) > 0).all()
    step = np.diff(u)[0] / (SELF_MOTION.limit_samples - 1)
    for limit in (low, high)[:added]:
        inside = parameters[(parameters >= low) & (parameters <= high)]
        assert np.abs(inside - limit).min() <= step
