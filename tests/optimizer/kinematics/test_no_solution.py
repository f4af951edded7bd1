"""Poses out of reach, beyond the limits, or reached by singular configurations alone: each reported as what it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import minimize

from models.robot import Array
from optimizer.exceptions import SingularPose, UnreachablePose
from optimizer.kinematics.inverse import SINGULAR
from tests.optimizer.kinematics.flange import (
    ACCURACY,
    DATA,
    EVERYDAY,
    FLANGE,
    FOUND,
    IK,
    LIMITS,
    MODEL,
    ROUNDING,
    errors,
    forward,
    jacobian,
    joints,
    pose,
)

# the search that judges the distance to reach converges to this [m]
SEARCH = 1e-5


def test_nothing_inside_the_limits_says_so() -> None:
    tight = replace(LIMITS, q_min=EVERYDAY + 0.1, q_max=EVERYDAY + 0.2)
    with pytest.raises(UnreachablePose, match=r"start .*position limit") as caught:
        IK.solve(forward(EVERYDAY), limits=tight, target="start")
    assert caught.value.target == "start"
    assert caught.value.distance is None


@pytest.mark.parametrize(
    "T",
    [
        pose([3.0, 0.0, 0.2]),
        pose([0.2, -0.9, 0.9], pin.rpy.rpyToMatrix(0.4, 1.9, -0.7)),
        pose([0.0, 0.0, 0.6], pin.rpy.rpyToMatrix(np.pi, 0.0, 0.3)),
        pose([0.05, 0.02, 0.5], pin.rpy.rpyToMatrix(0.1, 0.0, 0.3)),
    ],
    ids=["far", "just out of reach", "on the first axis", "inside the shoulder's cylinder"],
)
def test_distance_is_to_the_nearest_reachable_position(T: Array) -> None:
    with pytest.raises(UnreachablePose, match="out of reach") as caught:
        IK.solve(T)
    distance = caught.value.distance
    assert distance is not None
    assert distance == pytest.approx(nearest_by_search(T), abs=SEARCH)


def test_distance_from_the_first_axis_is_the_shoulders_offset() -> None:
    with pytest.raises(UnreachablePose) as caught:
        IK.solve(pose([0.0, 0.0, 0.6], pin.rpy.rpyToMatrix(np.pi, 0.0, 0.3)))
    assert caught.value.distance == pytest.approx(0.1333, abs=ROUNDING)


def nearest_by_search(T: Array) -> float:
    """Least distance from T's position among configurations with T's orientation, from many random starts."""

    def turn(q: Array) -> Array:
        return np.asarray(pin.log3(T[:3, :3].T @ forward(q)[:3, :3]))

    def turn_gradient(q: Array) -> Array:
        R = T[:3, :3].T @ forward(q)[:3, :3]
        return np.asarray(pin.Jlog3(R) @ pin.computeFrameJacobian(MODEL, DATA, q, FLANGE, pin.LOCAL)[3:])

    def square(q: Array) -> tuple[float, Array]:
        gap = forward(q)[:3, 3] - T[:3, 3]
        return float(gap @ gap), 2 * jacobian(q)[:3].T @ gap

    found = []
    for q in np.random.default_rng(1).uniform(-np.pi, np.pi, (25, 6)):
        answer = minimize(
            square, q, jac=True, method="SLSQP", constraints={"type": "eq", "fun": turn, "jac": turn_gradient},
            options={"maxiter": 200, "ftol": 1e-14},
        )  # fmt: skip
        if np.linalg.norm(turn(answer.x)) < 1e-7:
            found.append(np.sqrt(answer.fun))
    return float(min(found))


@pytest.mark.parametrize(
    "q",
    [
        np.array([0.4, -0.7, 0.0, 0.5, 1.0, 0.3]),
        np.array([0.4, -1.3, 1.5, 0.5, 0.0, 0.3]),
        np.array([0.4, -1.3, 1.5, 0.5, np.pi, 0.3]),
    ],
    ids=["stretched elbow", "stretched wrist", "folded wrist"],
)
def test_singular_solutions_are_left_out_where_there_are_others(q: Array) -> None:
    T = forward(q)
    assert any(branch.smallest_singular_value < SINGULAR for branch in IK.branches(T))
    solutions = IK.solve(T)
    for solution in solutions:
        assert solution.smallest_singular_value >= SINGULAR
        assert max(errors(T, solution.q)) < ACCURACY


def test_rounding_does_not_hide_a_singularity() -> None:
    """A stretched elbow, and a tool's transform there and back, which moves the pose by its last digit."""
    rng = np.random.default_rng(5)
    for q in rng.uniform(-np.pi, np.pi, (300, 6)):
        q[2] = 0.0
        tool = pose([0.1, -0.2, 0.3], pin.rpy.rpyToMatrix(*rng.uniform(-1, 1, 3)))
        try:
            solutions = IK.solve(forward(q) @ tool, tool)
        except SingularPose:
            continue
        assert np.abs(np.exp(1j * joints(solutions)) - np.exp(1j * q)).max(axis=1).min() > FOUND


def test_upright_home_is_singular() -> None:
    home = np.array([0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0])
    with pytest.raises(SingularPose) as caught:
        IK.solve(forward(home), target="start")
    assert caught.value.target == "start"
    assert caught.value.smallest_singular_value < SINGULAR


def test_only_singular_solutions_inside_the_limits_are_no_answer() -> None:
    q = np.array([0.4, -0.7, 0.0, 0.5, 1.0, 0.3])
    tight = replace(LIMITS, q_min=q - 0.1, q_max=q + 0.1)
    with pytest.raises(SingularPose) as caught:
        IK.solve(forward(q), limits=tight)
    assert caught.value.smallest_singular_value < SINGULAR


@pytest.mark.parametrize("far", [1e3, 1e9, 1e160, 1e300])
def test_any_finite_pose_is_answered(far: float) -> None:
    with pytest.raises(UnreachablePose) as caught:
        IK.solve(pose([far, -far, far]))
    assert caught.value.distance == pytest.approx(np.sqrt(3) * far, rel=1e-2)


def test_a_pose_that_only_a_continuum_reaches_is_singular() -> None:
    """A stretched wrist at every split of its turn between the fourth and sixth joint, never out of reach."""
    rng = np.random.default_rng(2)
    seen = 0
    for _ in range(300):
        q = np.array([rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(-0.2, 0.2), *rng.uniform(-3, 3, 3)])
        q[4] = rng.choice([0.0, np.pi])
        try:
            IK.solve(forward(q))
        except SingularPose:
            seen += 1
    assert seen > 10


def test_a_pose_within_rounding_of_the_edge_of_reach_is_singular() -> None:
    stretched = forward(np.array([0.4, -0.7, 0.0, 0.5, 1.0, 0.3]))
    for shift in (-1e-14, 1e-14):
        T = stretched.copy()
        T[:3, 3] *= 1 + shift
        try:
            solutions = IK.solve(T)
        except SingularPose:
            continue
        assert all(solution.smallest_singular_value >= SINGULAR for solution in solutions)
