"""Links made lighter or heavier: kernel, potential energy and certificate against Pinocchio with
scaled inertias.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.by_pinocchio import torques_of
from tests.optimizer.moves import GOAL, PAYLOAD, ROBOT, START, TILTED, problem

TORQUE_TOLERANCE = 1e-9  # N·m; both recursions round at about 1e-13 of torques of some 500 N·m
SAME = 1e-12  # relative; the same figures on another route
SCALES = [np.full(6, 0.5), np.array([0.1, 0.4, 1.0, 2.0, 10.0, 3.0]), np.ones(6)]


def scaled(scale: Array) -> pin.Model:
    """The oracle: every moving body's ten dynamic parameters times its factor, then the payload."""
    model = ROBOT.model.copy()
    for j in range(6):
        model.inertias[j + 1] = pin.Inertia.FromDynamicParameters(
            scale[j] * ROBOT.model.inertias[j + 1].toDynamicParameters()
        )
    flange = model.frames[model.getFrameId("flange")].placement
    model.inertias[6] = model.inertias[6] + flange.act(
        pin.Inertia(PAYLOAD.mass, PAYLOAD.com, PAYLOAD.inertia)
    )
    model.gravity.linear = TILTED
    return model


@pytest.mark.parametrize("scale", SCALES, ids=str)
def test_torques_and_potential_are_those_of_scaled_inertias(scale: Array) -> None:
    compile_kernel(ROBOT)
    task = PreparedProblem.of(problem(payload=PAYLOAD, gravity=TILTED, link_mass_scale=scale))
    model = scaled(scale)
    data = model.createData()
    q, v, a = np.random.default_rng(0).uniform(-3, 3, (3, 200, 6))
    expected = torques_of(model, q, v, a)
    assert np.abs(task.torques(q, v, a) - expected).max() < TORQUE_TOLERANCE
    for at in q[:20]:
        assert task.potential(at) == pytest.approx(
            pin.computePotentialEnergy(model, data, at), rel=1e-12, abs=1e-9
        )


def test_unscaled_is_the_robot_itself() -> None:
    compile_kernel(ROBOT)
    plain = optimize(problem(payload=PAYLOAD))
    one = optimize(problem(payload=PAYLOAD, link_mass_scale=1.0))
    assert one.energy.electrical.total == pytest.approx(plain.energy.electrical.total, rel=SAME)
    assert (
        np.abs(one.trajectory.spline.control_points - plain.trajectory.spline.control_points).max()
        < SAME
    )


def test_a_lighter_arm_draws_less() -> None:
    """Certified with the scaled model, above its bound; for lifting, every increase of mass costs
    energy."""
    compile_kernel(ROBOT)
    totals = []
    for scale in (0.5, 1.0, 1.5):
        found = optimize(problem(GOAL, START, link_mass_scale=scale))
        assert found.certificate.valid
        assert found.lower_bound <= found.energy.electrical.total
        totals.append(found.energy.electrical.total)
    assert totals[0] < 0.95 * totals[1]
    assert totals[1] < 0.95 * totals[2]
