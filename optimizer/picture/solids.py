"""Bodies of the collision model as solids: their corners, and the faces of their hulls."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Body
from joulepath.optimizer.picture.view import PictureSettings


def corners(body: Body, T: Array) -> Array:
    """Points (n, 3) [m] whose hull, grown by the body's radius, is the body."""
    core = body.core
    points = core.points
    if core.disc_radius:
        angle = np.linspace(0.0, 2 * np.pi, PictureSettings.discs, endpoint=False)
        disc = core.disc_radius * np.stack(
            [np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1
        )
        points = (points[:, None] + disc).reshape(-1, 3)
    return np.asarray(points @ T[:3, :3].T + T[:3, 3])


def extent(body: Body, T: Array) -> Array:
    """Points (n, 3) [m] around the body, its radius included."""
    directions = 1.2 * body.core.radius * np.concatenate([np.eye(3), -np.eye(3)])
    return np.asarray((corners(body, T)[:, None] + directions).reshape(-1, 3))


def faces(points: Array) -> Iterator[tuple[Array, Array]]:
    """The flat faces of a hull: their corners (m, 3) in order, and outward normals (3,)."""
    try:
        hull = ConvexHull(points)
    except QhullError:
        # a plate without a thickness
        middle = points.mean(axis=0)
        normal = np.linalg.svd(points - middle)[2][-1]
        yield _around(points, normal), normal
        yield _around(points, -normal), -normal
        return
    planes = np.round(hull.equations, 6)
    for plane in np.unique(planes, axis=0):
        corners = np.unique(hull.simplices[(planes == plane).all(axis=1)])
        yield _around(points[corners], plane[:3]), plane[:3]


def _around(points: Array, normal: Array) -> Array:
    """Points of a plane in order around their middle."""
    off = points - points.mean(axis=0)
    first = off[int(np.argmax((off**2).sum(axis=1)))]
    angle = np.arctan2(off @ np.cross(normal, first), off @ first)
    return np.asarray(points[np.argsort(angle)])
