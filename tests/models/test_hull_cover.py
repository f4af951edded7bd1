"""Hulls of links: distances from hulls, the fit around points and meshes, the division of bent
links, and the shipped hulls.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import coal
import numpy as np
import pinocchio as pin
import pytest
from pinocchio.rpy import rpyToMatrix
from scipy.spatial import ConvexHull, cKDTree

from joulepath import load_robot, robot_names
from joulepath.models.capsule_cover import TURNS, not_held, outside, turned_into
from joulepath.models.fit_hulls import fitted_hulls
from joulepath.models.hull_cover import HULL_FIT, from_hull, hull_around
from joulepath.models.hull_parts import PARTS, Rim, below, divided, nowhere
from joulepath.models.meshes import KINDS, link_surfaces, sampled
from joulepath.models.robot import Array, LinkHull, Mask
from tests.mesh_folders import FOUND, meshes
from tests.selection import long_but

ROUNDING = 1e-12  # m; sums of squares of lengths below 1 m
COALS = 1e-9  # m; the tolerance of Coal's search


def points_around(rng: np.random.Generator, count: int) -> Array:
    return rng.normal(size=(count, 3)) * [0.1, 0.06, 0.03]


def test_distances_from_a_cube() -> None:
    """Distances from a face, an edge and a corner, and inside."""
    cube = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, 8).T.astype(float)
    points = np.array([[0.5, 0.4, 1.3], [1.3, 0.2, 1.4], [2, 2, 2], [0.5, 0.4, 0.7], [1, 1, 1]])
    assert from_hull(points, cube) == pytest.approx([0.3, 0.5, np.sqrt(3), -0.3, 0], abs=ROUNDING)
    assert from_hull(np.empty((0, 3)), cube).shape == (0,)


def test_distances_are_coals() -> None:
    rng = np.random.default_rng(4)
    corners, points = points_around(rng, 30), points_around(rng, 400) * 1.5
    hull = ConvexHull(corners)
    vertices, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for corner in corners:
        vertices.append(corner)
    for triangle in hull.simplices.tolist():
        triangles.append(coal.Triangle(*triangle))
    shape, ball = coal.Convex(vertices, triangles), coal.Sphere(0.01)
    request = coal.DistanceRequest(True, True)
    request.gjk_tolerance = COALS / 100
    found = from_hull(points, corners)
    outside = found > 0.011
    assert outside.sum() > 50 and (found < 0).sum() > 50
    for point, distance in zip(points[outside], found[outside], strict=True):
        at = coal.Transform3s(np.eye(3), point)
        theirs = coal.distance(shape, coal.Transform3s(), ball, at, request, coal.DistanceResult())
        assert distance - 0.01 == pytest.approx(theirs, abs=COALS)
    planes = hull.equations
    heights = points @ planes[:, :3].T + planes[:, 3]
    np.testing.assert_array_equal(found < 0, (heights < 0).all(axis=1))


def test_a_fit_covers_and_exceeds_by_no_more_than_its_radius() -> None:
    # a smooth body: the points of a ball, stretched
    around = np.random.default_rng(1).normal(size=(600, 3))
    points = around / np.linalg.norm(around, axis=1)[:, None] * [0.1, 0.06, 0.05]
    chosen = hull_around(points)
    assert 20 < len(chosen) < 120
    assert from_hull(points, chosen).max() <= HULL_FIT.radius
    assert from_hull(chosen, points).max() <= HULL_FIT.digit
    # a body with flat faces and sharp edges needs only its corners
    box = np.array(np.meshgrid([0, 0.1], [0, 0.2], [0, 0.005])).reshape(3, 8).T
    on_faces = np.vstack([box, box.mean(axis=0) + 0.5 * (box - box.mean(axis=0)) * [1, 1, 2]])
    assert len(hull_around(on_faces)) == 8


@pytest.mark.parametrize("along", [[1.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
def test_bodies_with_few_extremes_have_a_hull(along: list[float]) -> None:
    """An octahedron, as it is and stretched along a diagonal."""
    ends = np.vstack([np.eye(3), -np.eye(3)]) * 0.1
    points = ends + np.outer(ends @ along, along) * 3.0
    chosen = hull_around(points)
    assert len(chosen) == 6 and from_hull(points, chosen).max() <= HULL_FIT.radius


def test_a_fit_ends_where_too_many_points_are_needed() -> None:
    around = np.random.default_rng(1).normal(size=(5_000, 3))
    ball = around / np.linalg.norm(around, axis=1)[:, None]
    assert len(hull_around(ball, most=40)) == 41


@pytest.mark.parametrize("extent", [(1, 1, 0), (0, 1, 0), (0, 0, 0), (1, 1, 1e-5), (1, 1e-5, 1e-5)])
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.4, 0.9, -0.3)])
def test_flat_points_have_a_hull_with_a_volume(
    extent: tuple[float, ...], turn: tuple[float, float, float]
) -> None:
    """Like parts of a sheet or a wire, also if they are flat only by rounding."""
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (20, 3)) * extent @ rpyToMatrix(*turn).T
    chosen = hull_around(points)
    assert ConvexHull(chosen).volume > 0
    assert from_hull(points, chosen).max() <= HULL_FIT.radius
    # both sides of the rounded points
    reach = np.sqrt(3) * 1.5 * HULL_FIT.digit
    near = [np.linalg.norm(points - each, axis=1).min() for each in chosen]
    assert max(near) <= reach


LINKS = [(name, link) for name in FOUND for link in range(1, 7)]


@pytest.mark.long
@pytest.mark.parametrize(("name", "link"), long_but(LINKS[:2], LINKS))
def test_the_hull_of_a_link_holds_every_surface(name: str, link: int) -> None:
    """Every triangle of the maker's meshes; 1 mm less, and a surface is outside. A fit repeats the
    figures.
    """
    surfaces = link_surfaces(meshes(name), name, link)
    assert set(surfaces) == set(KINDS)
    robot = load_robot(name)
    hull = robot.hulls[link - 1]
    (fitted,) = fitted_hulls(meshes(name), robot, link)
    np.testing.assert_allclose(hull.points, fitted.points, atol=HULL_FIT.digit / 2)
    for surface in surfaces.values():
        assert not len(not_held(surface, [hull]))
        points = sampled(surface, 5_000, np.random.default_rng(3))
        assert from_hull(points, hull.points).max() <= hull.radius + ROUNDING
    smaller = LinkHull(link, hull.points, hull.radius - 1e-3)
    assert any(len(not_held(surface, [smaller])) for surface in surfaces.values())


@pytest.mark.parametrize("name", [name for name in robot_names() if load_robot(name).hulls])
def test_every_moving_link_has_hulls_without_idle_points(name: str) -> None:
    robot = load_robot(name)
    count = Counter(hull.link for hull in robot.hulls)
    assert list(count) == list(range(1, robot.nq + 1))
    assert max(count.values()) <= PARTS.most
    assert all(len(ConvexHull(hull.points).vertices) == len(hull.points) for hull in robot.hulls)


RADIUS = 1.5e-3  # m; of the hulls
SAMPLED = 1e-3  # m; between points of the surfaces


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Array:
    """Triangles (12, 3, 3) [m]."""
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, 8).T
    return np.asarray(corners[ConvexHull(corners).simplices])


BENT = np.concatenate([box((0, 0, 0), (0.05, 0.015, 0.015)), box((0, 0, 0), (0.015, 0.05, 0.015))])
"""Two arms of 5 cm at a right angle."""


def everywhere(points: Array) -> Mask:
    return np.ones(len(points), dtype=bool)


def area(triangles: Array) -> float:
    sides = triangles[:, 1:] - triangles[:, :1]
    return float(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2)


def excess(hulls: list[LinkHull], triangles: Array) -> Array:
    """Distances (n,) [m] of the outer surface of hulls, before they are grown, from triangles."""
    rng, found = np.random.default_rng(5), []
    for hull in hulls:
        points = sampled(hull.points[ConvexHull(hull.points).simplices], 20_000, rng)
        others = [each for each in hulls if each is not hull]
        found.append(points[(outside(points, others) > 0).all(axis=0)] if others else points)
    return np.asarray(cKDTree(sampled(triangles, 200_000, rng)).query(np.concatenate(found))[0])


def hulls_of(parts: list[Array]) -> list[LinkHull]:
    return [LinkHull(1, hull_around(each.reshape(-1, 3), radius=RADIUS), RADIUS) for each in parts]


def test_both_sides_of_a_plane_are_the_whole_surface() -> None:
    rng = np.random.default_rng(2)
    triangles = rng.normal(size=(200, 3, 3))
    normal = np.array([0.6, 0.0, 0.8])
    sides = below(triangles, normal, 0.3), below(triangles, -normal, -0.3)
    rounding = 1e-12  # of sums of lengths of some units
    assert (sides[0] @ normal).max() <= 0.3 + rounding
    assert (sides[1] @ normal).min() >= 0.3 - rounding
    assert sum(area(each) for each in sides) == pytest.approx(area(triangles))


@pytest.mark.long
def test_two_hulls_hold_a_bent_link_closely() -> None:
    """One hull reaches 16 mm into the bend."""
    parts = divided([BENT], RADIUS, nowhere)
    hulls = hulls_of(parts)
    assert len(hulls) == 2
    assert not len(not_held(BENT, hulls))
    assert excess(hulls, BENT).max() < PARTS.maximum * RADIUS + SAMPLED
    assert excess(hulls_of([BENT]), BENT).max() > 0.016


@pytest.mark.long
def test_more_parts_than_allowed_are_not_made() -> None:
    arms = [BENT, BENT + np.array([0.0, 0.0, 0.035]), box((0, 0, 0), (0.015, 0.015, 0.05))]
    triangles = np.concatenate(arms)
    parts = divided(arms, RADIUS, nowhere, replace(PARTS, most=3))
    assert len(parts) == 3
    assert not len(not_held(triangles, hulls_of(parts)))


def test_what_needs_no_division_is_one_part() -> None:
    """A convex body, and a bent one with a bend out of reach of obstacles."""
    assert len(divided([box((0, 0, 0), (0.05, 0.015, 0.015))], RADIUS, nowhere)) == 1
    assert len(divided([BENT], RADIUS, everywhere)) == 1


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_sectors_leave_the_hollow_of_a_flange_open(side: float) -> None:
    """A rim of 6 mm around a hollow of 30 mm, on either side of the link: one hull fills the
    hollow, and six sectors leave all but the segments beyond their chords.
    """
    turn = 2 * np.pi * np.arange(24) / 24
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros(24)], axis=1)
    profile = [(0.0, 0.0), (0.03, 0.0), (0.03, 0.011), (0.015, 0.011), (0.015, 0.005), (0.0, 0.005)]
    rings = [r * ring + np.array([0.0, 0.0, side * z]) for r, z in profile]
    flange = np.concatenate(
        [
            np.stack(corners, axis=1)
            for low, high in pairwise(rings)
            for corners in (
                (low, np.roll(low, -1, axis=0), high),
                (np.roll(low, -1, axis=0), np.roll(high, -1, axis=0), high),
            )
        ]
    )
    hulls = hulls_of(Rim(side * 0.0052, 6).parts(flange))
    assert len(hulls) == 7
    assert not len(not_held(flange, hulls))
    # within the chords of 60 degrees, and above the floor: by more than the radius of the hulls
    within = np.array([[0.011 * np.cos(t), 0.011 * np.sin(t), side * 0.009] for t in turn])
    assert outside(within, hulls).min() > 0
    assert outside(within, hulls_of([flange])).max() < 0


@pytest.mark.parametrize("name", ["ur5e", "gen3"])
def test_points_are_in_the_frames_of_neighbours_as_in_pinocchios(name: str) -> None:
    robot, points = load_robot(name), np.random.default_rng(3).normal(size=(4, 3))
    for link, other in ((2, 3), (3, 2)):
        found = turned_into(robot, link, other, points)
        assert len(found) == TURNS
        for k, angle in enumerate(2 * np.pi * np.arange(TURNS) / TURNS):
            q, data = np.zeros(robot.nq), robot.model.createData()
            q[max(link, other) - 1] = angle
            pin.forwardKinematics(robot.model, data, q)
            T = data.oMi[other].inverse() * data.oMi[link]
            np.testing.assert_allclose(found[k], points @ T.rotation.T + T.translation, atol=1e-12)
