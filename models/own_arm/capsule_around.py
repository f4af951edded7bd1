"""The smallest capsule around points.

A capsule is convex: if it contains the vertices of a mesh, it contains the whole mesh.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.spatial import ConvexHull, QhullError

from joulepath.models.capsule_cover import outside
from joulepath.models.robot import Array, LinkCapsule
from joulepath.models.shape_sizes import SIZES
from joulepath.models.uploads.limits import Checkpoint, unwatched


@dataclass(frozen=True)
class CapsuleSearch:
    """Settings of the search for the ends of the axis."""

    digit: float = 1e-5
    """Last digit of the ends and of the radius, which is rounded up [m]."""
    hull_points: int = 100_000
    """Most points of one convex hull, which takes about a second if all of them are vertices."""
    steps: int = 1500
    """Most steps."""
    tolerance: float = 1e-5
    """Change of an end [m] at which the search stops."""


SEARCH = CapsuleSearch()


def capsule_around(points: Array, checkpoint: Checkpoint = unwatched) -> tuple[Array, float]:
    """Ends (2, 3) [m] of the axis and radius [m] of a small capsule around points (n, 3) [m].

    Direct searches from the three principal axes minimise the volume. The radius is exact, but at
    least `SIZES.smallest`.
    """
    points = outermost(points, checkpoint)
    centre = points.mean(axis=0)
    found = []
    for direction in np.linalg.svd(points - centre, full_matrices=False)[2]:
        along = (points - centre) @ direction
        radius = float(np.linalg.norm(points - centre - along[:, None] * direction, axis=1).max())
        middle, half = (
            (along.max() + along.min()) / 2,
            max((along.max() - along.min()) / 2 - radius, 0.0),
        )
        start = np.concatenate([centre + (middle + side * half) * direction for side in (-1, 1)])
        found.append(
            minimize(
                _volume,
                start,
                (points, checkpoint),
                "Nelder-Mead",
                options={"maxiter": SEARCH.steps, "xatol": SEARCH.tolerance},
            )
        )
    axis = (
        np.round(min(found, key=lambda each: float(each.fun)).x.reshape(2, 3) / SEARCH.digit)
        * SEARCH.digit
        + 0.0
    )
    radius = max(_reach(axis, points), SIZES.smallest)
    return axis, float(np.ceil(radius / SEARCH.digit) * SEARCH.digit)


def outermost(points: Array, checkpoint: Checkpoint) -> Array:
    """Vertices of the convex hull; all points if they are flat.

    Very many points are divided into parts, whose hulls are united.
    """
    parts = np.array_split(points, -(-len(points) // SEARCH.hull_points))
    if len(parts) > 1:
        points = np.concatenate([outermost(part, checkpoint) for part in parts])
    checkpoint()
    try:
        return (
            np.asarray(points[ConvexHull(points).vertices])
            if len(points) <= SEARCH.hull_points
            else points
        )
    except (QhullError, ValueError):
        return points


def _volume(x: Array, points: Array, checkpoint: Checkpoint) -> float:
    """Volume [m³] of the capsule with axis ends x (6,) around all points."""
    checkpoint()
    axis = x.reshape(2, 3)
    radius = _reach(axis, points)
    return float(np.pi * radius**2 * (np.linalg.norm(axis[1] - axis[0]) + 4 / 3 * radius))


def _reach(axis: Array, points: Array) -> float:
    """Greatest distance [m] of points (n, 3) from a segment (2, 3)."""
    return float(outside(points, [LinkCapsule(0, axis, 0.0)]).max())
