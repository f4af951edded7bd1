"""Motions of least work that move for a part of the time, and rest for the remainder."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from joulepath import Arm, Problem, optimize
from joulepath.optimizer.motion.spline import sampled
from tests.optimizer.moves import ROBOT
from tests.selection import long_but

START = [-0.8, -3.6, 2.6, 1.4, -0.7, 0.0]
GOAL = [-0.4, -5.1, -1.4, -5.7, 5.2, 2.7]
LONG = 40.0
"""Duration [s] of which the swing to the goal takes a tenth."""
GAP = 0.05
"""Largest relative gap to the lower bound. A solve over the whole time alone has a gap of 1."""
DEADLINE = 100.0
"""Deadline [s] that no search reaches, not even on a busy machine."""
ROUNDING = 1e-14
"""Rounding error of joint positions at rest [rad]."""


def problem(**given: Any) -> Problem:
    arm = Arm(robot=ROBOT, collisions=False)
    return Problem(
        arm=arm,
        start=START,
        goal=GOAL,
        objective="mechanical",
        windings=False,
        deadline=DEADLINE,
        **given,
    )


@pytest.mark.parametrize("least", long_but([LONG], [None, LONG, 30.0]))
def test_more_time_does_not_cost_more(least: float | None) -> None:
    found = optimize(problem(duration_min=least, duration_max=LONG))
    assert found.energy.mechanical.total < (1 + GAP) * found.lower_bound
    assert (least or 0.0) <= found.duration <= LONG
    if least is not None:
        q, t = sampled(found.trajectory.spline)
        assert np.ptp(q[t > least / 2], axis=0).max() < ROUNDING
