"""Other planners: their motions, and alternating runs in separate processes."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module

import numpy as np
import pytest
from scipy.interpolate import BSpline

from benchmarks.comparison import Comparison
from benchmarks.motion import Replay, replay
from benchmarks.planners.__main__ import PLANNERS, planner_of
from benchmarks.planners.casadi_opti import derivative_points
from benchmarks.planners.planner import versions
from benchmarks.side_by_side import Worker, measured
from benchmarks.tasks import move
from joulepath.optimizer.motion.bspline import DEGREE, uniform
from joulepath.optimizer.problem.robots import load_robot
from tests.optimizer.moves import problem_with
from tests.selection import long_but

OPTIONAL = {"drake": "pydrake", "copp": "copp_py"}
ENDS = 1e-6  # rad
SLACK = 1e-3  # by which limits may be exceeded
# of the sum of the energy's parts against the total: speeds and torques of a replay are consistent
IDENTITY = 1e-3
# toppra knows no jerk; bounds on a grid are broken between its points
HOLDING = [name for name in PLANNERS if name not in ("toppra", "opti-grid")]


def planned(name: str) -> Replay:
    if name in OPTIONAL:
        pytest.importorskip(OPTIONAL[name])
    planner, task = planner_of(name), move(0, 0)
    assert versions(planner)
    motion = planner.plan(task.q_start, task.q_goal)
    assert motion is not None
    return replay(problem_with(task.q_start, task.q_goal), motion, task.q_start, task.q_goal)


@pytest.mark.parametrize(
    "name", long_but([name for name in PLANNERS if name in ("joulepath", "toppra")], PLANNERS)
)
def test_planners_reach_start_and_goal(name: str) -> None:
    found = planned(name)
    electrical = found.energy.electrical
    assert found.end_error < ENDS
    assert electrical.parts_sum == pytest.approx(electrical.total, rel=IDENTITY)
    if name in HOLDING:
        assert found.worst <= 1 + SLACK


def test_gradient_of_the_energy_given_to_drake() -> None:
    pytest.importorskip("pydrake")
    planner = import_module("benchmarks.planners.drake_trajectory").DrakeTrajectory(
        load_robot("ur5e")
    )
    rng = np.random.default_rng(0)
    x = np.append(rng.normal(size=planner.basis.n * 6), 2.0)
    _, gradient = planner.energy._evaluate(x)
    step = 1e-6
    for k in rng.integers(len(x), size=10):
        change = np.zeros(len(x))
        change[k] = step
        slope = (
            planner.energy._evaluate(x + change)[0] - planner.energy._evaluate(x - change)[0]
        ) / (2 * step)
        assert slope == pytest.approx(gradient[k], rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_control_points_of_derivatives(order: int) -> None:
    knots, points = uniform(13).knots, np.random.default_rng(0).normal(size=(13, 2))
    derived = BSpline(knots[order:-order], derivative_points(knots, order) @ points, DEGREE - order)
    t = np.linspace(0, 1, 50)
    assert np.allclose(
        derived(t), BSpline(knots, points, DEGREE)(t, order), rtol=0, atol=1e-9 * 13**order
    )


def test_the_best_is_the_least_energy_within_limits() -> None:
    def results(energy: float, worst: float | None) -> dict[str, object]:
        row = {"index": 0, "wall": 0.1, "energy": energy, "duration": 1.0, "worst": worst}
        return {
            "title": "x",
            "versions": "y 1",
            "what": "z",
            "seed": 0,
            "rows": [row, {"index": 1, "wall": 0.2}],
        }

    # JSON has no infinity: an unbounded ratio comes back as null
    found = {
        "a": results(110.0, 1.0),
        "b": results(90.0, 1.2),
        "c": results(80.0, None),
        "d": results(100.0, 1.0),
    }
    planners = Comparison.of(found)
    assert planners.best[0] == 100.0
    assert [round(float(planners.above(row)[0]), 3) for row in planners.rows] == [
        0.1,
        -0.1,
        -0.2,
        0.0,
    ]


@pytest.fixture
def workers() -> Iterator[list[Worker]]:
    made = [Worker(name, 0, 2) for name in ("toppra", "ruckig")]
    yield made
    for each in made:
        each.end()


@pytest.mark.long
def test_every_planner_takes_time_for_every_task(workers: list[Worker]) -> None:
    walls = measured(workers[0], workers[1:], 2, 1)
    assert walls.shape == (2, 2)
    assert (walls > 0).all()
