"""The inertia as a trigonometric polynomial: its terms add up to it, and its derivatives stay below
their bounds.
"""

from __future__ import annotations

import numpy as np
import pytest

from joulepath import Arm, load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.inertia_spectrum import InertiaSpectrum
from tests.optimizer.moves import PAYLOAD

STEP = 1e-4
DIFFERENCE = 1e-6  # what central differences of such a step miss, and their rounding
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
    assert (seen <= bound + DIFFERENCE).all()
    assert seen.sum() > near * bound.sum()
    assert (chain.inertia_bound(1) <= bound).all()


def test_a_pendulum_has_the_derivatives_of_its_closed_form() -> None:
    """Two links that turn about parallel axes: M_00 = a + 2 b cos q_1, M_01 = c + b cos q_1."""

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
