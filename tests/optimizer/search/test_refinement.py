"""Baselines that need less energy than what the optimiser finds become the answer."""

from __future__ import annotations

import numpy as np

from joulepath.models.registry import load_robot
from joulepath.optimizer.optimize import optimize
from tests.optimizer.moves import problem

# relative: a spline of Ruckig's motion is slower than the motion where jumps of its jerk are close
MERGED = 2e-5
# jumps of jerk of this motion of Ruckig's are so close that its jerk as a spline is 6e-6 beyond the
# limit
CLOSE_JUMPS = np.array(
    [
        [
            -0.72865225814,
            0.18652150697,
            0.42934765888,
            1.10586557770,
            -1.58408477987,
            -1.51099084960,
            -0.46547461087,
        ],
        [
            -0.02886765135,
            -0.51326309981,
            0.73086005908,
            1.13263774297,
            -0.78191909962,
            -0.58701496522,
            0.28848547281,
        ],
    ]
)


def test_a_better_baseline_is_taken_even_if_rounding_breaks_a_limit() -> None:
    found = optimize(problem(*CLOSE_JUMPS, robot=load_robot("gen3")))
    assert found.certificate.valid
    assert min(each.saving for each in found.baselines if each.within_limits) > -MERGED
