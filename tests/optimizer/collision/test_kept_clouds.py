"""Clouds are cached for later requests with the same obstacle, up to a total number of parts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.collision.clouds import CLOUDS, cloud_of
from joulepath.optimizer.problem.clouds import Points

# number of clouds in a full cache
FIT = 4


@pytest.fixture(autouse=True)
def _none_are_kept() -> Iterator[None]:
    cloud_of.cache_clear()
    yield
    cloud_of.cache_clear()


def points(count: int, seed: int) -> Array:
    return np.random.default_rng(seed).uniform(-0.9, 0.9, (count, 3))


def test_a_repeated_obstacle_is_built_once() -> None:
    first = cloud_of(Points(points(500, 21), 0.01))
    assert cloud_of(Points(points(500, 21), 0.02)) is first  # the radius is none of the tree's
    assert cloud_of(Points(points(500, 21)[:-1], 0.01)) is not first


@pytest.mark.long
def test_the_cloud_that_rested_longest_leaves_a_full_cache() -> None:
    scans = [Points(points(CLOUDS.max_kept_parts // FIT, seed), 0.01) for seed in range(FIT + 1)]
    made = [cloud_of(scan) for scan in scans[:FIT]]
    # it counts parts, not obstacles, and holds the largest
    assert (
        cloud_of.cache.currsize
        == CLOUDS.max_kept_parts
        == cloud_of.cache.maxsize
        >= CLOUDS.max_triangles
    )
    assert cloud_of(scans[0]) is made[0]  # now the second one has rested longest
    made.append(cloud_of(scans[FIT]))
    assert cloud_of.cache.currsize == CLOUDS.max_kept_parts
    again = [cloud_of(scans[k]) is made[k] for k in (0, *range(2, FIT + 1), 1)]
    assert again == [True] * FIT + [False]
