from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest
from scipy.interpolate import BSpline

from benchmarks.comparison import Peers
from benchmarks.motion import Replay, replay
from benchmarks.peers.__main__ import PEERS
from benchmarks.peers.casadi_opti import derivative_points
from benchmarks.peers.peer import Peer, versions
from benchmarks.tasks import move
from models.registry import load_robot
from optimizer.trajectories.bspline import DEGREE, uniform
from tests.optimizer.moves import problem_with

OPTIONAL = {"drake": "pydrake", "copp": "copp_py"}
ENDS = 1e-6  # rad
SLACK = 1e-3  # by which limits may be exceeded
IDENTITY = 1e-3  # sum of energy's parts against the total: what makes a replay's speeds and torques fit together
# toppra knows no jerk; bounds on a grid are broken between its points
HOLDING = [name for name in PEERS if name not in ("toppra", "opti-grid")]


def planned(name: str) -> Replay:
    if name in OPTIONAL:
        pytest.importorskip(OPTIONAL[name])
    robot, task = load_robot("ur5e"), move(0, 0)
    module, kind = PEERS[name].split(":")
    peer: Peer = getattr(import_module(f"benchmarks.peers.{module}"), kind)(robot)
    assert versions(peer)
    motion = peer.plan(task.q_start, task.q_goal)
    assert motion is not None
    return replay(problem_with(task.q_start, task.q_goal), motion, task.q_start, task.q_goal)


@pytest.mark.parametrize("name", PEERS)
def test_peers_go_where_they_are_sent(name: str) -> None:
    found = planned(name)
    electrical = found.energy.electrical
    assert found.end_error < ENDS
    assert electrical.parts_sum == pytest.approx(electrical.total, rel=IDENTITY)
    if name in HOLDING:
        assert found.worst <= 1 + SLACK


def test_gradient_of_the_energy_given_to_drake() -> None:
    pytest.importorskip("pydrake")
    peer = import_module("benchmarks.peers.drake_trajectory").DrakeTrajectory(load_robot("ur5e"))
    rng = np.random.default_rng(0)
    x = np.append(rng.normal(size=peer.basis.n * 6), 2.0)
    _, gradient = peer.energy._evaluate(x)
    step = 1e-6
    for k in rng.integers(len(x), size=10):
        change = np.zeros(len(x))
        change[k] = step
        slope = (peer.energy._evaluate(x + change)[0] - peer.energy._evaluate(x - change)[0]) / (2 * step)
        assert slope == pytest.approx(gradient[k], rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_control_points_of_derivatives(order: int) -> None:
    knots, points = uniform(13).knots, np.random.default_rng(0).normal(size=(13, 2))
    derived = BSpline(knots[order:-order], derivative_points(knots, order) @ points, DEGREE - order)
    t = np.linspace(0, 1, 50)
    assert np.allclose(derived(t), BSpline(knots, points, DEGREE)(t, order), rtol=0, atol=1e-9 * 13**order)


def test_the_best_is_the_least_energy_within_limits() -> None:
    def figures(energy: float, worst: float | None) -> dict[str, object]:
        row = {"index": 0, "wall": 0.1, "energy": energy, "duration": 1.0, "worst": worst}
        return {"title": "x", "versions": "y 1", "what": "z", "seed": 0, "rows": [row, {"index": 1, "wall": 0.2}]}

    # JSON has no infinity: an unbounded share comes back as null
    found = {"a": figures(110.0, 1.0), "b": figures(90.0, 1.2), "c": figures(80.0, None), "d": figures(100.0, 1.0)}
    peers = Peers.of(found)
    assert peers.best[0] == 100.0
    assert [round(float(peers.above(row)[0]), 3) for row in peers.rows] == [0.1, -0.1, -0.2, 0.0]
