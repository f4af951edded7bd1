"""Gravity, inertia and bounds on their derivatives, against Pinocchio and differences."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from joulepath import Arm, load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.inertia_spectrum import InertiaSpectrum
from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
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
    """The derivatives of the inertia and of the potential energy are below their bounds.

    Differences give the first to third derivatives of the inertia, and the second and third of the
    potential energy. Some come near the bound.
    """
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
        # the difference is a mean of third derivatives over a small box, and so has the same bound
        assert (np.abs(total / (2 * coarse) ** 3).max(axis=0) <= D3[i, j, k] + DIFFERENCE).all()


def test_a_vertical_first_joint_carries_no_gravity() -> None:
    assert (ChainDerivatives.of(ARMS["bare"]).potential_bound(2)[0] == 0).all()
    assert (ChainDerivatives.of(ARMS["loaded and tilted"]).potential_bound(2)[0] > 0).all()


OF_SPECTRUM = 1e-6  # what central differences of such a step miss, and their rounding
NEAR = (
    0.7  # of the bound on an arm of three parallel axes; axes that are across each other lose more
)
CROSSED = 0.3


def greatest(chain: ChainDerivatives, q: Array) -> Array:
    """The greatest first derivatives (nq, nq, nq) at configurations, by differences."""
    found = []
    for step in STEP * np.eye(chain.nq):
        change = (chain.joint_inertia(q + step) - chain.joint_inertia(q - step)) / (2 * STEP)
        found.append(np.abs(change).max(axis=0))
    return np.array(found)


@pytest.mark.parametrize(("name", "near"), [("ur5e", NEAR), ("panda", CROSSED)])
def test_derivatives_stay_below_their_bounds_and_come_near(name: str, near: float) -> None:
    chain = ChainDerivatives.of(Arm(robot=load_robot(name), payload=PAYLOAD))
    spectrum = InertiaSpectrum.of(chain.joint_inertia, chain.nq)
    assert spectrum is not None
    bound = spectrum.bound(1)
    seen = greatest(chain, np.random.default_rng(5).uniform(-np.pi, np.pi, (600, chain.nq)))
    assert (seen <= bound + OF_SPECTRUM).all()
    assert seen.sum() > near * bound.sum()
    assert (chain.inertia_bound(1) <= bound).all()


def test_a_pendulum_has_the_derivatives_of_its_closed_form() -> None:
    """The inertia of two links with parallel axes: M_00 = a + 2 b cos q_1, M_01 = c + b cos q_1."""

    def inertia(q: Array) -> Array:
        cosine = np.cos(q[:, 1])
        rows = [[3 + 2 * cosine, 1 + cosine], [1 + cosine, np.ones_like(cosine)]]
        return np.moveaxis(np.array(rows), -1, 0)

    spectrum = InertiaSpectrum.of(inertia, 2)
    assert spectrum is not None
    for order in (1, 2, 3):
        bound = spectrum.bound(order)
        assert np.abs(bound[(1,) * order] - [[2, 1], [1, 0]]).max() < 1e-9
        assert np.abs(bound[(0,) * order]).max() == 0


def test_too_many_joints_have_no_spectrum() -> None:
    assert InertiaSpectrum.of(lambda q: np.zeros((len(q), 8, 8)), 8) is None
