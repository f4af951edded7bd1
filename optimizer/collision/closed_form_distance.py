"""Signed distances of segments from segments, boxes and triangles, in closed form for many pairs at
once.

The signed distance of two convex bodies a and b is the maximum over unit vectors n of min n·x over
b - max n·x over a. It is the distance of disjoint bodies, and minus the length of the shortest
separating translation of overlapping bodies. The maximising n is the unit normal, from a to b.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.vectors import cross
from joulepath.optimizer.native.shared_library import address, library


def segment_segment(a: Array, b: Array) -> tuple[Array, Array, Array]:
    """Distance (k,) [m], normal (k, 3) from a to b, and witness points (k, 3) [m] on b, of segments
    a, b (k, 2, 3) [m].

    For crossing segments, the distance is 0 and the normal is the common perpendicular.
    """
    return _library_distances(library.segment_segments, a, b)


def box_segment(half_size: Array, b: Array) -> tuple[Array, Array, Array]:
    """Signed distance (k,) [m], normal (k, 3) from box to segment, and witness point (k, 3) [m] of
    the segment.

    Args:
        half_size: half of the edges (k, 3) [m] of boxes about the origin.
        b: segments (k, 2, 3) [m] in the frames of the boxes.
    """
    return _library_distances(library.box_segments, half_size, b)


def _library_distances(function: Any, first: Array, segments: Array) -> tuple[Array, Array, Array]:
    k = len(segments)
    arguments = (
        np.ascontiguousarray(first, dtype=float),
        np.ascontiguousarray(segments, dtype=float),
    )
    result = np.empty(k), np.empty((k, 3)), np.empty((k, 3))
    function(k, *map(address, (*arguments, *result)))
    return result


def triangle_segment(triangles: Array, b: Array) -> tuple[Array, Array, Array]:
    """Signed distance (k,) [m], normal (k, 3) from triangle to segment, and witness point (k, 3)
    [m] of the segment.

    If triangle and segment do not cross, the nearest points are on an edge, or one of them is an
    end of the segment above the triangle. If they cross, the candidates for the normal are the
    normals of the facets of the triangle swept along the segment.

    Args:
        triangles: corners (k, 3, 3) [m].
        b: segments (k, 2, 3) [m].
    """
    corner, edge = triangles, np.roll(triangles, -1, axis=1) - triangles
    face = cross(edge[:, 0], edge[:, 1])
    face = face / np.maximum(np.linalg.norm(face, axis=1), 1e-300)[:, None]
    edge_witness = [
        segment_segment(np.stack([corner[:, i], corner[:, i] + edge[:, i]], axis=1), b)
        for i in range(3)
    ]
    heights = np.einsum("kei,ki->ke", b - corner[:, :1], face)
    inward = cross(face[:, None], edge)
    above = [
        (np.einsum("kci,kci->kc", b[:, e, None] - corner, inward) >= 0).all(axis=1)
        for e in range(2)
    ]
    distances = np.stack(
        [d for d, _, _ in edge_witness]
        + [np.where(above[e], np.abs(heights[:, e]), np.inf) for e in range(2)]
    )
    up = [np.where(heights[:, e, None] >= 0, face, -face) for e in range(2)]
    normals = np.stack([n for _, n, _ in edge_witness] + up)
    points = np.stack([r for _, _, r in edge_witness] + [b[:, 0], b[:, 1]])
    best, rows = distances.argmin(axis=0), np.arange(len(b))
    distance, normal, point = distances[best, rows], normals[best, rows], points[best, rows]
    along = b[:, 1] - b[:, 0]
    drop = heights[:, 0] - heights[:, 1]
    opposite = heights[:, 0] * heights[:, 1] < 0
    fraction = np.clip(heights[:, 0] / np.where(drop == 0, 1.0, drop), 0.0, 1.0)
    crossing = b[:, 0] + fraction[:, None] * along
    inside = np.einsum("kci,kci->kc", crossing[:, None] - corner, inward) >= 0
    crossed = opposite & inside.all(axis=1)
    if crossed.any():
        on_edges = points[:3, crossed]
        distance[crossed], normal[crossed], point[crossed] = _crossing(
            triangles[crossed], edge[crossed], face[crossed], b[crossed], on_edges
        )
    return distance, normal, point


def _crossing(
    triangles: Array,
    edge: Array,
    face: Array,
    b: Array,
    on_edges: Array,
    smallest: float = 1e-24,
) -> tuple[Array, Array, Array]:
    """Distances, normals and witness points as of `triangle_segment`, for segments that cross the
    triangle.

    Args:
        triangles: corners (k, 3, 3) [m].
        edge: edge vectors (k, 3, 3) [m].
        face: unit normals of the triangles (k, 3).
        b: segments (k, 2, 3) [m].
        on_edges: points (3, k, 3) [m] of the segments nearest to the edges.
        smallest: length [m²] below which a cross product has no direction.
    """
    sideways = cross(edge, (b[:, 1] - b[:, 0])[:, None])
    length = np.linalg.norm(sideways, axis=2, keepdims=True)
    sideways = np.where(length > smallest, sideways / np.maximum(length, smallest), face[:, None])
    directions = np.concatenate([face[:, None], sideways], axis=1)
    directions = np.concatenate([directions, -directions], axis=1)
    ends = np.einsum("kmi,kei->kme", directions, b)
    depth = ends.min(axis=2) - np.einsum("kmi,kci->kmc", directions, triangles).max(axis=2)
    best, rows = depth.argmax(axis=1), np.arange(len(b))
    lowest = b[rows, ends[rows, best].argmin(axis=1)]
    point = np.concatenate([lowest[None], on_edges])[best % 4, rows]
    return depth[rows, best], directions[rows, best], point
