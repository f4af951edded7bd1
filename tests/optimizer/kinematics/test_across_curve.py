"""Newton's method across self-motions, against forward kinematics."""

from __future__ import annotations

import numpy as np

from joulepath.models.registry import load_robot
from joulepath.optimizer.kinematics.chain import Chain, pose_error, twist_size
from joulepath.optimizer.kinematics.seven.across_curve import (
    project_across,
    step_across,
)
from tests.optimizer.chains import serial_chain

CHAINS = [Chain.of(load_robot("gen3").model), Chain.of(serial_chain(7).model)]
# largest pose error of a point on a curve [m, rad]
EXACT = 2e-10


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


def test_steps_at_singular_configurations_are_numbers() -> None:
    """Of a straight arm and of nearly straight ones."""
    rng, chain = np.random.default_rng(76), CHAINS[0]
    for size in (0.0, 1e-9):
        q, along = size * rng.normal(size=(20, 7)), np.eye(7)[rng.integers(0, 7, 20)]
        T = chain.flange(q[:1])[0]
        for found in (*step_across(chain, q, along, T), project_across(chain, q, along, T)):
            assert np.isfinite(found).all()
