"""Obstacles of many parts: point clouds, voxel grids and triangle meshes. Validated on
construction.

An obstacle is the union of its parts. Nothing is simplified: collision checking and the certificate
use every part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.models.shape_sizes import SIZES, check_extent
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arrays import check_size, frozen, sized


@dataclass(frozen=True)
class CloudRanges:
    """Ranges of obstacles of many parts."""

    max_points: int = 100_000
    """Most points of an obstacle: the limits bound memory and time of a request."""
    max_voxels: int = 100_000
    """Most occupied voxels of an obstacle."""
    max_triangles: int = 100_000
    """Most triangles of an obstacle."""
    max_parts_in_scene: int = 200_000
    """Most points, voxels and triangles of all obstacles of a scene together."""
    max_along_edge: int = 4096
    """Greatest number of voxels along an edge of a grid."""
    flat_triangle: float = 1e-9
    """Least height of a triangle relative to its longest edge [1]; flatter triangles are left out,
    since their edges belong to their neighbours.
    """


CLOUD_RANGES = CloudRanges()


Whole = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Points:
    """Balls about points.

    Attributes:
        points: centres, shape (n, 3) [m].
        radius: radius [m].

    Raises:
        InvalidProblem: a value is malformed; names the field.
    """

    points: Array
    radius: float

    def __post_init__(self) -> None:
        points = frozen(self.points, (-1, 3), "points")
        _count(
            "points",
            len(points),
            CLOUD_RANGES.max_points,
            "points: thin the cloud out, for example to one point per voxel",
        )
        _within_reach("points", points)
        check_size("radius", self.radius)
        object.__setattr__(self, "points", points)


@dataclass(frozen=True, eq=False)
class Voxels:
    """Cubes of a grid.

    Attributes:
        size: edge of a cube [m].
        cells: cells (i, j, k) from (i, j, k) · size to (i + 1, j + 1, k + 1) · size, shape (n, 3);
            repeated cells count once.

    Raises:
        InvalidProblem: a value is malformed; names the field.
    """

    size: float
    cells: Whole

    def __post_init__(self) -> None:
        check_size("size", self.size)
        given = np.unique(frozen(self.cells, (-1, 3), "cells"), axis=0)
        _count("cells", len(given), CLOUD_RANGES.max_voxels, "occupied cells: use larger voxels")
        most = CLOUD_RANGES.max_along_edge
        if (np.abs(given) > most).any() or (given % 1 != 0).any():
            raise InvalidProblem(
                "cells", f"cells must be integers within {most} cells of the origin."
            )
        _within_reach("cells", given * self.size)
        cells = given.astype(np.int64)
        cells.flags.writeable = False
        object.__setattr__(self, "cells", cells)


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Triangles of any form; no convexity is needed.

    The inside of a closed mesh counts as solid; in a closed mesh every edge belongs to two
    triangles in opposite directions. Otherwise the mesh is a surface. Triangles without an area are
    left out.

    Attributes:
        corners: corners of all triangles, shape (n, 3, 3) [m].

    Raises:
        InvalidProblem: a value is malformed; names the field.
    """

    corners: Array

    def __post_init__(self) -> None:
        corners = frozen(self.corners, (-1, 3, 3), "data")
        _count("data", len(corners), CLOUD_RANGES.max_triangles, "triangles: simplify the mesh")
        _within_reach("data", corners)
        sized("data", lambda: check_extent("data", corners.reshape(-1, 3)))
        edges = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max(axis=1)
        double_area = np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        kept = double_area > CLOUD_RANGES.flat_triangle * edges**2
        if not kept.any():
            raise InvalidProblem(
                "data", "data has no triangle with an area: give a mesh with a surface."
            )
        object.__setattr__(self, "corners", frozen(corners[kept], (-1, 3, 3), "data"))

    @property
    def is_closed(self) -> bool:
        """Whether every edge belongs to exactly two triangles with opposite directions.

        Corners are compared exactly; a mesh with rounding differences is not closed.
        """
        _, corner = np.unique(self.corners.reshape(-1, 3), axis=0, return_inverse=True)
        first = corner.reshape(-1, 3)
        edges = np.stack([first, first[:, [1, 2, 0]]], axis=2).reshape(-1, 2)
        directed, times = np.unique(edges, axis=0, return_counts=True)
        if (times > 1).any():
            return False
        back = np.unique(directed[:, ::-1], axis=0)
        return bool(np.array_equal(directed, back))


Cloud = Points | Voxels | TriangleMesh


def parts_of(shape: Cloud) -> int:
    """Number of parts of an obstacle."""
    match shape:
        case Points():
            return len(shape.points)
        case Voxels():
            return len(shape.cells)
        case TriangleMesh():
            return len(shape.corners)


def _count(field: str, count: int, most: int, remedy: str) -> None:
    if count == 0:
        raise InvalidProblem(
            field, f"{field} is empty: give at least one part, or leave the obstacle out."
        )
    if count > most:
        raise InvalidProblem(field, f"{field} must have at most {most} {remedy}.")


def _within_reach(field: str, points: Array) -> None:
    if np.abs(points).max() > SIZES.largest:
        raise InvalidProblem(
            field, f"{field} must lie within {SIZES.largest:g} m of the origin of the pose."
        )
