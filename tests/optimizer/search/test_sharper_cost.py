"""Solves with a sharper cost, where the smoothed cost is far from a small net energy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.agreement import P95, request
from joulepath import Bus, Problem, optimize
from joulepath.app.convert.request import to_problem
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.optimizer.search.sharper_cost import (
    SHARPER_COST,
    SharperCostSettings,
    sharpen_cost,
)
from joulepath.optimizer.solve.methods.duration_intervals import duration_intervals
from tests.optimizer.moves import AMPLE, problem
from tests.optimizer.search.runs import prepared

# request of the benchmark in which a heavy payload descends: 280 J flow, 7 J are drawn on balance
DESCENT = 13
SHORTER = 0.97


def descent() -> Problem:
    """The request, its goal as the configuration that its answer reaches."""
    given = to_problem(OptimizeRequest.model_validate(request(0, DESCENT)[1]), AMPLE)
    run = prepared(given)
    nearest = min(run.state.candidates, key=lambda each: each.shortest)
    return replace(given, goal=nearest.q_goal)


@pytest.mark.long
def test_a_shorter_duration_needs_no_less_where_little_energy_is_left() -> None:
    given = descent()
    free = optimize(given)
    duration = SHORTER * free.duration
    fixed = optimize(replace(given, duration_min=duration, duration_max=duration))
    assert free.certificate.valid
    least, energy = fixed.energy.electrical.total, free.energy.electrical.total
    assert energy < least * (1 + P95)


@pytest.mark.parametrize(
    ("given", "error", "is_solved"),
    [
        ({}, SHARPER_COST.error, False),
        ({}, 0.0, True),
        ({"duration_min": 2.0, "duration_max": 2.0}, 0.0, True),
        ({"bus": Bus(mode="isolated")}, 0.0, False),
    ],
)
def test_only_an_imprecise_cost_is_sharpened(
    given: dict[str, Any], error: float, is_solved: bool
) -> None:
    run = prepared(problem(**given))
    run.explore()
    best = run.state.best()
    assert best is not None
    solves = run.state.solves
    sharpen_cost(run.state, best, SharperCostSettings(error=error))
    assert (run.state.solves > solves) == is_solved


def test_sharper_corners_bring_the_cost_near_the_exact_power() -> None:
    """A slow joint against gravity: its friction and its power are close to their corners."""
    run = prepared(descent())
    task, goal = run.state.prepared, run.state.candidates[0].q_goal
    (smooth,) = duration_intervals(task, goal)
    (sharp,) = duration_intervals(task, goal, width=0.1, friction_share=0.15)
    state = np.concatenate([goal, np.full(len(goal), 0.01), np.zeros(len(goal))])[None]
    (smoothed,), _ = task.kernel.value(state, smooth.p)
    (sharper,), _ = task.kernel.value(state, sharp.p)
    (exact,), _ = task.kernel.value(
        state, task.parameters(electrical=1.0, width=0.0, friction_share=0.05)
    )
    assert abs(sharper - exact) < abs(smoothed - exact) / 2
