"""The baselines' laws of motion against textbook figures, and the reports about baselines."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import ruckig

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.motion.ruckig_motion import time_optimal
from joulepath.optimizer.motion.time_scalings import (
    controller_default,
    trapezoid,
)
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.search.baselines import (
    guesses,
    nearest,
)
from tests.optimizer.moves import GOAL, ROBOT, START, problem_with

EXACT = 1e-12  # relative; closed forms in double precision
# rad; Ruckig solves its phases from polynomial roots and accepts a position within 1e-8 of the
# target
RUCKIG_POSITION = 1e-7
RATE = 1e-9  # relative; Ruckig's states are cubic polynomials evaluated in double precision

NAMES = ["trapezoid", "quintic", "ruckig", "ruckig_slowed", "straight", "controller_default"]
DURATION = 1.3
PANEL_NODES = 6


def problem(start: Array = START, goal: Array = GOAL, **given: Any) -> Problem:
    return problem_with(**{"start": start, "goal": goal} | given)


def limits(**given: float | list[float] | Array) -> Limits:
    """The robot's limits with replacements: one number for all joints, or one per joint."""
    return replace(
        ROBOT.limits,
        **{name: np.broadcast_to(value, 6).astype(float) for name, value in given.items()},
    )


def one_joint(displacement: float) -> Array:
    """A goal with a displacement of the elbow alone."""
    goal = START.copy()
    goal[2] -= displacement
    return goal


@pytest.mark.parametrize("name", NAMES)
def test_every_motion_is_what_it_says(name: str) -> None:
    """Motions have the given ends, rest and weights, and consistent derivatives.

    In every panel, the integrals of a and v are the changes of v and q.
    """
    motion = guesses(problem(), START, GOAL, DURATION)[name]  # type: ignore[index]
    assert motion.q[0] == pytest.approx(START, abs=EXACT)
    assert motion.q[-1] == pytest.approx(GOAL, abs=RUCKIG_POSITION)
    assert np.abs(motion.v[[0, -1]]).max() < RATE
    assert motion.weights.sum() == pytest.approx(motion.duration, rel=EXACT)
    shape = (-1, PANEL_NODES, 6)
    weights = motion.weights.reshape(-1, PANEL_NODES, 1)
    q, v, a = motion.q.reshape(shape), motion.v.reshape(shape), motion.a.reshape(shape)
    assert np.abs((weights * v).sum(axis=1) - (q[:, -1] - q[:, 0])).max() < RUCKIG_POSITION
    assert np.abs((weights * a).sum(axis=1) - (v[:, -1] - v[:, 0])).max() < RUCKIG_POSITION
    for samples, peak in ((motion.v, motion.peak_v), (motion.a, motion.peak_a)):
        assert (np.abs(samples).max(axis=0) <= peak * (1 + RATE)).all()
        # the samples lie at most a seventieth of the duration apart: a parabola's top is missed by
        # less than 1 %
        assert np.abs(samples).max(axis=0) == pytest.approx(peak, rel=0.01)


@pytest.mark.parametrize("name", NAMES)
def test_durations(name: str) -> None:
    own = {
        "ruckig": time_optimal(problem().arm.active_limits, START, GOAL).duration,
        "controller_default": controller_default(
            ROBOT.limits, ROBOT.default_motion, START, GOAL
        ).duration,
    }
    motion = guesses(problem(), START, GOAL, DURATION)[name]  # type: ignore[index]
    expected = own.get(name, DURATION)
    assert motion.duration == pytest.approx(expected, rel=EXACT)


def test_trapezoid_in_thirds() -> None:
    """Without an active limit: 1.5 Δ/T and 4.5 Δ/T², with unbounded jerk at every moving joint."""
    goal = GOAL.copy()
    goal[4] = START[4]
    motion, displacement = trapezoid(ROBOT.limits, START, goal, DURATION), np.abs(goal - START)
    assert motion.peak_v == pytest.approx(1.5 * displacement / DURATION, rel=EXACT)
    assert motion.peak_a == pytest.approx(4.5 * displacement / DURATION**2, rel=EXACT)
    assert motion.peak_jerk.tolist() == [math.inf] * 4 + [0.0, math.inf]


def test_trapezoid_keeps_to_limits_where_it_can() -> None:
    """The blend adapts to one limit and meets it exactly.

    If the limits on speed and acceleration contradict each other, the thirds stay.
    """
    goal = one_joint(1.0)
    slow = trapezoid(limits(v_max=1.2), START, goal, 1.0)
    assert slow.peak_v.max() == pytest.approx(1.2, rel=EXACT)
    lazy = trapezoid(limits(a_max=4.2), START, goal, 1.0)
    assert lazy.peak_a.max() == pytest.approx(
        4.2, rel=1e-9
    )  # by a square root near its branch point at 4
    for impossible in (limits(v_max=1.2, a_max=4.2), limits(v_max=0.9), limits(a_max=3.9)):
        motion = trapezoid(impossible, START, goal, 1.0)
        assert motion.peak_v.max() == pytest.approx(1.5, rel=EXACT)


def test_ruckig_keeps_its_limits_and_its_word() -> None:
    """Ruckig's motion keeps its limits and its duration, with the leading joint at a limit."""
    rng = np.random.default_rng(5)
    for _ in range(50):
        own = limits(
            v_max=rng.uniform(0.3, 3.0, 6),
            a_max=rng.uniform(1.0, 10.0, 6),
            j_max=rng.uniform(10, 200, 6),
        )
        start, goal = rng.uniform(-3.0, 3.0, (2, 6))
        motion = time_optimal(problem(start, goal, limits=own).arm.active_limits, start, goal)
        ratios = np.array(
            [motion.peak_v / own.v_max, motion.peak_a / own.a_max, motion.peak_jerk / own.j_max]
        )
        assert ratios.max() == pytest.approx(1.0, rel=RATE)
        given = ruckig.InputParameter(6)
        given.current_position, given.target_position = start.tolist(), goal.tolist()
        given.max_velocity, given.max_acceleration = own.v_max.tolist(), own.a_max.tolist()
        given.max_jerk = own.j_max.tolist()
        theirs = ruckig.Trajectory(6)
        ruckig.Ruckig(6).calculate(given, theirs)
        assert motion.duration == theirs.duration


@pytest.mark.parametrize(
    ("displacement", "duration"),
    [
        (2.0, 2.0 / 1.0472 + 1.0472 / 1.3963),  # reaches its speed
        (0.4, 2 * math.sqrt(0.4 / 1.3963)),  # turns before
        (1.0472**2 / 1.3963, 2 * 1.0472 / 1.3963),  # just reaches it: both formulas agree
    ],
)
def test_controller_default_duration(displacement: float, duration: float) -> None:
    """A joint with the UR's default speed 1.0472 rad/s and acceleration 1.3963 rad/s²."""
    motion = controller_default(ROBOT.limits, ROBOT.default_motion, START, one_joint(displacement))
    assert motion.duration == pytest.approx(duration, rel=EXACT)
    assert motion.peak_a.max() == pytest.approx(1.3963, rel=EXACT)
    assert motion.peak_v.max() <= 1.0472 * (1 + EXACT)


def test_controller_default_is_led_by_one_axis() -> None:
    """The joint with the longest displacement sets the pace, and tighter limits count.

    The other joints keep in step on a straight line.
    """
    displacement = np.abs(GOAL - START)
    motion = controller_default(ROBOT.limits, ROBOT.default_motion, START, GOAL)
    assert motion.duration == pytest.approx(
        displacement.max() / 1.0472 + 1.0472 / 1.3963, rel=EXACT
    )
    assert motion.peak_v == pytest.approx(1.0472 * displacement / displacement.max(), rel=EXACT)
    tight = controller_default(limits(v_max=0.5, a_max=1.0), ROBOT.default_motion, START, GOAL)
    assert tight.duration == pytest.approx(displacement.max() / 0.5 + 0.5 / 1.0, rel=EXACT)


def test_nearest_goal() -> None:
    """The nearest goal has the least time at the speed limits, then the least displacement."""
    near, turned = GOAL.copy(), GOAL.copy()
    turned[5] += 2 * math.pi
    assert nearest(problem(), START, np.array([turned, near])) == pytest.approx(near)
    detour = near.copy()
    detour[4] += 0.1  # not the joint that needs longest: the same time, more displacement
    assert nearest(problem(), START, np.array([detour, near])) == pytest.approx(near)
    other = near.copy()
    other[5] = START[5]
    other[3] += 2.0  # less time with a slow last joint, though more displacement
    slow_wrist = problem(limits=limits(v_max=[3, 3, 3, 3, 3, 0.1]))
    assert nearest(slow_wrist, START, np.array([near, other])) == pytest.approx(other)
