"""Distances of segments and boxes, and cores of shapes, against slow reference methods, mainly in
degenerate cases.
"""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.collision.closed_form_distance import box_segment, segment_segment
from joulepath.optimizer.collision.cores import core_of
from joulepath.optimizer.problem.scene import Box, Capsule, Cylinder, HalfSpace, Mesh, Shape, Sphere

COUNT = 1000
EXACT = 1e-13  # m; lengths are of the order of 1 m, rounding 1e-16
NEARLY_PARALLEL = 2e-7  # m; see PARALLEL
KINDS = (
    "any",
    "parallel",
    "nearly parallel",
    "on one line",
    "points",
    "short",
    "crossing",
    "on a grid",
)


def segments(kind: str, seed: int) -> tuple[Array, Array]:
    """Pairs of segments (k, 2, 3) [m]."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, COUNT, 2, 3))
    u, share = a[:, 1] - a[:, 0], rng.uniform(-2, 2, (2, COUNT, 1))
    tiny = 10 ** rng.uniform(-12, -3, (COUNT, 1)) * rng.normal(size=(COUNT, 3))
    match kind:
        case "parallel":
            b[:, 1] = b[:, 0] + share[0] * u
        case "nearly parallel":
            b[:, 1] = b[:, 0] + share[0] * u + tiny
        case "on one line":
            b = a[:, :1] + share.transpose(1, 0, 2) * u[:, None]
        case "points":
            a[: COUNT // 2, 1], b[COUNT // 4 :, 1] = a[: COUNT // 2, 0], b[COUNT // 4 :, 0]
        case "short":
            b[:, 1] = b[:, 0] + tiny
        case "crossing":
            b = (
                a.mean(axis=1, keepdims=True)
                + np.array([-1, 1])[:, None] * (b[:, 1] - b[:, 0])[:, None]
            )
        case "on a grid":
            a, b = rng.integers(-1, 2, (2, COUNT, 2, 3)).astype(float)
    return a, b


def nearest_of_candidates(a: Array, b: Array) -> Array:
    """The least distance (k,) [m] between ends and segments, and between the lines if both nearest
    points are inside the segments.
    """
    found = [to_segment(p, s) for p, s in ((a[:, 0], b), (a[:, 1], b), (b[:, 0], a), (b[:, 1], a))]
    u, v, w = a[:, 1] - a[:, 0], b[:, 1] - b[:, 0], a[:, 0] - b[:, 0]
    A = np.stack([u, -v], axis=2)
    inside = np.linalg.pinv(A) @ -w[..., None]
    clamped = np.clip(inside, 0, 1)
    found.append(np.linalg.norm(w + (A @ clamped)[..., 0], axis=1))
    return np.min(found, axis=0)


def to_segment(p: Array, s: Array) -> Array:
    u = s[:, 1] - s[:, 0]
    square = (u * u).sum(axis=1)
    share = np.clip(((p - s[:, 0]) * u).sum(axis=1) / np.where(square > 0, square, 1.0), 0, 1)
    return np.asarray(np.linalg.norm(p - s[:, 0] - share[:, None] * u, axis=1))


@pytest.mark.parametrize("kind", KINDS)
def test_segments(kind: str) -> None:
    a, b = segments(kind, seed=3)
    distance, normal, r = segment_segment(a, b)
    tolerance = NEARLY_PARALLEL if kind == "nearly parallel" else EXACT
    assert np.abs(distance - nearest_of_candidates(a, b)).max() < tolerance
    assert np.abs(np.linalg.norm(normal, axis=1) - 1).max() < EXACT
    assert to_segment(r, b).max() < EXACT
    apart = distance > 1e-6
    assert to_segment(r - distance[:, None] * normal, a)[apart].max(initial=0.0) < EXACT
    # the normal of crossing segments is perpendicular to both
    u, v = a[:, 1] - a[:, 0], b[:, 1] - b[:, 0]
    crossing = (distance < 1e-10) & (np.linalg.norm(np.cross(u, v), axis=1) > 1e-3)
    assert crossing.any() == (kind in ("crossing", "on a grid"))
    for along in (u, v):
        assert np.abs((normal * along).sum(axis=1))[crossing].max(initial=0.0) < EXACT


@pytest.mark.parametrize("kind", KINDS)
def test_box_and_segment(kind: str) -> None:
    """The distance from a box is convex along a segment: thirds of it are cut away until the least
    is left.
    """
    _, b = segments(kind, seed=4)
    rng = np.random.default_rng(5)
    half = (
        rng.integers(1, 3, (COUNT, 3)) / 2
        if kind == "on a grid"
        else np.abs(rng.normal(size=(COUNT, 3))) * 0.5
    )
    low, high = np.zeros(COUNT), np.ones(COUNT)
    for _ in range(100):
        thirds = low + (high - low) / 3, high - (high - low) / 3
        nearer = np.less_equal(*(from_box(half, at(b, s)) for s in thirds))
        low, high = np.where(nearer, low, thirds[0]), np.where(nearer, thirds[1], high)
    least = from_box(half, at(b, (low + high) / 2))
    distance, normal, point = box_segment(half, b)
    # two thirds that differ by rounding alone change the least distance by its square root
    assert np.abs(np.maximum(distance, 0.0) - least).max() < 1e-7
    assert (distance <= least + EXACT).all()
    assert to_segment(point, b)[distance > 0].max() < EXACT
    assert np.abs(np.linalg.norm(normal, axis=1) - 1).max() < EXACT
    assert (distance > 0).sum() > 20 and (distance < 0).sum() > 20


def at(b: Array, s: Array) -> Array:
    return np.asarray(b[:, 0] + s[:, None] * (b[:, 1] - b[:, 0]))


def from_box(half: Array, x: Array) -> Array:
    return np.asarray(np.linalg.norm(np.maximum(np.abs(x) - half, 0.0), axis=1))


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
