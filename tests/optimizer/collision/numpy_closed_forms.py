"""Distances of segments and boxes by numpy, the references of those by the C library."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.vectors import cross

# two cores nearer than this [m] touch: the direction from one to the other is only rounding
TOUCHING = 1e-10
# squared sine of the angle between two segments below which they count as parallel: if they nearly
# touch, the nearest points may then be off by a ten-millionth of their lengths
PARALLEL = 1e-15
# squared length [m²] below which a vector has no direction
NONE = 1e-24


def segment_segment(a: Array, b: Array) -> tuple[Array, Array, Array, Array]:
    """Distance (k,) [m], normal (k, 3) from a to b, and witness points (k, 3) [m] of segments a, b
    (k, 2, 3) [m].

    The point of a that is nearest to the line of b, clamped, then the point of b nearest to it,
    clamped, and the point of a nearest to that: exact, also for parallel segments, but for those
    that are nearly so (see PARALLEL). If the segments cross, the distance is 0 and the normal is
    the common perpendicular.
    """
    # (3, k): numpy runs along k
    a0, a1, b0, b1 = (np.ascontiguousarray(x.T) for x in (a[:, 0], a[:, 1], b[:, 0], b[:, 1]))
    u, v, w = a1 - a0, b1 - b0, a0 - b0
    uu, vv, uv, uw, vw = (_products(x, y) for x, y in ((u, u), (v, v), (u, v), (u, w), (v, w)))
    denominator = uu * vv - uv * uv
    inside = denominator > PARALLEL * uu * vv
    s = np.clip((uv * vw - vv * uw) / np.where(inside, denominator, 1.0) * inside, 0, 1)
    t = np.clip((uv * s + vw) / np.maximum(vv, NONE), 0, 1)
    s = np.clip((uv * t - uw) / np.maximum(uu, NONE), 0, 1)
    p, r = a0 + s * u, b0 + t * v
    across = r - p
    distance = np.sqrt(_products(across, across))
    touching = distance < TOUCHING
    normal = across / np.where(touching, 1.0, distance)
    if touching.any():
        normal[:, touching] = _perpendicular(u.T[touching], v.T[touching]).T
    return distance, normal.T, p.T, r.T


def box_segment(half_size: Array, b: Array) -> tuple[Array, Array, Array]:
    """Signed distance (k,) [m], normal (k, 3) from box to segment, and the witness point (k, 3) [m]
    of the segment.

    half_size (k, 3) [m]: half of the edges of boxes about the origin; b (k, 2, 3) [m]: segments in
    the boxes' frames. The derivative of half the squared distance along the segment is piecewise
    linear and increasing: its root is exact.
    """
    # (3, k): numpy runs along k
    p0, p1, high = (np.ascontiguousarray(x.T) for x in (b[:, 0], b[:, 1], half_size))
    u, low = p1 - p0, -high
    moves = np.abs(u) > 1e-15
    safe = np.where(moves, u, 1.0)
    # where the slope bends
    s = np.zeros((8, len(b)))
    s[1] = 1
    s[2:5], s[5:] = (high - p0) / safe * moves, (low - p0) / safe * moves
    np.clip(s, 0, 1, out=s)
    falls = _slope(p0, u, high, s) < 0
    ends = np.stack([np.where(falls, s, 0.0).max(axis=0), np.where(falls, 1.0, s).min(axis=0)])
    g0, g1 = _slope(p0, u, high, ends)
    crossing = (g0 < 0) & (g1 > 0)
    fraction = np.where(crossing, -g0 / np.where(crossing, g1 - g0, 1.0), 1.0)
    point = p0 + (ends[0] + fraction * (ends[1] - ends[0])) * u
    across = point - np.clip(point, low, high)
    distance = np.sqrt(_products(across, across))
    touching = distance < TOUCHING
    normal, point = (across / np.where(touching, 1.0, distance)).T, point.T
    if touching.any():
        distance[touching], normal[touching], point[touching] = _penetration(
            half_size[touching], b[touching]
        )
    return distance, normal, point


def _slope(p0: Array, u: Array, high: Array, s: Array) -> Array:
    """Derivative (m, k) of half the squared distance of p0 + s u (3, k) from boxes of half sizes
    `high` (3, k), by s (m, k)."""
    slope = np.zeros_like(s)
    for i in range(3):
        x = p0[i] + s * u[i]
        slope += (x - np.clip(x, -high[i], high[i])) * u[i]
    return slope


def _penetration(half_size: Array, b: Array) -> tuple[Array, Array, Array]:
    """The same as `box_segment` for segments that meet the box.

    The candidates for the normal are those of the facets of the box swept along the segment.
    """
    u = b[:, 1] - b[:, 0]
    faces = np.broadcast_to(np.eye(3), (len(b), 3, 3))
    edges = cross(u[:, None], faces)
    length = np.linalg.norm(edges, axis=2, keepdims=True)
    edges = np.where(length > 1e-9, edges / np.maximum(length, 1e-9), faces)
    directions = np.concatenate([faces, edges], axis=1)
    directions = np.concatenate([directions, -directions], axis=1)
    ends = np.einsum("kmi,kei->kme", directions, b)
    depth = ends.min(axis=2) - np.einsum("kmi,ki->km", np.abs(directions), half_size)
    best, rows = depth.argmax(axis=1), np.arange(len(b))
    normal = directions[rows, best]
    point = b[rows, ends[rows, best].argmin(axis=1)]
    # at an edge of the box, the witness point is where segment and edge cross, seen along the
    # normal
    edge = best % 6 - 3
    crossed = edge >= 0
    across = cross(normal[crossed], np.eye(3)[edge[crossed]])
    start, along = b[crossed, 0], u[crossed]
    slope = _dot(along, across)
    fraction = _dot(np.sign(normal[crossed]) * half_size[crossed] - start, across) / np.where(
        slope == 0, 1.0, slope
    )
    point[crossed] = start + np.clip(fraction, 0, 1)[:, None] * along
    return depth[rows, best], normal, point


def _products(x: Array, y: Array) -> Array:
    """Scalar products (k,) of vectors (3, k)."""
    return np.asarray(x[0] * y[0] + x[1] * y[1] + x[2] * y[2])


def _dot(x: Array, y: Array) -> Array:
    return np.asarray(np.einsum("ki,ki->k", x, y))


def _perpendicular(u: Array, v: Array) -> Array:
    """Unit vectors (k, 3) perpendicular to u and v (k, 3); if these are parallel, any vector
    perpendicular to u.
    """
    across = cross(u, v)
    flat = _dot(across, across) < NONE
    across[flat] = cross(u[flat], np.eye(3)[np.argmin(np.abs(u[flat]), axis=1)])
    across[_dot(across, across) < NONE] = np.array([0.0, 0.0, 1.0])
    return np.asarray(across / np.linalg.norm(across, axis=1, keepdims=True))
