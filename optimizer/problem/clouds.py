"""Obstacles of many parts: point clouds, voxel grids and triangle meshes, validated on
construction.

Each is the union of its parts. Nothing is simplified: collision checking and the certificate use
every part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.models.shape_sizes import SIZES, check_extent
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arrays import check_sizes, frozen, sized

# most points, occupied voxels and triangles of an obstacle, and of all obstacles of a scene
# together: they bound the memory and the time of a request
MOST_POINTS = MOST_VOXELS = MOST_TRIANGLES = 100_000
MOST_PARTS_IN_SCENE = 200_000
# greatest number of voxels along an edge of a grid
MOST_ALONG_EDGE = 4096
# least height of a triangle over its longest edge, relative to that edge: flatter ones are left
# out. Their edges belong to their neighbours
FLAT_TRIANGLE = 1e-9

Whole = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Points:
    """Balls of `radius` [m] about `points` (n, 3) [m]. Raises InvalidProblem, with the field
    named."""

    points: Array
    radius: float

    def __post_init__(self) -> None:
        points = frozen(self.points, (-1, 3), "points")
        _count(
            "points",
            len(points),
            MOST_POINTS,
            "points: thin the cloud out, for example to one point per voxel",
        )
        _within_reach("points", points)
        check_sizes("radius", self.radius)
        object.__setattr__(self, "points", points)


@dataclass(frozen=True, eq=False)
class Voxels:
    """Cubes with edges of `size` [m]: of the cell (i, j, k) of `cells` (n, 3), from (i, j, k) ·
    size to one size more.

    Cells that are named twice count once. Raises InvalidProblem, with the field named.
    """

    size: float
    cells: Whole

    def __post_init__(self) -> None:
        check_sizes("size", self.size)
        cells = np.unique(np.array(self.cells, dtype=np.int64).reshape(-1, 3), axis=0)
        _count("cells", len(cells), MOST_VOXELS, "occupied cells: use larger voxels")
        if np.abs(cells).max() > MOST_ALONG_EDGE:
            raise InvalidProblem(
                "cells", f"cells must lie within {MOST_ALONG_EDGE} cells of the origin."
            )
        _within_reach("cells", np.asarray(cells * self.size, dtype=float))
        cells.flags.writeable = False
        object.__setattr__(self, "cells", cells)


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """The triangles with corners `corners` (n, 3, 3) [m], of any form: no convexity is asked for.

    If the mesh is closed (every edge belongs to two triangles of opposite directions), its inside
    counts as solid; otherwise it is a surface. Triangles without an area are left out. Raises
    InvalidProblem, with the field named.
    """

    corners: Array

    def __post_init__(self) -> None:
        corners = frozen(self.corners, (-1, 3, 3), "data")
        _count("data", len(corners), MOST_TRIANGLES, "triangles: simplify the mesh")
        _within_reach("data", corners)
        sized("data", lambda: check_extent("data", corners.reshape(-1, 3)))
        edges = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max(axis=1)
        double_area = np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        kept = double_area > FLAT_TRIANGLE * edges**2
        if not kept.any():
            raise InvalidProblem(
                "data", "data has no triangle with an area: give a mesh with a surface."
            )
        object.__setattr__(self, "corners", frozen(corners[kept], (-1, 3, 3), "data"))

    @property
    def is_closed(self) -> bool:
        """Whether every edge belongs to exactly two triangles, which run along it in opposite
        directions.

        Corners are compared exactly. If they differ by rounding, the mesh is not closed.
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
