"""How accurate energies are: against a quadrature of 20,000 panels. docs/reference/optimize.md has
the figures.
"""

from __future__ import annotations

import numpy as np
import pytest

from joulepath import Arm, Payload, Problem, Spline, load_robot, optimize
from joulepath.optimizer.dynamics.losses import breakdown
from joulepath.optimizer.motion.quadrature import quadrature
from joulepath.optimizer.motion.spline import sample
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.optimizer.moves import AMPLE
from tests.selection import long_but

# relative; the documented figures, rounded up
MEDIAN = 1e-6
MOST = 7e-5
WORST = 2e-4
PANELS = 20_000


def error(prepared: PreparedProblem, spline: Spline) -> float:
    """Relative difference of a motion's electrical energy from a fine quadrature."""
    t, weights = quadrature(spline.knots, 5, spline.duration / PANELS)
    q, v, a = sample(spline, t)
    gain = prepared.potential(spline.control_points[-1]) - prepared.potential(
        spline.control_points[0]
    )
    fine = breakdown(weights, v, a, prepared.torques(q, v, a), gain, prepared.arm)
    return abs(fine.electrical.total / prepared.energy(spline).electrical.total - 1)


ROBOTS = {"ur5e": 0, "panda": 1, "ur20": 2}
"""Robots, with the seed of their moves."""


def errors_of(robot: str, count: int) -> list[float]:
    """The errors of answers between random configurations, with payloads of 0 to 2 kg."""
    loaded, rng, errors = load_robot(robot), np.random.default_rng(ROBOTS[robot]), list[float]()
    middle = (np.maximum(loaded.limits.q_min, -3) + np.minimum(loaded.limits.q_max, 3)) / 2
    for k in range(count):
        arm = Arm(
            robot=loaded, payload=Payload(float(k % 3), np.array([0, 0, 0.05])), collisions=False
        )
        start, goal = middle + rng.uniform(-1, 1, (2, loaded.nq))
        task = Problem(arm=arm, start=start, goal=goal, deadline=AMPLE)
        errors.append(error(PreparedProblem.of(task), optimize(task).trajectory.spline))
    return errors


@pytest.mark.parametrize("robot", long_but(("ur5e",), ROBOTS))
def test_no_energy_is_further_off_than_documented(robot: str) -> None:
    assert max(errors_of(robot, 4)) < WORST


@pytest.mark.long
def test_energies_are_as_accurate_as_documented() -> None:
    errors = [each for robot in ROBOTS for each in errors_of(robot, 25)]
    assert np.median(errors) < MEDIAN and np.percentile(errors, 95) < MOST and max(errors) < WORST
