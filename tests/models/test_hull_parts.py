"""Bent surfaces, divided into parts with a hull each; and points in neighbours' frames."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial import ConvexHull, cKDTree

from joulepath.models.capsule_cover import TURNS, not_held, outside, turned_into
from joulepath.models.hull_cover import hull_around
from joulepath.models.hull_parts import PARTS, Rim, below, divided, nowhere
from joulepath.models.meshes import sampled
from joulepath.models.registry import load_robot
from joulepath.models.robot import Array, LinkHull, Mask

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
    """A convex body, and a bent one where no obstacle can be."""
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
