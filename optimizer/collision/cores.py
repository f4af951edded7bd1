"""Geometry of shapes for distances: every shape is a convex core grown by a radius.

The core is a point or segment, a box, the two discs of a cylinder, or the hull of a mesh; the
half-space is a separate case. Signed distances are computed between cores, and the radii are
subtracted at the end.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import assert_never

import numpy as np
from scipy.spatial import ConvexHull

from joulepath.models.robot import Array
from joulepath.optimizer.problem.clouds import Points, TriangleMesh, Voxels
from joulepath.optimizer.problem.scene import Box, Capsule, Cylinder, HalfSpace, Mesh, Shape, Sphere

Indices = np.ndarray[tuple[int, ...], np.dtype[np.intp]]


@dataclass(frozen=True)
class Core:
    """Convex hull of `points` (m, 3) [m] in the frame of the shape, with every point widened to a
    disc about z.

    `radius` [m] grows the hull, `disc_radius` [m] is the radius of the discs (0 for points).
    `half_size` (3,) [m], half of the edges, is set for a box. If `is_half_space`, the core is
    instead the half-space below its single point, with z up.
    """

    points: Array
    radius: float = 0.0
    disc_radius: float = 0.0
    half_size: Array | None = None
    is_half_space: bool = False

    @cached_property
    def planes(self) -> Array:
        """Faces (f, 4) of a hull of points: outward normals and offsets [m], with `n · x + d <= 0`
        inside.
        """
        return np.asarray(ConvexHull(self.points).equations)

    @cached_property
    def triangles(self) -> list[list[int]]:
        """Triangles of the hull of the points, with corners counterclockwise as seen from
        outside.
        """
        hull = ConvexHull(self.points)
        corners = self.points[hull.simplices]
        faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        inward = np.einsum("ki,ki->k", faces, hull.equations[:, :3]) < 0
        triangles = hull.simplices.copy()
        triangles[inward] = triangles[inward][:, ::-1]
        result: list[list[int]] = triangles.tolist()
        return result


def core_of(shape: Shape) -> Core:
    """Core of a shape, in the frame of the shape. Obstacles of many parts have no core, see
    `clouds`.
    """
    match shape:
        case Sphere():
            return Core(np.zeros((1, 3)), shape.radius)
        case Capsule():
            return Core(_on_z_axis(shape.length), shape.radius)
        case Cylinder():
            return Core(_on_z_axis(shape.length), disc_radius=shape.radius)
        case Box():
            signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
            return Core(signs * shape.size / 2, half_size=shape.size / 2)
        case HalfSpace():
            return Core(np.zeros((1, 3)), is_half_space=True)
        case Mesh():
            return Core(shape.vertices, shape.radius)
        case Points() | Voxels() | TriangleMesh():
            raise TypeError(f"{type(shape).__name__} is not a convex shape")
        case _:
            assert_never(shape)


def box_corners(low: Array, high: Array) -> Array:
    """Corners (8, 3) [m] of the box between its least and greatest corner."""
    return np.array(np.meshgrid(*np.stack([low, high], axis=1), indexing="ij")).reshape(3, 8).T


def least_height(core: Core, points: Array) -> Array:
    """Lower bounds (k,) [m] on the distances of points (k, 3) [m] from a core, in the frame of the
    core.

    The core is a box, a cylinder or a hull with a volume, and no half-space, point or segment.
    """
    if core.half_size is not None:
        return np.asarray(np.linalg.norm(np.maximum(np.abs(points) - core.half_size, 0.0), axis=1))
    if core.disc_radius:
        half = np.abs(core.points[:, 2]).max()
        outside = np.stack(
            [np.abs(points[:, 2]) - half, np.hypot(points[:, 0], points[:, 1]) - core.disc_radius]
        )
        return np.asarray(np.linalg.norm(np.maximum(outside, 0.0), axis=0))
    return np.asarray(
        np.maximum((points @ core.planes[:, :3].T + core.planes[:, 3]).max(axis=1), 0.0)
    )


def _on_z_axis(length: float) -> Array:
    """Ends (2, 3) of a segment along z about the origin."""
    return np.array([[0.0, 0.0, -length / 2], [0.0, 0.0, length / 2]])
