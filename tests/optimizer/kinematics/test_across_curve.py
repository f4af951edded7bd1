"""Newton's method across self-motions, with second-order terms, against forward kinematics."""

from __future__ import annotations

import numpy as np

from joulepath.optimizer.kinematics.chain import Chain, pose_error, twist_size
from joulepath.optimizer.kinematics.seven.across_curve import (
    ACROSS,
    project_across,
    project_onto_curve,
    second_order,
    step_across,
)
from joulepath.optimizer.problem.robots import load_robot
from tests.optimizer.chains import serial_chain

CHAINS = [Chain.of(load_robot("gen3").model), Chain.of(serial_chain(7).model)]
# sizes of joint moves [rad]
STEPS = (3e-2, 3e-3, 3e-4)
# third-order remainder over the cube of the move: a length of the arm times the number of turning
# joints [m/rad³]
THIRD_ORDER = 40.0
# largest pose error of a point on a curve, with errors of all joints up to ACROSS.tolerance [m,
# rad]
EXACT = 10 * ACROSS.tolerance
# share of a step, or length, changed by rounding next to a singularity
ROUNDING = 1e-9
# displacement along a direction [rad]
AHEAD = 0.03


def test_the_remainder_of_two_orders_is_cubic_in_the_step() -> None:
    rng = np.random.default_rng(71)
    for chain in CHAINS:
        q = rng.uniform(-2.0, 2.0, (50, 7))
        T, jacobian = chain.flange_and_jacobian(q)
        for step in STEPS:
            move = step * rng.uniform(-1.0, 1.0, q.shape)
            twist = pose_error(T, chain.flange(q + move))
            left = (
                twist
                - (jacobian @ move[:, :, None])[:, :, 0]
                - second_order(jacobian.transpose(1, 2, 0), move.T).T
            )
            assert np.abs(left).max() < THIRD_ORDER * step**3


def test_a_projected_point_is_on_the_curve_across_the_given_direction() -> None:
    rng = np.random.default_rng(72)
    for chain in CHAINS:
        for away in (1e-6, 1e-4, 1e-2):
            q = rng.uniform(-2.0, 2.0, 7)
            T, jacobian = chain.flange_and_jacobian(q[None])
            along = np.linalg.svd(jacobian[0])[2][-1] + 0.1 * rng.normal(size=7)
            starts = q + away * rng.uniform(-1.0, 1.0, (20, 7))
            reached = project_across(chain, starts, np.tile(along, (20, 1)), T[0])
            assert twist_size(pose_error(chain.flange(reached), T[0])).max() < EXACT
            assert np.abs((reached - starts) @ along).max() < EXACT


def test_many_points_take_the_same_steps_as_few() -> None:
    """Few points, solved by LAPACK, take the same steps as many points, by orthogonalised rows."""
    rng = np.random.default_rng(73)
    for chain in CHAINS:
        q = rng.uniform(-2.0, 2.0, (ACROSS.many + 10, 7))
        T, along = chain.flange(q[:1])[0], rng.normal(size=q.shape)
        move, tangent = step_across(chain, q, along, T)
        parts = [
            step_across(chain, q[k : k + 20], along[k : k + 20], T) for k in range(0, len(q), 20)
        ]
        few, tangents = (np.concatenate(each) for each in zip(*parts, strict=True))
        assert np.abs(move - few).max() < ROUNDING * np.abs(few).max()
        unit, other = (each / np.linalg.norm(each, axis=1)[:, None] for each in (tangent, tangents))
        assert np.abs(unit - other).max() < ROUNDING
        assert ((tangent * along).sum(axis=1) > 0).all()


def test_steps_at_singular_configurations_are_numbers() -> None:
    """Steps at singular configurations are finite, for few and many points.

    The arms are straight and nearly straight.
    """
    rng, chain = np.random.default_rng(76), CHAINS[0]
    for size in (0.0, 1e-9):
        for n in (3, ACROSS.many + 3):
            q, along = size * rng.normal(size=(n, 7)), np.eye(7)[rng.integers(0, 7, n)]
            T = chain.flange(q[:1])[0]
            for found in (
                *step_across(chain, q, along, T),
                *project_onto_curve(chain, q, along, np.zeros(n), T),
            ):
                assert np.isfinite(found).all()


def test_a_displaced_point_is_on_the_curve_at_the_given_displacement() -> None:
    """A displaced point is on the curve, even with short steps, as later steps cover the rest."""
    rng, chain = np.random.default_rng(74), CHAINS[0]
    q = rng.uniform(-2.0, 2.0, 7)
    T, jacobian = chain.flange_and_jacobian(q[None])
    along = np.tile(np.linalg.svd(jacobian[0])[2][-1], (20, 1))
    ahead = rng.uniform(-AHEAD, AHEAD, 20)
    for longest in (np.inf, AHEAD / 3):
        reached, left = project_onto_curve(chain, np.tile(q, (20, 1)), along, ahead, T[0], longest)
        assert (
            left.max() < ACROSS.tolerance
            and twist_size(pose_error(chain.flange(reached), T[0])).max() < EXACT
        )
        assert np.abs(((reached - q) * along).sum(axis=1) - ahead).max() < EXACT
