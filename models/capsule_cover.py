"""Proof of the cover of surfaces by capsules and hulls, for every point of every triangle.

Capsules and grown hulls are convex: such a body contains a triangle if and only if it contains the
three corners. An uncontained triangle is bisected at its longest edge until every piece lies in a
single body. The proof holds for every point of the surface, without sampling. A corner outside all
bodies is an uncovered point.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from joulepath.models.hull_cover import from_hull
from joulepath.models.robot import Array, LinkCapsule, LinkHull, Mask, Robot

LinkCover = LinkCapsule | LinkHull
SMALLEST = 2e-5
"""Longest edge [m] below which a piece is not bisected further: it lies outside, or where two
of the covers touch."""
TURNS = 8
"""Angles of a joint, evenly distributed, at which neighbouring links are compared."""


def outside(points: Array, covers: Sequence[LinkCover]) -> Array:
    """Signed distances (m, k) [m] of points (k, 3) [m] from m capsules or hulls; negative inside,
    and lower bounds outside of hulls.
    """
    distances = []
    for cover in covers:
        if isinstance(cover, LinkHull):
            distances.append(from_hull(points, cover.points, cover.radius) - cover.radius)
            continue
        begin, along = cover.axis[0], cover.axis[1] - cover.axis[0]
        from_begin = points - begin
        share = np.clip(from_begin @ along / max(float(along @ along), 1e-18), 0.0, 1.0)
        distances.append(np.linalg.norm(from_begin - share[:, None] * along, axis=1) - cover.radius)
    return np.array(distances)


def turned_into(robot: Robot, link: int, other: int, points: Array) -> list[Array]:
    """Transform points from the frame of a link to the frame of the next or previous link.

    Args:
        robot: the robot.
        link: number of the link of the points.
        other: `link + 1` or `link - 1`.
        points: points in the frame of `link`, shape (k, 3) [m].

    Returns:
        Points in the frame of `other`, shape (k, 3) [m], for TURNS angles of the joint in between.
    """
    found, joint = list[Array](), robot.model.jointPlacements[max(link, other)]
    for angle in 2 * np.pi * np.arange(TURNS) / TURNS:
        T = joint * pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, angle), np.zeros(3))
        T = T.inverse() if other > link else T
        found.append(points @ T.rotation.T + T.translation)
    return found


def within_neighbours(robot: Robot, link: int, covers: Sequence[LinkCover], points: Array) -> Mask:
    """Whether points are within the covers of an adjacent link at all TURNS angles of the joint.

    No obstacle can be at such a point.

    Args:
        robot: the robot.
        link: number of the link of the points.
        covers: capsules and hulls of all links.
        points: points in the frame of `link`, shape (k, 3) [m].

    Returns:
        Mask of the points, shape (k,).
    """
    found = np.zeros(len(points), dtype=bool)
    for other in (link - 1, link + 1):
        if own := [each for each in covers if each.link == other > 0]:
            is_within = ~found
            for turned in turned_into(robot, link, other, points):
                is_within[is_within] = (outside(turned[is_within], own) < 0).any(axis=0)
            found |= is_within
    return found


def not_held(triangles: Array, covers: Sequence[LinkCover]) -> Array:
    """Find uncovered pieces of triangles by bisection.

    Args:
        triangles: triangles in the frame of the covers, shape (t, 3, 3 m) [m]. A moving triangle
            has m places, and a single cover must contain all of them.
        covers: capsules and hulls.

    Returns:
        Uncovered pieces, shape (k, 3, 3 m) [m]; empty if the cover is proven. Every piece has a
        corner outside all covers, or its longest edge is below SMALLEST.
    """
    found, pieces = [triangles[:0]], triangles
    while len(pieces):
        corners = outside(pieces.reshape(-1, 3), covers)
        distances = corners.reshape(len(covers), len(pieces), -1)
        is_held = (distances.max(axis=2) <= 0).any(axis=0)
        has_corner_outside = (distances.min(axis=0) > 0).any(axis=1)
        edges = np.linalg.norm(pieces - np.roll(pieces, -1, axis=1), axis=2)
        is_done = ~is_held & (has_corner_outside | (edges.max(axis=1) < SMALLEST))
        found.append(pieces[is_done])
        is_open = ~is_held & ~is_done
        pieces = cut(pieces[is_open], edges[is_open].argmax(axis=1))
    return np.concatenate(found)


def cut(triangles: Array, edge: np.ndarray[tuple[int, ...], np.dtype[np.intp]]) -> Array:
    """Both halves (2 k, 3, m) of triangles (k, 3, m), cut at the middle of edge (k,): 0 joins
    corners 0 and 1.
    """
    rows = np.arange(len(triangles))
    a, b, c = (triangles[rows, (edge + k) % 3] for k in range(3))
    middle = (a + b) / 2
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
