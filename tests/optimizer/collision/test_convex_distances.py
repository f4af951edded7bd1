"""Distances of convex cores by the C library: certified by the separation along their normals, in
closed form for parallel faces, and by Coal for overlapping cores.
"""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Body
from joulepath.optimizer.collision.cores import Core, box_corners
from joulepath.optimizer.collision.pair_distance import PairGeometry
from tests.optimizer.collision.separations import separation

SEARCHED = 2e-10  # m; the search ends at a difference of 1e-10 between its bounds, and both round
ON_DISC = 2e-8  # m; the root of the rounding of a squared cosine, times radii of up to a metre
WITNESS = 1e-7  # m; shares of corners of a triangle with a sine of 1e-8, times lengths of up to 3 m
COUNT = 100
DISC = np.array([[0.0, 0, -0.2], [0, 0, 0.2]])


def box(size: Array) -> Core:
    return Core(box_corners(-size / 2, size / 2), half_size=size / 2)


def drawn(kind: str, rng: np.random.Generator) -> Core:
    """A core of a size between a millimetre and a few metres."""
    size = 10 ** rng.uniform(-3, 0.5)
    match kind:
        case "hull":
            return Core(size * rng.normal(size=(40, 3)) * [1, 0.5, 0.2], radius=0.1 * size)
        case "needle":
            return Core(size * rng.normal(size=(6, 3)) * [1, 1e-4, 1e-4])
        case "plate":
            return box(size * np.array([1, 0.8, 1e-3]))
        case "triangle":
            return Core(size * rng.normal(size=(3, 3)))
        case "cylinder":
            return Core(size * DISC, disc_radius=0.3 * size)
        case _:
            return box(size * rng.uniform(0.1, 1, 3))


def turned(rng: np.random.Generator, position: Array) -> Array:
    T = np.eye(4)
    T[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    T[:3, 0] *= np.sign(np.linalg.det(T[:3, :3]))
    T[:3, 3] = position
    return T


def of(first: list[Body], second: list[Body]) -> PairGeometry:
    k = len(first)
    return PairGeometry([*first, *second], np.column_stack([np.arange(k), np.arange(k, 2 * k)]), 1)


@pytest.mark.parametrize("kind", ["hull", "needle", "plate", "triangle", "cylinder", "box"])
@pytest.mark.parametrize("other", ["hull", "plate", "cylinder"])
def test_no_unit_vector_separates_by_more_and_the_normal_by_as_much(kind: str, other: str) -> None:
    """The separation along a unit vector never exceeds the distance, so a separation along the
    normal equal to the computed value proves it. The witness point is on the second core."""
    rng = np.random.default_rng(7)
    cores = [[drawn(each, rng) for _ in range(COUNT)] for each in (kind, other)]
    bodies = [
        [Body("body", 0, core, turned(rng, 0.5 * rng.normal(size=3))) for core in each]
        for each in cores
    ]
    geometry = of(*bodies)
    frames, none = np.tile(np.eye(4), (1, 2, 1, 1)), np.zeros(COUNT, dtype=np.intp)
    pair = np.arange(COUNT)
    found = geometry.witness_points(frames, none, pair)
    apart = geometry._compiled.witness_points(frames, none, pair)[0] > 1e-6
    assert apart.sum() > COUNT / 4
    tolerance = ON_DISC if "cylinder" in (kind, other) else SEARCHED
    for k in np.flatnonzero(apart):
        first, second = bodies[0][k], bodies[1][k]
        attained = separation(first, np.eye(4), second, np.eye(4), found.normal[k])
        assert found.distance[k] == pytest.approx(attained, abs=tolerance)
        point = np.linalg.inv(second.T_link_core) @ [*found.point[k], 1.0]
        assert _outside(second.core, point[:3]) < WITNESS


def _outside(core: Core, point: Array) -> float:
    """Distance [m] of a point from a core without its radius, or a lower bound on it."""
    if core.disc_radius:
        half = np.abs(core.points[:, 2]).max()
        return float(max(np.abs(point[2]) - half, np.hypot(*point[:2]) - core.disc_radius))
    return float((core.planes[:, :3] @ point + core.planes[:, 3]).max())


@pytest.mark.parametrize("gap", [1e-9, 1e-6, 1e-3, 0.3, 100.0])
@pytest.mark.parametrize("shift", [0.0, 0.05, 0.1, 0.3])
def test_parallel_faces(gap: float, shift: float) -> None:
    """Boxes above one another; seen from above, they overlap, share an edge line, or are apart."""
    size = np.array([0.1, 0.2, 0.3])
    T = np.eye(4)
    T[:3, 3] = [shift, 0.0, 0.3 + gap]
    geometry = of([Body("low", 0, box(size), np.eye(4))], [Body("high", 0, box(size), T)])
    zero = np.zeros(1, dtype=np.intp)
    found = geometry.witness_points(np.tile(np.eye(4), (1, 2, 1, 1)), zero, zero)
    expected = np.hypot(max(shift - 0.1, 0.0), gap)
    assert found.distance[0] == pytest.approx(expected, abs=SEARCHED)
    if gap >= 1e-3:
        assert found.normal[0] == pytest.approx(
            np.array([max(shift - 0.1, 0.0), 0, gap]) / expected, abs=1e-6
        )


@pytest.mark.parametrize("depth", [1e-3, 0.05])
def test_the_depth_of_overlapping_cores(depth: float) -> None:
    """The radius is subtracted from the depth of the cores, as from their distance."""
    low = Body("low", 0, box(np.array([1.0, 1.0, 1.0])), np.eye(4))
    T = np.eye(4)
    T[:3, 3] = [0.1, 0.2, 1.0 - depth]
    high = Body("high", 0, Core(box_corners(-np.full(3, 0.5), np.full(3, 0.5)), radius=0.01), T)
    geometry = of([low], [high])
    zero = np.zeros(1, dtype=np.intp)
    frames = np.tile(np.eye(4), (1, 2, 1, 1))
    assert np.isnan(geometry._compiled.witness_points(frames, zero, zero)[0])
    found = geometry.witness_points(frames, zero, zero)
    assert found.distance[0] == pytest.approx(-depth - 0.01, abs=1e-8)
    assert found.normal[0] == pytest.approx([0, 0, 1], abs=1e-6)
