"""The C library's distances against those of numpy: in random cells, and where segments and boxes
degenerate.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Body, Indices
from joulepath.optimizer.collision.cores import Core, box_corners
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.collision.pair_arrays import PairArrays
from joulepath.optimizer.collision.pair_distance import PairGeometry
from tests.optimizer.cells import LOADS, arm_in_cell, cell
from tests.optimizer.collision.numpy_distances import NumpyDistances
from tests.optimizer.collision.test_closed_forms import COUNT, KINDS, NEARLY_PARALLEL, segments

SAME = 1e-13  # m; both round
ON_DISC = 1e-8  # m; the root of the rounding of a squared cosine
SEARCHED = 5e-9  # m; Coal's iterations, and those of the library
# normals of bodies nearer than this [m] are rounding, and of overlapping ones a choice among
# several
APART = 1e-6


class NumpyGeometry(PairGeometry):
    """All that the C library would compute, by numpy."""

    def __init__(self, bodies: Sequence[Body], pairs: Indices, nq: int) -> None:
        super().__init__(bodies, pairs, nq)
        self._compiled = NumpyDistances(PairArrays.of(bodies, pairs))  # type: ignore[assignment]


def of_pairs(first: list[Body], second: list[Body]) -> tuple[PairGeometry, PairGeometry]:
    """The geometry of pairs of bodies that stand still, by the library and by numpy."""
    bodies, k = [*first, *second], len(first)
    pairs = np.column_stack([np.arange(k), np.arange(k, 2 * k)])
    return PairGeometry(bodies, pairs, 1), NumpyGeometry(bodies, pairs, 1)


def standing(core: Core) -> Body:
    return Body("body", 0, core, np.eye(4))


def assert_same(compiled: PairGeometry, by_numpy: PairGeometry, tolerance: float) -> None:
    """Distances are the same; normals may differ where several are as good, but attain the
    distance.
    """
    k = len(compiled.is_cloud)
    frames, none, pair = np.tile(np.eye(4), (1, 2, 1, 1)), np.zeros(k, dtype=np.intp), np.arange(k)
    found, expected = (each.witness_points(frames, none, pair) for each in (compiled, by_numpy))
    assert np.abs(found.distance - expected.distance).max() < tolerance
    attained = compiled.separations(
        frames, none, none, pair, (found.normal, found.normal), np.full(k, -1)
    )
    # a normal is as wrong as its points are, over their distance
    apart = found.distance > APART
    assert (np.abs(attained - found.distance) * np.minimum(found.distance, 1.0))[apart].max(
        initial=0.0
    ) < tolerance
    # what touches is left to numpy
    np.testing.assert_array_equal(
        found.normal[found.distance <= 0], expected.normal[found.distance <= 0]
    )


@pytest.mark.parametrize("kind", KINDS)
def test_segments(kind: str) -> None:
    a, b = segments(kind, seed=3)
    pairs = of_pairs([standing(Core(x)) for x in a], [standing(Core(x)) for x in b])
    assert_same(*pairs, NEARLY_PARALLEL if kind == "nearly parallel" else SAME)


@pytest.mark.parametrize("kind", KINDS)
def test_boxes_and_segments(kind: str) -> None:
    _, b = segments(kind, seed=4)
    rng = np.random.default_rng(5)
    half = (
        rng.integers(1, 3, (COUNT, 3)) / 2
        if kind == "on a grid"
        else np.abs(rng.normal(size=(COUNT, 3))) * 0.5
    )
    boxes = [standing(Core(box_corners(-size, size), half_size=size)) for size in half]
    moving = [standing(Core(x)) for x in b]
    for pairs in (of_pairs(boxes[::2], moving[::2]), of_pairs(moving[1::2], boxes[1::2])):
        assert_same(*pairs, SAME)


def in_cell(seed: int) -> tuple[CollisionModel, PairGeometry, Array]:
    """A model, its geometry by numpy, and frames (n, nq + 1, 4, 4) at random configurations."""
    arm = arm_in_cell(LOADS[seed], cell(seed))
    model, limits = CollisionModel(arm), arm.active_limits
    q = np.random.default_rng(seed).uniform(limits.q_min, limits.q_max, (60, arm.robot.nq))
    return model, NumpyGeometry(model.bodies, model.pairs, model.nq), model.frames(q)


@pytest.mark.parametrize("seed", range(4))
def test_random_cells(seed: int) -> None:
    """Of every shape: distances, gradients and separations."""
    model, by_numpy, frames = in_cell(seed)
    configuration, pair = (each.ravel() for each in np.indices((len(frames), len(model.pairs))))
    found, expected = (
        each.witness_points(frames, configuration, pair) for each in (model.geometry, by_numpy)
    )
    closed = model.geometry.is_closed_form[pair]
    assert np.abs(found.distance - expected.distance)[closed].max() < SAME
    gradients = [
        each.gradients(frames, configuration, pair, expected) for each in (model.geometry, by_numpy)
    ]
    assert np.abs(gradients[0] - gradients[1]).max() < SAME
    end, normal = np.roll(configuration, 1), np.roll(expected.normal, 5, axis=0)
    whole = np.full(len(pair), -1)
    separations = [
        each.separations(frames, configuration, end, pair, (expected.normal, normal), whole)
        for each in (model.geometry, by_numpy)
    ]
    assert np.abs(separations[0] - separations[1]).max() < ON_DISC


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("within", [-np.inf, 0.0, 0.1, np.inf])
def test_bounds(seed: int, within: float) -> None:
    """From nothing, and from bounds known before: the same pairs are left, and where they are, the
    same bounds.
    """
    model, by_numpy, frames = in_cell(seed)
    pairs = np.arange(len(model.pairs))[::2]
    known = np.random.default_rng(seed).normal(0.0, 0.3, (len(frames), len(pairs)))
    for before in (None, known):
        found, expected = (
            each.bounds(frames, pairs, within, before) for each in (model.geometry, by_numpy)
        )
        for one, other in zip(found[1:], expected[1:], strict=True):
            np.testing.assert_array_equal(one, other)
        np.testing.assert_allclose(found[0], expected[0], rtol=0, atol=SAME)
    configuration, pair = (each.ravel() for each in np.indices((len(frames), len(model.pairs))))
    bounds = [each.cover_bounds(frames, configuration, pair) for each in (model.geometry, by_numpy)]
    np.testing.assert_allclose(*bounds, rtol=0, atol=SAME)


@pytest.mark.parametrize("within", [0.1, np.inf])
def test_a_configuration_that_is_no_number_is_never_clear(within: float) -> None:
    """Its distances are no numbers, as by numpy, and the others are what they are without it; nor
    is there an error without any configuration."""
    model, by_numpy, frames = in_cell(1)
    found = model.pair_distances(frames[:3], within=within).distance
    lost = frames[:3].copy()
    lost[1, 1:] = np.nan
    distances = []
    for geometry in (model.geometry, by_numpy):
        model.geometry = geometry
        assert model.pair_distances(frames[:0], within=within).distance.shape == (
            0,
            len(model.pairs),
        )
        distances.append(model.pair_distances(lost, within=within).distance)
        assert np.isnan(distances[-1][1]).any()
        sound, expected = distances[-1][[0, 2]], found[[0, 2]]
        near = expected <= within
        np.testing.assert_allclose(sound[near], expected[near], rtol=0, atol=SEARCHED)
        assert (sound[~near] > within).all()
    np.testing.assert_array_equal(np.isnan(distances[0]), np.isnan(distances[1]))
