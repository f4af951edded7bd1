"""The smallest capsule around points: it is convex, so that it holds the hull of a mesh if it holds
its vertices.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize
from scipy.spatial import ConvexHull, QhullError

from joulepath.models.capsule_cover import outside
from joulepath.models.robot import Array, LinkCapsule
from joulepath.models.uploads.limits import Checkpoint, unwatched

# m: places of the ends are rounded to this, the radius up to it
DIGIT = 1e-5
# most points of which a hull is computed at a time, about a second if all are its corners
HULL = 100_000
# of the search for the ends: steps, and the change of an end [m] at which it stops
STEPS, CONVERGED = 1500, 1e-5


def capsule_around(points: Array, checkpoint: Checkpoint = unwatched) -> tuple[Array, float]:
    """Ends (2, 3) [m] of the axis and radius [m] of a small capsule that holds points (n, 3) [m].

    Its volume is least as far as a direct search from each principal axis finds. The radius is
    exact.
    """
    points = _outermost(points, checkpoint)
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
                options={"maxiter": STEPS, "xatol": CONVERGED},
            )
        )
    axis = (
        np.round(min(found, key=lambda each: float(each.fun)).x.reshape(2, 3) / DIGIT) * DIGIT + 0.0
    )
    return axis, float(np.ceil(_reach(axis, points) / DIGIT) * DIGIT)


def _outermost(points: Array, checkpoint: Checkpoint) -> Array:
    """The corners of the hull, or all points if they are flat. Of very many points some more: those
    of parts' hulls.
    """
    parts = np.array_split(points, -(-len(points) // HULL))
    if len(parts) > 1:
        points = np.concatenate([_outermost(part, checkpoint) for part in parts])
    checkpoint()
    try:
        return np.asarray(points[ConvexHull(points).vertices]) if len(points) <= HULL else points
    except (QhullError, ValueError):
        return points


def _volume(x: Array, points: Array, checkpoint: Checkpoint) -> float:
    """Volume [m³] of the capsule with ends x (6,) that reaches all points."""
    checkpoint()
    axis = x.reshape(2, 3)
    radius = _reach(axis, points)
    return float(np.pi * radius**2 * (np.linalg.norm(axis[1] - axis[0]) + 4 / 3 * radius))


def _reach(axis: Array, points: Array) -> float:
    """Greatest distance [m] of points (n, 3) from a segment (2, 3)."""
    return float(outside(points, [LinkCapsule(0, axis, 0.0)]).max())
