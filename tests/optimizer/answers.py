"""Promises of every answer of `optimize`, and the conditions of the requests."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath import Payload, Problem, Solution, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.losses import saving
from joulepath.optimizer.motion.seven_segment import shortest_duration
from tests.optimizer.moves import (
    CEILING,
    GOAL,
    PAYLOAD,
    ROBOT,
    START,
    limits,
    problem,
)

ROUNDING = 1e-9
# relative; twice the remaining error of a solver that stops at predicted gains of 5e-5 of the cost
CONVERGED = 1e-3
BALANCE = 1e-3  # of the total: the identity of energy that is promised
# relative; the two energies are sums over different panels, with corners of |x| inside (see
# QUADRATURE in test_baselines); a motion equal to its own baseline differs by 1e-5 from itself
NOT_BEATEN = 5e-5
SYMMETRY = (
    2e-3  # relative; two runs whose optima are mirror images, reached along ways that are not
)


def total(solution: Solution, task: Problem) -> float:
    """The minimised energy [J]."""
    return solution.energy.of(task.objective)


def shortest(start: Array = START, goal: Array = GOAL, **given: Any) -> float:
    return float(shortest_duration(goal - start, problem(start, goal, **given).arm.active_limits))


def assert_true(solution: Solution, task: Problem) -> None:
    """Asserts all promises of an answer, recomputed unless the certificate's own work is the
    promise.
    """
    assert solution.certificate.valid
    electrical, own = solution.energy.electrical, total(solution, task)
    assert electrical.parts_sum == pytest.approx(electrical.total, rel=BALANCE)
    assert solution.lower_bound <= own
    assert solution.lower_bound == min(each.lower_bound for each in solution.candidates)
    assert min(
        each.energy for each in solution.candidates if each.energy is not None
    ) == pytest.approx(own)
    least, most = task.duration_min or 0.0, task.duration_max or math.inf
    assert least <= solution.duration <= most
    for each in solution.baselines:
        theirs = getattr(each, task.objective)
        assert (each.saving is None) == (not each.within_limits)
        waited = task.dwell is not None or task.objective == "mechanical"
        if each.saving is not None and (waited or each.duration == solution.duration):
            assert each.saving == pytest.approx(saving(own, theirs), abs=ROUNDING)
        allowed = least * (1 - ROUNDING) <= each.duration <= most * (1 + ROUNDING)
        if each.within_limits and allowed and each.duration > 0 and task.method == "bspline":
            assert own <= theirs * (1 + NOT_BEATEN), each
    trajectory = solution.trajectory
    assert trajectory.t[-1] == pytest.approx(solution.duration, abs=ROUNDING)
    assert trajectory.q[0] == pytest.approx(solution.start.q, abs=1e-7)
    assert trajectory.q[-1] == pytest.approx(solution.goal.q, abs=1e-7)


def solved(task: Problem) -> Solution:
    solution = optimize(task)
    assert_true(solution, task)
    return solution


CONDITIONS: dict[str, dict[str, Any]] = {
    "as it comes": {},
    "loaded": {"payload": PAYLOAD},
    "loaded to the rating": {"payload": Payload(mass=5.0, com=np.array([0.0, 0.03, 0.08]))},
    "wall": {"gravity": [0, 9.81, 0], "payload": PAYLOAD},
    "ceiling": {"gravity": CEILING, "payload": PAYLOAD},
    "weightless": {"gravity": [0, 0, 0]},
    "plain friction": {"friction": "coulomb_viscous"},
    "slow": {"limits": limits(v_max=0.6, a_max=2.0, j_max=10.0)},
    "smooth": {"limits": limits(j_max=15.0)},
    "weak": {"limits": limits(tau_max=[60, 100, 60, 14, 14, 14]), "payload": Payload(mass=1.0)},
    "half recovered": {
        "robot": replace(ROBOT, electronics=replace(ROBOT.electronics, regeneration=0.5))
    },
    "idles cheaply": {
        "robot": replace(ROBOT, electronics=replace(ROBOT.electronics, idle_power=4.0))
    },
}
