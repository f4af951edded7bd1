"""Lower bounds on distances, by enclosing balls, covering spheres, separating planes and earlier
distances, against exact distances of random scenes.
"""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.collision.clearance_constraint import (
    CLEARANCE_CONSTRAINT,
    ClearanceConstraint,
)
from joulepath.optimizer.collision.model import CollisionModel
from tests.optimizer.cells import LOADS, arm_in_cell, cell
from tests.optimizer.collision.separations import separation

# Coal ends its search within 1e-6 m
ITERATED = 1e-5  # m
SAME = 1e-13  # m; both round
# m; the root of the rounding of a squared cosine
ON_DISC = 1e-8
SEARCHED = 5e-9  # m; Coal's iterations, and those of the library


def in_cell(seed: int, count: int) -> tuple[CollisionModel, Array]:
    """A model with boxes, spheres, cylinders, capsules, meshes and half-spaces, and random
    configurations q (count, nq).
    """
    arm = arm_in_cell(LOADS[seed], cell(seed))
    limits = arm.active_limits
    q = np.random.default_rng(seed).uniform(limits.q_min, limits.q_max, (count, arm.robot.nq))
    return CollisionModel(arm), q


@pytest.mark.parametrize("seed", range(4))
def test_balls_and_covering_spheres_bound_the_distances_from_below(seed: int) -> None:
    """Bounds of balls agree with their definition; bounds of covering spheres are mostly better."""
    model, q = in_cell(seed, 60)
    frames, pairs = model.frames(q), np.arange(len(model.pairs))
    exact = model.pair_distances(frames).distance
    balls, row, _ = model.geometry.bounds(frames, pairs, np.inf)
    assert len(row) == balls.size, "none is beyond an infinite distance"
    for (i, k), bound in zip(model.pairs, balls.T, strict=True):
        first, second = model.bodies[i], model.bodies[k]
        centres = [frames[:, b.link] @ [*b.ball_centre, 1.0] for b in (first, second)]
        radii = sum(b.ball_radius + b.core.radius + b.margin for b in (first, second))
        between = np.linalg.norm(centres[1] - centres[0], axis=1) - radii
        assert bound == pytest.approx(-np.inf if first.core.is_half_space else between, abs=SAME)
    configuration, pair = (index.ravel() for index in np.indices(exact.shape))
    covers = model.geometry.cover_bounds(frames, configuration, pair).reshape(exact.shape)
    # deep inside a round body the search for the depth may end below it
    shallow = exact > -0.1
    assert (np.maximum(balls, covers) <= exact + ITERATED)[shallow].all()
    both = np.isfinite(covers) & np.isfinite(balls)
    assert np.median(covers[both] - balls[both]) > 0


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("within", [-np.inf, 0.0, 0.1])
def test_pairs_that_may_be_near_are_left(seed: int, within: float) -> None:
    """With and without known bounds: a pair remains if its bounds of balls, known bounds and bounds
    of covering spheres are all small enough.
    """
    model, q = in_cell(seed, 60)
    frames, pairs = model.frames(q), np.arange(len(model.pairs))[::2]
    balls = model.geometry.bounds(frames, pairs, np.inf)[0]
    configuration, column = (index.ravel() for index in np.indices(balls.shape))
    covers = model.geometry.cover_bounds(frames, configuration, pairs[column]).reshape(balls.shape)
    known = np.random.default_rng(seed).normal(0.0, 0.3, balls.shape)
    for before in (None, known):
        first = balls if before is None else before
        near = first <= within
        expected = np.where(near, np.maximum(first, balls), first)
        near &= expected <= within
        expected = np.where(near, np.maximum(expected, covers), expected)
        found, *left = model.geometry.bounds(frames, pairs, within, before)
        np.testing.assert_allclose(found, expected, rtol=0, atol=SAME)
        np.testing.assert_array_equal(left, np.nonzero(near & (expected <= within)))


def test_a_normal_separates_at_both_configurations() -> None:
    """The normal moves with the first body; of two normals, the larger of the lesser separations
    counts.
    """
    model, q = in_cell(1, 4)
    frames = model.frames(q)
    begin, pair = (index.ravel() for index in np.indices((len(q), len(model.pairs))))
    end = np.roll(begin, 1)
    normals = model.geometry.witness_points(frames, begin, pair).normal
    given = normals, np.roll(normals, 5, axis=0)
    whole = np.full(len(pair), -1)
    found = model.geometry.separations(frames, begin, end, pair, given, whole)
    for case, (i, k) in enumerate(model.pairs[pair]):
        first, second = model.bodies[i], model.bodies[k]
        at = frames[begin[case]], frames[end[case]]
        least = []
        for own, T_begin in zip(given, at, strict=True):
            in_first = T_begin[first.link, :3, :3].T @ own[case]
            least.append(
                min(
                    separation(
                        first,
                        T[first.link],
                        second,
                        T[second.link],
                        T[first.link, :3, :3] @ in_first,
                    )
                    for T in at
                )
            )
        assert found[case] == pytest.approx(max(least), abs=ON_DISC)


@pytest.mark.parametrize("seed", range(4))
def test_distances_bounded_by_earlier_ones_are_those_that_count(seed: int) -> None:
    """For any earlier results, all distances up to the gradient distance are exact, and the others
    are lower bounds.
    """
    model, q = in_cell(seed, 60)
    rng = np.random.default_rng(seed)
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


@pytest.mark.parametrize("within", [0.1, np.inf])
def test_a_configuration_that_is_no_number_is_never_clear(within: float) -> None:
    """Its distances are NaN, and the other configurations are unaffected; zero configurations are
    no error.
    """
    model, q = in_cell(1, 3)
    frames = model.frames(q)
    found = model.pair_distances(frames, within=within).distance
    assert model.pair_distances(frames[:0], within=within).distance.shape == (0, len(model.pairs))
    lost = frames.copy()
    lost[1, 1:] = np.nan
    distance = model.pair_distances(lost, within=within).distance
    assert np.isnan(distance[1]).all()
    sound, expected = distance[[0, 2]], found[[0, 2]]
    near = expected <= within
    np.testing.assert_allclose(sound[near], expected[near], rtol=0, atol=SEARCHED)
    assert (sound[~near] > within).all()
