"""Convex hulls as covers of links: signed distances of points, and the fit of hulls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from joulepath.models.robot import Array
from joulepath.models.uploads.limits import Checkpoint, unwatched

BATCH = 4096
"""Points of one batch, which needs some hundred megabytes at a hundred faces."""
BLOCK = 256
"""Points whose heights above a thousand faces fit into the cache of a processor."""


@dataclass(frozen=True)
class HullFitSettings:
    """Settings of the fit."""

    radius: float = 0.0027
    """Radius by which hulls are grown [m], unless figures have another. The larger it is, the fewer
    points a hull needs, and the farther it reaches beyond the link."""
    digit: float = 1e-4
    """Last digit of the points [m]."""


HULL_FIT = HullFitSettings()


def heights(points: Array, planes: Array) -> Array:
    """Largest heights (k,) [m] of points (k, 3) [m] above planes (f, 4), given by their normals and
    offsets; of the faces of a hull, negative inside.
    """
    found, homogeneous = np.empty(len(points)), np.column_stack([points, np.ones(len(points))])
    for k in range(0, len(points), BLOCK):
        np.max(planes @ homogeneous[k : k + BLOCK].T, axis=0, out=found[k : k + BLOCK])
    return found


def from_hull(points: Array, corners: Array, within: float = np.inf) -> Array:
    """Signed distances of points from a convex hull; negative inside.

    Args:
        points: points, shape (k, 3) [m].
        corners: points with the hull in question, shape (m, 3) [m].
        within: distance up to which the result is exact [m]. Beyond it, the result is a lower bound
            above `within`, which is much cheaper to compute.

    Returns:
        Signed distances, shape (k,) [m]; inside, minus the distance from the nearest face.
    """
    hull = ConvexHull(corners)
    found = heights(points, hull.equations)
    # outside, the height above a face may be less than the distance
    is_open = (found > 0) & (found <= within)
    distinct, which = np.unique(points[is_open], axis=0, return_inverse=True)
    if len(distinct):
        batches = range(0, len(distinct), BATCH)
        exact = [_from_faces(distinct[k : k + BATCH], hull) for k in batches]
        found[is_open] = np.concatenate(exact)[which.ravel()]
    return found


def _from_faces(points: Array, hull: ConvexHull) -> Array:
    """Distances (k,) [m] of points (k, 3) [m] outside a hull."""
    normals, offsets = hull.equations[:, :3], hull.equations[:, 3]
    height = points @ normals.T + offsets
    faces = hull.points[hull.simplices]
    is_above, nearest = height > 0, np.full(len(points), np.inf)
    for k in range(3):
        first, edge = faces[:, k], faces[:, (k + 1) % 3] - faces[:, k]
        from_first = points[:, None] - first
        # the third corner is on the inner side of the edge
        side = np.cross(edge, normals)
        inward = np.sign(((faces[:, (k + 2) % 3] - first) * side).sum(axis=1))
        is_above &= (from_first * (side * inward[:, None])).sum(axis=2) >= 0
        share = np.clip((from_first * edge).sum(axis=2) / (edge * edge).sum(axis=1), 0.0, 1.0)
        across = from_first - share[..., None] * edge
        nearest = np.minimum(nearest, np.linalg.norm(across, axis=2).min(axis=1))
    above_faces = np.where(is_above, height, np.inf).min(axis=1)
    return np.asarray(np.minimum(nearest, above_faces))


def hull_around(
    points: Array,
    most: float = np.inf,
    checkpoint: Checkpoint = unwatched,
    radius: float = HULL_FIT.radius,
) -> Array:
    """Choose few of the given points with a grown hull around all points.

    The algorithm adds the outermost point until the grown hull contains all points.

    Args:
        points: points to contain, shape (k, 3) [m].
        most: number of chosen points at which the search gives up.
        checkpoint: called in every iteration; may raise to interrupt.
        radius: radius by which the hull is grown [m].

    Returns:
        Chosen points, rounded, shape (n, 3) [m]. With n > `most`, the hull is too small. Their hull
        has a volume, even if the given points lie in a plane or on a line.

    Raises:
        ValueError: there are no points.
    """
    points, hull = _with_volume(points)
    points = points[hull.vertices]
    # Rounding moves a point, and with it the hull, by at most half of a cell's diagonal.
    reach = radius - np.sqrt(3) / 2 * HULL_FIT.digit
    chosen = _spanning(points)
    while True:
        checkpoint()
        # The height above a face is never more than the distance, and found much sooner.
        distance = heights(points, ConvexHull(points[chosen]).equations)
        if distance.max() <= reach:
            distance = from_hull(points, points[chosen])
        if distance.max() <= reach or len(chosen) > most:
            rounded = np.round(points[chosen] / HULL_FIT.digit) * HULL_FIT.digit + 0.0
            return _with_volume(rounded)[0]
        chosen.append(int(distance.argmax()))


def _with_volume(points: Array) -> tuple[Array, ConvexHull]:
    """Points (k, 3) [m] whose hull has a volume, and this hull. Flat points are moved by one digit
    to both sides, along as few axes as necessary.
    """
    for axis in np.eye(3)[np.ptp(points, axis=0).argsort()]:
        try:
            return points, ConvexHull(points)
        except QhullError:
            shift = HULL_FIT.digit * axis
            points = np.concatenate([points - shift, points + shift])
    return points, ConvexHull(points)


def _spanning(points: Array) -> list[int]:
    """Indices of four points, chosen one by one at the greatest distance from the point, line or
    plane through the points before.
    """
    chosen, away = [0], points - points[0]
    for _ in range(3):
        chosen.append(int(np.linalg.norm(away, axis=1).argmax()))
        axis = away[chosen[-1]] / np.linalg.norm(away[chosen[-1]])
        away = away - np.outer(away @ axis, axis)
    return chosen
