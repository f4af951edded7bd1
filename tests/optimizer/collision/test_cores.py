"""Cores of shapes, against the support function of each shape: the largest n·x over its points."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.collision.cores import core_of
from joulepath.optimizer.problem.scene import Box, Capsule, Cylinder, HalfSpace, Mesh, Shape, Sphere

ROUNDING = 1e-12  # m; sums of a few products of sizes below 1 m
CORNERS = np.random.default_rng(4).normal(size=(20, 3)) * 0.2
DIRECTIONS = np.random.default_rng(5).normal(size=(200, 3))
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1, keepdims=True)
COSINE = DIRECTIONS[:, 2]
SINE = np.hypot(DIRECTIONS[:, 0], DIRECTIONS[:, 1])

SUPPORTS: list[tuple[Shape, Array]] = [
    (Sphere(0.3), np.full(200, 0.3)),
    (Capsule(0.1, 0.5), 0.25 * np.abs(COSINE) + 0.1),
    (Cylinder(0.1, 0.5), 0.25 * np.abs(COSINE) + 0.1 * SINE),
    (Box(np.array([0.1, 0.2, 0.6])), np.abs(DIRECTIONS) @ np.array([0.05, 0.1, 0.3])),
    (Mesh(CORNERS), (DIRECTIONS @ CORNERS.T).max(axis=1)),
]


@pytest.mark.parametrize(
    ("shape", "expected"), SUPPORTS, ids=[type(shape).__name__ for shape, _ in SUPPORTS]
)
def test_core_has_the_support_of_its_shape(shape: Shape, expected: Array) -> None:
    core = core_of(shape)
    support = (DIRECTIONS @ core.points.T).max(axis=1) + core.disc_radius * SINE + core.radius
    assert np.abs(support - expected).max() < ROUNDING
    assert not core.is_half_space


def test_only_boxes_have_a_half_size() -> None:
    sizes = {type(shape): core_of(shape).half_size for shape, _ in SUPPORTS}
    assert np.array_equal(sizes.pop(Box), [0.05, 0.1, 0.3])  # type: ignore[arg-type]
    assert all(size is None for size in sizes.values())


def test_half_space_lies_below_the_origin() -> None:
    core = core_of(HalfSpace())
    assert core.is_half_space
    assert core.points.tolist() == [[0.0, 0.0, 0.0]]
