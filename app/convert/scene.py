"""Conversion of shapes and scenes of requests."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from joulepath.app.convert.fields import decoded, inside
from joulepath.app.convert.mesh_file import mesh_from_file
from joulepath.app.convert.pose import to_base, to_matrix
from joulepath.app.schemas import scene as asked
from joulepath.app.schemas import shapes
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.clouds import Points, Voxels
from joulepath.optimizer.problem.scene import (
    Attachment,
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Mesh,
    Obstacle,
    Scene,
    Shape,
    Sphere,
    capsule_between,
)


def to_scene(scene: asked.Scene, robot: Robot) -> Scene:
    """The scene of the library. Raises InvalidProblem."""
    T_base_frame, obstacles = to_base(scene.frame, robot), list[Obstacle]()
    for k, obstacle in enumerate(scene.obstacles):
        with inside(f"scene.obstacles.{k}"):
            obstacles.append(_to_obstacle(obstacle, T_base_frame))
    return Scene(obstacles)


def to_capsules(tool: asked.Tool) -> list[Attachment]:
    """The capsules of a tool, in the flange frame."""
    return [
        capsule_between(np.array(c.start), np.array(c.end), c.radius, c.touches)
        for c in tool.capsules
    ]


@inside("payload.shape")
def to_attachment(shape: asked.CarriedShape, touches: list[str] | None) -> Attachment:
    """The shape of a payload, fixed to the flange. Raises InvalidProblem."""
    return Attachment(_to_shape(shape), to_matrix(shape.pose), touches)


def _to_obstacle(given: asked.Obstacle, T_base_frame: Array) -> Obstacle:
    return Obstacle(
        given.name, _to_shape(given), T_base_frame @ to_matrix(given.pose), given.margin
    )


def _to_shape(given: asked.CarriedShape | asked.Obstacle) -> Shape:
    if isinstance(given, shapes.Box):
        return Box(np.array(given.size))
    if isinstance(given, shapes.Sphere):
        return Sphere(given.radius)
    if isinstance(given, shapes.Cylinder):
        return Cylinder(given.radius, given.length)
    if isinstance(given, shapes.Capsule):
        return Capsule(given.radius, given.length)
    if isinstance(given, shapes.Mesh):
        return Mesh(np.array(given.vertices))
    if isinstance(given, shapes.Points):
        return Points(np.array(given.points), given.radius)
    if isinstance(given, shapes.Voxels):
        return Voxels(given.size, occupied_cells(given))
    if isinstance(given, shapes.MeshFile):
        return mesh_from_file(given.format, given.data, given.scale)
    return HalfSpace()


def occupied_cells(given: shapes.Voxels) -> npt.NDArray[np.int64]:
    """Occupied cells (n, 3). Raises InvalidProblem with the field."""
    if (given.cells is None) == (given.bits is None):
        raise InvalidProblem("cells", "Give the occupied cells either as `cells` or as `bits`.")
    return np.array(given.cells, dtype=np.int64) if given.bits is None else _from_bits(given.bits)


def _from_bits(bits: shapes.VoxelBits) -> npt.NDArray[np.int64]:
    count = int(np.prod(bits.dimensions))
    if count > shapes.MOST_CELLS:
        raise InvalidProblem(
            "bits.dimensions",
            f"bits.dimensions must make at most {shapes.MOST_CELLS} cells: use larger ones.",
        )
    data = decoded(bits.data, "bits.data")
    if len(data) != -(-count // 8):
        raise InvalidProblem(
            "bits.data",
            f"bits.data holds {len(data)} bytes, but {count} cells need {-(-count // 8)}: one bit "
            "per cell, eight to a byte.",
        )
    numbers = np.flatnonzero(
        np.unpackbits(np.frombuffer(data, dtype=np.uint8), count=count, bitorder="little")
    )
    return np.stack(np.unravel_index(numbers, bits.dimensions, order="F"), axis=1).astype(np.int64)
