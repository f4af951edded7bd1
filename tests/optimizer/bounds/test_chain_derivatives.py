"""Gravity, inertia and the bounds on their derivatives: against Pinocchio and differences."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
from joulepath.optimizer.problem.arm import Arm
from tests.optimizer.moves import CEILING, PAYLOAD, ROBOT, TILTED

ROUNDING = 1e-11  # of sums of some hundred products of order 10
STEP = 1e-4
DIFFERENCE = (
    1e-5  # rounding of 1e-14 over the square of the step, and what central differences miss
)
ARMS = {
    "bare": Arm(robot=ROBOT),
    "loaded and tilted": Arm(robot=ROBOT, payload=PAYLOAD, gravity=TILTED),
    "loaded below a ceiling": Arm(robot=ROBOT, payload=PAYLOAD, gravity=CEILING),
}


def configurations(seed: int, count: int) -> Array:
    return np.random.default_rng(seed).uniform(-np.pi, np.pi, (count, 6))


@pytest.mark.parametrize("name", list(ARMS))
def test_torques_and_inertia_are_pinocchios(name: str) -> None:
    arm, model = ARMS[name], rigid_body_model(ARMS[name])
    chain, data, q = ChainDerivatives.of(ARMS[name]), model.createData(), configurations(1, 20)
    torque, slope = chain.gravity_torque(q)
    inertia = chain.joint_inertia(q)
    for k, each in enumerate(q):
        assert np.abs(torque[k] - pin.computeGeneralizedGravity(model, data, each)).max() < ROUNDING
        assert (
            np.abs(slope[k] - pin.computeGeneralizedGravityDerivatives(model, data, each)).max()
            < ROUNDING
        )
        M = np.triu(pin.crba(model, data, each))
        M = M + np.triu(M, 1).T - np.diag(model.armature) + np.diag(arm.drives.rotor_inertia)
        assert np.abs(inertia[k] - M).max() < ROUNDING


@pytest.mark.parametrize("name", list(ARMS))
def test_no_derivative_exceeds_its_bound(name: str) -> None:
    """First to third derivatives of the inertia, second and third of the potential energy, by
    differences; among them some that come near the bound."""
    chain, q = ChainDerivatives.of(ARMS[name]), configurations(2, 300)
    U2, U3 = chain.potential_bound(2), chain.potential_bound(3)
    D1, D2, D3 = (chain.inertia_bound(n) for n in (1, 2, 3))
    slope = chain.gravity_torque(q)[1]
    assert (np.abs(slope).max(axis=0) <= U2 + ROUNDING).all()
    assert np.abs(slope[:, 1, 1]).max() > 0.7 * U2[1, 1]
    for j, first in enumerate(np.eye(6)):
        ahead, behind = q + STEP * first, q - STEP * first
        third = (chain.gravity_torque(ahead)[1] - chain.gravity_torque(behind)[1]) / (2 * STEP)
        assert (np.abs(third).max(axis=0) <= U3[j] + DIFFERENCE).all()
        change = (chain.joint_inertia(ahead) - chain.joint_inertia(behind)) / (2 * STEP)
        assert (np.abs(change).max(axis=0) <= D1[j] + DIFFERENCE).all()
        for k, second in enumerate(np.eye(6)):
            corners = [
                chain.joint_inertia(each + s * STEP * second)
                for each in (ahead, behind)
                for s in (1, -1)
            ]
            twice = (corners[0] - corners[1] - corners[2] + corners[3]) / (4 * STEP**2)
            assert (np.abs(twice).max(axis=0) <= D2[j, k] + DIFFERENCE).all()
    rng, coarse = np.random.default_rng(3), 0.02
    for _ in range(20):
        i, j, k = rng.integers(0, 6, 3)
        total = np.zeros((300, 6, 6))
        for a in (1, -1):
            for b in (1, -1):
                for c in (1, -1):
                    at = q + coarse * (a * np.eye(6)[i] + b * np.eye(6)[j] + c * np.eye(6)[k])
                    total += a * b * c * chain.joint_inertia(at)
        # a mean of third derivatives over a small box, so that the bound holds for it as well
        assert (np.abs(total / (2 * coarse) ** 3).max(axis=0) <= D3[i, j, k] + DIFFERENCE).all()


def test_a_vertical_first_joint_carries_no_gravity() -> None:
    assert (ChainDerivatives.of(ARMS["bare"]).potential_bound(2)[0] == 0).all()
    assert (ChainDerivatives.of(ARMS["loaded and tilted"]).potential_bound(2)[0] > 0).all()
