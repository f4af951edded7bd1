"""Newton's method across a curve of configurations, with the second order of the motion, against
forward kinematics.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.registry import load_robot
from joulepath.optimizer.kinematics.chain import Chain, miss, pose_error
from joulepath.optimizer.kinematics.seven.across_curve import (
    ACROSS,
    project_across,
    project_onto_curve,
    second_order,
    step_across,
)
from tests.optimizer.chains import serial_chain

CHAINS = [Chain.of(load_robot("gen3").model), Chain.of(serial_chain(7).model)]
# steps [rad], and what they leave over their cube [m/rad³]: a length of the arm, times the joints
# that turn it
STEPS, THIRD_ORDER = (3e-2, 3e-3, 3e-4), 40.0
# error [m, rad] of what is on the curve: each of seven joints may be off by some ACROSS.tolerance
EXACT = 10 * ACROSS.tolerance
# share of a step, or length, that rounding changes next to a singularity; way ahead [rad]
ROUNDING, AHEAD = 1e-9, 0.03


def test_what_two_orders_leave_goes_with_the_cube_of_the_step() -> None:
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


def test_what_is_led_onto_the_curve_is_on_it_across_the_given_direction() -> None:
    rng = np.random.default_rng(72)
    for chain in CHAINS:
        for away in (1e-6, 1e-4, 1e-2):
            q = rng.uniform(-2.0, 2.0, 7)
            T, jacobian = chain.flange_and_jacobian(q[None])
            along = np.linalg.svd(jacobian[0])[2][-1] + 0.1 * rng.normal(size=7)
            starts = q + away * rng.uniform(-1.0, 1.0, (20, 7))
            reached = project_across(chain, starts, np.tile(along, (20, 1)), T[0])
            assert miss(pose_error(chain.flange(reached), T[0])).max() < EXACT
            assert np.abs((reached - starts) @ along).max() < EXACT


def test_many_points_take_the_steps_that_few_do() -> None:
    """Those of many are solved for by orthogonal rows, those of few by LAPACK."""
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
    """Side by side, and few at a time; of an arm that is straight, or nearly."""
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


def test_what_is_led_ahead_is_on_the_curve_as_far_ahead_as_asked() -> None:
    """With short steps, too: what is left of the way is gone later."""
    rng, chain = np.random.default_rng(74), CHAINS[0]
    q = rng.uniform(-2.0, 2.0, 7)
    T, jacobian = chain.flange_and_jacobian(q[None])
    along = np.tile(np.linalg.svd(jacobian[0])[2][-1], (20, 1))
    ahead = rng.uniform(-AHEAD, AHEAD, 20)
    for longest in (np.inf, AHEAD / 3):
        reached, left = project_onto_curve(chain, np.tile(q, (20, 1)), along, ahead, T[0], longest)
        assert (
            left.max() < ACROSS.tolerance
            and miss(pose_error(chain.flange(reached), T[0])).max() < EXACT
        )
        assert np.abs(((reached - q) * along).sum(axis=1) - ahead).max() < EXACT
