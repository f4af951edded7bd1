"""Baselines along a tool path: by kinematics of their own, within every limit, in the same time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import Spline, optimize
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for
from joulepath.optimizer.motion import ramped
from joulepath.optimizer.motion.bspline import DEGREE, clamped, fit
from joulepath.optimizer.motion.quintic import fraction
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.baseline_comparison import PATH_BASELINES
from joulepath.optimizer.search.baselines import standing
from tests.optimizer.moves import ROBOT
from tests.optimizer.tool_paths import ARM, HOME, along, moved

SMOOTHED = 2e-3  # relative; corners of a law of time that splines round


def test_two_ways_along_a_line_keep_every_limit() -> None:
    """In a given time they are those of a tool that moves along the line by the same laws."""
    duration, tau = 1.7, np.linspace(0.0, 1.0, 200)
    task = along(moved([0.0, 0.3, 0.0]), duration_min=duration, duration_max=duration)
    found, prepared = optimize(task), PreparedProblem.of(task)
    laws = {"even_speed": ramped.fraction(tau, PATH_BASELINES.ramps[0]), "quintic": fraction(tau)}
    kinematics = inverse_kinematics_for(ROBOT)
    assert kinematics is not None and len(found.baselines) == len(laws)
    for each in found.baselines:
        q = [HOME]
        for s in laws[each.name][1:]:
            ways = kinematics.solve(moved([0.0, 0.3 * s, 0.0]).T, ARM.T_flange_tcp, ROBOT.limits)
            q.append(min((way.q for way in ways), key=lambda way: np.abs(way - q[-1]).max()))
        knots = clamped(np.linspace(0.0, 1.0, 60))
        motion = Spline(DEGREE, knots * duration, fit(np.array(q), tau, knots))
        energy = prepared.energy(motion).electrical.total
        assert each.within_limits and each.duration == pytest.approx(duration)
        assert each.electrical == pytest.approx(energy, rel=SMOOTHED)
        saving = 1 - found.energy.electrical.total / each.electrical
        assert each.saving == pytest.approx(saving) and saving > 0


def test_they_take_no_longer_than_allowed() -> None:
    """In a free time our motion waits for them; without time for them, there are none."""
    task = along(moved([0.0, 0.3, 0.0]))
    found = optimize(task)
    power = standing(ARM, found.goal.q, PreparedProblem.of(task).torques).power
    for each in found.baselines:
        wait = each.duration - found.trajectory.spline.duration
        ours = found.energy.electrical.total + power * wait
        assert wait > 0 and each.saving == pytest.approx(1 - ours / each.electrical)
    shortest = min(each.duration for each in found.baselines)
    assert not optimize(replace(task, duration_max=0.99 * shortest)).baselines
