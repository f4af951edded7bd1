"""Lower bounds on distances, by covering spheres and by earlier distances, against exact distances
of random scenes.
"""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.optimizer.collision.clearance_constraint import (
    CLEARANCE_CONSTRAINT,
    ClearanceConstraint,
)
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.collision.pair_arrays import PairArrays
from tests.optimizer.cells import LOADS, arm_in_cell, cell
from tests.optimizer.collision.numpy_distances import NumpyDistances

# Coal ends its search within 1e-6 m
ITERATED = 1e-5  # m


@pytest.mark.parametrize("seed", range(4))
def test_covering_spheres_bound_the_distances_from_below(seed: int) -> None:
    """Boxes, spheres, cylinders, capsules, meshes and half-spaces. Most bounds are better than
    those of balls.
    """
    arm = arm_in_cell(LOADS[seed], cell(seed))
    model, limits = CollisionModel(arm), arm.active_limits
    q = np.random.default_rng(seed).uniform(limits.q_min, limits.q_max, (200, arm.robot.nq))
    frames, pairs = model.frames(q), np.arange(len(model.pairs))
    configuration, pair = (index.ravel() for index in np.indices((len(q), len(pairs))))
    exact = model.pair_distances(frames).distance.ravel()
    bound = model.geometry.cover_bounds(frames, configuration, pair)
    assert (bound <= exact + ITERATED).all()
    balls = (
        NumpyDistances(PairArrays.of(model.bodies, model.pairs))
        .ball_distances(frames, pairs)
        .ravel()
    )
    has_bound = np.isfinite(bound) & np.isfinite(balls)
    assert has_bound.any()
    assert np.median(bound[has_bound] - balls[has_bound]) > 0


@pytest.mark.parametrize("seed", range(4))
def test_distances_bounded_by_earlier_ones_are_those_that_count(seed: int) -> None:
    """Whatever was computed before, all distances up to the gradient distance are exact, and the
    others are lower bounds.
    """
    arm = arm_in_cell(LOADS[seed], cell(seed))
    model, limits = CollisionModel(arm), arm.active_limits
    rng = np.random.default_rng(seed)
    q = rng.uniform(limits.q_min, limits.q_max, (60, arm.robot.nq))
    constraint = ClearanceConstraint(model, np.arange(len(model.pairs)))
    for step in (0.0, 0.01, 0.05, 0.3):
        near = q + step * rng.uniform(-1, 1, q.shape)
        frames = model.frames(near)
        found = constraint.linearised(frames, near, np.zeros_like(near))
        fresh = ClearanceConstraint(model, np.arange(len(model.pairs))).linearised(
            frames, near, np.zeros_like(near)
        )
        exact = model.pair_distances(frames).distance
        counted = exact <= CLEARANCE_CONSTRAINT.gradient_distance
        np.testing.assert_array_equal(found.value[counted], fresh.value[counted])
        np.testing.assert_array_equal(found.by_q[counted], fresh.by_q[counted])

        assert counted.any() and (found.value[~counted] < found.value[counted].min()).all()
