"""Time-optimal scaling of a straight line: closed forms, and a bound under tight torque."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import BSpline

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.bspline import DEGREE
from joulepath.optimizer.motion.time_scalings import quintic
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.baselines import broken_limits
from joulepath.optimizer.solve.methods.time_optimal_scaling import (
    GRID,
    TIME_OPTIMAL,
    time_optimal_on_line,
)
from tests.optimizer.moves import (
    CEILING,
    GOAL,
    PAYLOAD,
    ROBOT,
    START,
    limits,
    problem,
    random_moves,
    torques,
)

# relative error of the duration: acceleration switches between two of the grid points
GRID_STEP = 0.02
# error of a scaling at its corners, rounded over a few Greville points [fraction of the line]
CORNER = 0.02
ALMOST_WEIGHTLESS: dict[str, Any] = {"gravity": [0, 0, -0.01]}
WEAK = [60.0, 75.0, 45.0, 12.0, 10.0, 9.0]


def law_of(start: Array, goal: Array, **given: Any) -> Any:
    compile_kernel(ROBOT)
    return time_optimal_on_line(PreparedProblem.of(problem(start, goal, **given)), start, goal)


@pytest.mark.parametrize(
    ("displacement", "duration"), [(2.0, 2.0 / math.pi + math.pi / 10), (0.5, 2 * math.sqrt(0.05))]
)
def test_one_joint_with_ample_torque_moves_in_a_trapezoid(
    displacement: float, duration: float
) -> None:
    """The last joint at 3.14 rad/s and 10 rad/s²: T = Δ/v + v/a, or 2 (Δ/a)^½ below full speed."""
    law = law_of(START, START + displacement * np.eye(6)[5], **ALMOST_WEIGHTLESS)
    assert law.times[-1] == pytest.approx(duration, rel=GRID_STEP)
    assert TIME_OPTIMAL.bound_share * law.times[-1] == pytest.approx(law.duration_bound)
    assert law.duration_bound <= duration


def test_the_law_runs_from_rest_to_rest() -> None:
    """Times increase, slowly at the ends, at the speed limit in between."""
    law = law_of(START, GOAL)
    steps = np.diff(law.times)
    assert len(law.times) == len(GRID) and law.times[0] == 0
    assert (steps > 0).all() and steps.argmax() in (0, len(steps) - 1)
    speed = np.abs(GOAL - START)[None] * (np.diff(GRID) / steps)[:, None]
    assert (speed <= ROBOT.limits.v_max * (1 + GRID_STEP)).all()


def fastest_quintic(start: Array, goal: Array, **given: Any) -> float:
    """Shortest duration [s] of the straight quintic without jerk limits, by bisection."""
    task = problem(start, goal, **given)
    free = problem(
        start,
        goal,
        **given | {"limits": given.get("limits", limits()).tightened(j_max=np.full(6, 200.0))},
    )
    low, high = 0.05, 40.0
    while high / low > 1.001:
        middle = math.sqrt(low * high)
        motion = quintic(start, goal, middle)
        tau = torques(task, motion.q, motion.v, motion.a)
        low, high = (low, middle) if not broken_limits(free, motion, tau) else (middle, high)
    return high


@pytest.mark.parametrize("weak", [False, True], ids=["as it comes", "weak"])
def test_no_quintic_is_faster(weak: bool) -> None:
    """With ample torque, the quintic takes more time, but less than threefold."""
    given: dict[str, Any] = {
        "payload": PAYLOAD,
        "limits": limits(tau_max=WEAK) if weak else limits(),
    }
    compared = 0
    for start, goal in random_moves(21, 24):
        law = law_of(start, goal, **given)
        if law is None:
            assert fastest_quintic(start, goal, **given) > 39  # none at any duration
            continue
        theirs = fastest_quintic(start, goal, **given)
        assert law.duration_bound <= theirs
        compared += 1
        assert weak or law.duration_bound > theirs / 3
    assert compared >= 5


def test_torque_counts_with_payload_and_mounting() -> None:
    """Less torque or a load make the arm slower; the direction of gravity matters."""
    weak = limits(tau_max=[150.0, 60.0, 150.0, 28.0, 28.0, 28.0])
    lift = START + np.array([0.0, 1.0, -0.3, 0.0, 0.0, 0.0])
    strong = law_of(START, lift).duration_bound
    alone = law_of(START, lift, limits=weak).duration_bound
    loaded = law_of(START, lift, limits=weak, payload=PAYLOAD).duration_bound
    hanging = law_of(START, lift, limits=weak, payload=PAYLOAD, gravity=CEILING).duration_bound
    assert strong < alone < loaded
    assert abs(hanging / loaded - 1) > 0.01


def test_no_law_where_the_arm_cannot_be_held_on_the_way() -> None:
    """There is no law if the shoulder cannot hold the arm somewhere on the way.

    The arm is folded at both ends and stretched in the middle.
    """
    start, goal = np.array([0.0, 0.0, 2.7, 0, 0, 0]), np.array([0.0, 0.0, -2.7, 0, 0, 0])
    ends = np.abs(torques(problem(), np.array([start, goal]), np.zeros((2, 6)), np.zeros((2, 6))))
    middle = np.abs(
        torques(problem(), (start + goal)[None] / 2, np.zeros((1, 6)), np.zeros((1, 6)))
    )[0]
    friction = problem().arm.friction_law.torque(ROBOT.limits.v_max)
    enough = (ends.max(axis=0)[1] + middle[1]) / 2
    tau_max = ROBOT.limits.tau_max.copy()
    tau_max[1] = enough - friction[1]
    assert middle[1] > enough > ends.max(axis=0)[1]
    assert law_of(start, goal, limits=limits(tau_max=tau_max)) is None
    assert law_of(start, goal) is not None


def test_no_travel_takes_no_time() -> None:
    assert law_of(START, START).duration_bound < 1e-6


@pytest.mark.parametrize(
    "space", [bspline.uniform(13), bspline.graded(np.array([0.1, 0.4, 0.6, 0.9]), 3)]
)
def test_control_values_follow_the_law(space: bspline.Basis) -> None:
    """The spline rests at both ends, is monotonic, and stays close to the scaling."""
    law = law_of(START, GOAL)
    values = law.fractions(space.knots)
    assert values[:3].tolist() == [0, 0, 0] and values[-3:].tolist() == [1, 1, 1]
    assert (np.diff(values) >= 0).all()
    t = np.linspace(0.0, 1.0, 101)
    expected = np.interp(t * law.times[-1], law.times, GRID)
    assert np.abs(BSpline(space.knots, values, DEGREE)(t) - expected).max() < 2 * CORNER
