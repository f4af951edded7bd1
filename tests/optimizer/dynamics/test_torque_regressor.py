"""The symbolic regressor against Pinocchio's."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from joulepath.models.registry import load_robot
from joulepath.optimizer.dynamics.torque_regressor import torque_regressor

# entries reach some 100; both recursions round at 1e-13
TOLERANCE = 1e-10


@pytest.mark.parametrize("name", ["ur5e", "panda", "kr10_r1100"])
def test_regressor_is_pinocchios(name: str) -> None:
    random = np.random.default_rng(1)
    gravity = random.normal(size=3) * 5
    model = load_robot(name).loaded_model(2.0, np.array([0.0, 0.1, 0.1]), 0.01 * np.eye(3), gravity)
    nv, data = model.nv, model.createData()
    q, v, a, g = (
        ca.SX.sym(each, size) for each, size in (("q", nv), ("v", nv), ("a", nv), ("g", 3))
    )
    function = ca.Function("regressor", [q, v, a, g], [torque_regressor(model, q, v, a, g)])
    for _ in range(50):
        state = random.uniform(-3, 3, nv), random.uniform(-3, 3, nv), random.uniform(-10, 10, nv)
        expected = pin.computeJointTorqueRegressor(model, data, *state)
        assert np.abs(np.array(function(*state, gravity)) - expected).max() < TOLERANCE
