"""Path constraints against Pinocchio, and their gradients against finite differences."""

import numpy as np
import pinocchio as pin
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.forward import joint_placements
from joulepath.optimizer.kinematics.path_constraints import (
    PathConstraints,
    PointSpeedConstraint,
    ToolConeConstraint,
)
from tests.optimizer.moves import ROBOT

PLACEMENTS = joint_placements(ROBOT.model)
AXIS = np.array([0.6, 0.0, 0.8])
DIRECTION = np.array([0.0, 0.28, -0.96])
POINTS = np.array([[0.05, -0.02, 0.2], [0.0, 0.1, 0.0]])
LIMITS = {
    "cone": ToolConeConstraint(AXIS, DIRECTION, 0.7),
    "tcp": PointSpeedConstraint("tcp_speed", 6, POINTS, 1.5),
    "elbow": PointSpeedConstraint("elbow_speed", 2, np.array([[-0.425, 0.0, 0.13]]), 0.8),
}
# step of central differences on values of order one
STEP = 1e-6
# their error: rounding 1e-10, smaller truncation
GRADIENT_TOLERANCE = 1e-8
KINEMATICS_TOLERANCE = 1e-12


@pytest.fixture(scope="module")
def states() -> tuple[Array, Array]:
    rng = np.random.default_rng(7)
    return rng.uniform(-3, 3, (20, 6)), rng.uniform(-2, 2, (20, 6))


@pytest.mark.parametrize("name", LIMITS)
def test_gradients_are_those_of_finite_differences(name: str, states: tuple[Array, Array]) -> None:
    path = PathConstraints(PLACEMENTS, [LIMITS[name]])
    q, v = states
    found = path.linearised(q, v)
    np.testing.assert_array_equal(found.value, path.ratios(q, v))
    for j in range(6):
        d = STEP * np.eye(6)[j]
        by_q = (path.ratios(q + d, v) - path.ratios(q - d, v)) / (2 * STEP)
        by_v = (path.ratios(q, v + d) - path.ratios(q, v - d)) / (2 * STEP)
        np.testing.assert_allclose(found.by_q[..., j], by_q, atol=GRADIENT_TOLERANCE)
        np.testing.assert_allclose(found.by_v[..., j], by_v, atol=GRADIENT_TOLERANCE)


def test_shares_are_what_pinocchio_says(states: tuple[Array, Array]) -> None:
    path = PathConstraints(PLACEMENTS, list(LIMITS.values()))
    assert path.names == ("tool_cone", "tcp_speed", "tcp_speed", "elbow_speed")
    data = ROBOT.model.createData()
    for q, v, shares in zip(*states, path.ratios(*states), strict=True):
        pin.forwardKinematics(ROBOT.model, data, q, v)
        angle = np.arccos(data.oMi[6].rotation @ AXIS @ DIRECTION)
        speeds = [speed_of(data, 6, point) / 1.5 for point in POINTS]
        elbow = speed_of(data, 2, LIMITS["elbow"].points[0]) / 0.8
        np.testing.assert_allclose(
            shares, [angle / 0.7, *speeds, elbow], atol=KINEMATICS_TOLERANCE, rtol=1e-9
        )


def speed_of(data: pin.Data, joint: int, point: Array) -> float:
    placement, motion = data.oMi[joint], data.v[joint]
    at = placement.act(pin.Motion(motion))
    return float(np.linalg.norm(at.linear + np.cross(at.angular, placement.act(point))))


def test_a_tool_along_the_cones_axis_uses_nothing_of_it() -> None:
    path = PathConstraints(
        PLACEMENTS, [ToolConeConstraint(np.array([0.0, 0, 1]), np.array([0.0, 0, -1]), 0.1)]
    )
    q = np.array([[0.0, -np.pi / 2, np.pi / 2, -np.pi / 2, -np.pi / 2, 0.0]])
    found = path.linearised(q, np.zeros((1, 6)))
    # accumulated rounding of six turns
    assert found.value[0, 0] < 1e-6
    assert np.isfinite(found.by_q).all()
