"""The terms of dual bounds in the C library, against numpy and their definitions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from joulepath import Arm, Payload, load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.friction_conjugate import FrictionConjugate
from joulepath.optimizer.bounds.grid_cells import Curvature, GridCells, Spacing
from joulepath.optimizer.bounds.least_potential import LeastPotential
from joulepath.optimizer.bounds.path_terms import GridPoints, path_terms
from joulepath.optimizer.bounds.reference import Reference, half_sides
from joulepath.optimizer.bounds.speed_conjugate import SpeedConjugate
from joulepath.optimizer.bounds.weights import Weights
from tests.optimizer.bounds import numpy_terms
from tests.optimizer.moves import PAYLOAD, ROBOT, TILTED

STEPS = 7
SAME = 1e-11  # relative; both round
DIFFERENCE = (
    1e-8  # relative; the difference quotient of the inertia has a step of 1e-5 of the multipliers
)
LOAD = np.array([0.2, 0.1, 0.05, 0.0, 0.3, 0.9])
ARMS: dict[str, Arm] = {
    "ur5e": Arm(robot=ROBOT),
    "loaded and tilted": Arm(robot=ROBOT, payload=PAYLOAD, gravity=TILTED),
    "friction with the load": Arm(
        robot=replace(ROBOT, friction_laws={"load": replace(ROBOT.friction, load=LOAD)})
    ),
    "panda": Arm(robot=load_robot("panda"), payload=Payload(1.0, np.array([0.02, 0.0, 0.1]))),
    "ur20": Arm(robot=load_robot("ur20")),
}


@dataclass(frozen=True)
class Case:
    """A random path of an arm, with multipliers of most of its joints."""

    arm: Arm
    chain: ChainDerivatives
    reference: Reference
    loss: Array
    grid: tuple[int, int]

    @classmethod
    def of(cls, name: str, seed: int) -> Case:
        rng, arm = np.random.default_rng(seed), ARMS[name]
        nq = arm.robot.nq
        x = np.cumsum(rng.normal(size=(STEPS + 1, nq)) * 0.2, axis=0)
        multipliers = rng.normal(size=nq) * 10 + np.cumsum(rng.normal(size=(STEPS + 1, nq)), axis=0)
        first, other = sorted(rng.choice(nq, 2, replace=False).tolist())
        kept = rng.random(nq) < 0.7
        loss = arm.drives.copper / arm.drives.torque_constant**2
        return cls(
            arm, ChainDerivatives.of(arm), Reference(x, multipliers * kept), loss, (first, other)
        )

    def terms(self, longest: float) -> Any:
        half = half_sides(self.reference, self.arm.active_limits, longest)
        return path_terms(self.chain, self.reference, self.loss, half, self.grid, Spacing(0.3, 1.4))


def assert_same(found: Array, expected: Array, tolerance: float = SAME) -> None:
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() <= tolerance * (1 + np.abs(expected).max())


@pytest.mark.parametrize("name", ARMS)
def test_points(name: str) -> None:
    for seed in range(3):
        case = Case.of(name, seed)
        rng, nq = np.random.default_rng(seed), case.chain.nq
        omega = 2 * case.loss * case.reference.multipliers
        offsets = rng.normal(size=(11, nq)) * (rng.random((11, nq)) < 0.4)
        needed = rng.random((STEPS + 1, 11)) < 0.8
        given = case.chain, case.reference.x, omega, offsets, needed
        found, expected = GridPoints.of(*given), numpy_terms.grid_points(*given)
        assert_same(found.gravity, expected.gravity)
        assert_same(found.slope, expected.slope)
        for each in ("kinetic", "momentum", "rows"):
            assert_same(getattr(found, each), getattr(expected, each), DIFFERENCE)
        assert (found.gravity[:, 0][~needed[:-1]] == 0).all()


@pytest.mark.parametrize("name", ARMS)
def test_least_potential_and_greatest_speed_terms(name: str) -> None:
    """Both libraries give the same terms, for adjacent cells of durations and for one duration.

    The weights are light and heavy.
    """
    for seed in range(2):
        case, rng = Case.of(name, seed), np.random.default_rng(10 + seed)
        friction = FrictionConjugate.of(case.arm.friction_law, case.arm.active_limits.v_max)
        assert friction is not None
        stiffness = friction.stiffness(case.arm.friction_law)
        edges = rng.uniform(0.7, 2.0) * rng.uniform(1.02, 1.3) ** np.arange(5)
        terms, beta = case.terms(float(edges[-1])), 1 / edges
        for scale in (0.1, 0.8):
            confined = rng.uniform(0, 2, len(stiffness)) * stiffness
            work = 0.0 if friction.load is not None else rng.uniform(0, 0.05)
            weights = Weights(scale, confined, rng.uniform(0.1, 1) * stiffness, work)
            potential = LeastPotential(terms)
            for fast, slow in ((beta[:-1], beta[1:]), (beta[:1], beta[:1])):
                expected = numpy_terms.least_potential(potential, weights, fast, slow)
                assert_same(potential(weights, fast, slow), expected)
            for durations in (edges, edges[:1]):
                conjugate = SpeedConjugate(
                    friction, case.arm.active_limits, terms, case.loss, durations
                )
                for found, expected in zip(
                    conjugate(weights), numpy_terms.speed_conjugate(conjugate, weights), strict=True
                ):
                    assert_same(found, expected)


def test_an_arm_of_two_joints_has_none_beside_the_grid() -> None:
    whole, rng = ChainDerivatives.of(ARMS["ur5e"]), np.random.default_rng(2)
    arrays = (whole.placements, whole.mass, whole.lever, whole.inertia, whole.rotor)
    chain = ChainDerivatives(*(each[:2] for each in arrays), whole.gravity)
    reference = Reference(rng.normal(size=(STEPS + 1, 2)), rng.normal(size=(STEPS + 1, 2)) * 10)
    half = rng.uniform(0.1, 1, (STEPS, 2))
    potential = LeastPotential(
        path_terms(chain, reference, np.array([0.01, 0.01]), half, (0, 1), Spacing())
    )
    weights, beta = Weights(0.5, np.array([1.0, 2.0]), np.array([0.5, 0.5])), np.array([1.0, 0.8])
    found = potential(weights, beta, 0.9 * beta)
    assert_same(found, numpy_terms.least_potential(potential, weights, beta, 0.9 * beta))
    assert np.isfinite(found).all()


def test_deviation_of_cells() -> None:
    """The deviation is the farthest corner's distance from the mean, plus the curvature between."""
    rng = np.random.default_rng(1)
    cells = GridCells((np.array([-0.5, -0.1, 0.2]), np.array([-0.3, 0.0, 0.1, 0.7])))
    value, mean = rng.normal(size=(2, 2, 12, 5)), rng.normal(size=(2, 5))
    curvature = Curvature(rng.random((2, 5)), rng.random((2, 2, 5)))
    joints = (0, 3, 4)
    found = cells.deviation(value, mean, curvature, joints)
    # the cell of the second interval of both axes, at the end of the first step
    corners = [4 + 1, 4 + 2, 8 + 1, 8 + 2]
    expected = np.abs(value[0, 1, corners][:, joints] - mean[0, list(joints)]).max(axis=0)
    expected += curvature.along[0, list(joints)]
    expected += (curvature.across[0, 0] * 0.3**2 / 8 + curvature.across[0, 1] * 0.1**2 / 8)[
        list(joints)
    ]
    assert_same(found[0, 1, 3 + 1], expected)


def test_points_that_are_needed_are_the_corners_of_cells_within_the_boxes() -> None:
    cells = GridCells((Spacing().axis(1.0), Spacing(0.3).axis(0.5)))
    half = np.array([[0.1, 0.1], [1.0, 0.5], [0.4, 0.1], [1e-6, 1e-6]])
    needed, beyond = cells.needed(half), cells.beyond(half)
    positions, reached = cells.points(), np.zeros_like(needed)
    low = np.stack(
        np.meshgrid(*(axis[:-1] for axis in cells.axes), indexing="ij"), axis=-1
    ).reshape(-1, 2)
    high = np.stack(
        np.meshgrid(*(axis[1:] for axis in cells.axes), indexing="ij"), axis=-1
    ).reshape(-1, 2)
    for step, cell in zip(*np.nonzero(beyond == 0), strict=True):
        corner = ((positions == low[cell]) | (positions == high[cell])).all(axis=1)
        reached[step : step + 2] |= corner
    assert (needed == reached).all()
    assert needed[:, cells.centre].all()
    # every position in a box belongs to a cell in use
    for step, box in enumerate(half):
        at = np.random.default_rng(step).uniform(-box, box, (200, 2))
        inside = ((low <= at[:, None]) & (at[:, None] <= high)).all(axis=2)
        assert (beyond[step][inside.argmax(axis=1)] == 0).all()
