"""Triangles of the meshes that the capsules of a robot hold, in its link frames.

The meshes are no part of this package: a folder has them as `visual/NAME.obj` and `collision/NAME.obj`, as the package
`airo-models` on PyPI ships those of the maker's description.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin

from models.robot import Array

# what is shown, in detail, and the coarser surfaces that the maker made for collision checking
KINDS = ("visual", "collision")
_QUARTER = np.pi / 2
# for each link its mesh, and the mesh's position [m] and roll, pitch, yaw [rad] in the link frame: the meshes do not
# say where they stand. From github.com/UniversalRobots/Universal_Robots_ROS2_Description
PLACEMENTS: dict[str, dict[str, tuple[str, list[float], list[float]]]] = {
    "ur3e": {
        "base": ("base", [0, 0, 0], [0, 0, np.pi]),
        "shoulder": ("shoulder", [0, 0, 0], [0, 0, np.pi]),
        "upper_arm": ("upperarm", [0, 0, 0.12], [_QUARTER, 0, -_QUARTER]),
        "forearm": ("forearm", [0, 0, 0.027], [_QUARTER, 0, -_QUARTER]),
        "wrist_1": ("wrist1", [0, 0, -0.104], [_QUARTER, 0, 0]),
        "wrist_2": ("wrist2", [0, 0, -0.08535], [0, 0, 0]),
        "wrist_3": ("wrist3", [0, 0, -0.0921], [_QUARTER, 0, 0]),
    },
    "ur5e": {
        "base": ("base", [0, 0, 0], [0, 0, np.pi]),
        "shoulder": ("shoulder", [0, 0, 0], [0, 0, np.pi]),
        "upper_arm": ("upperarm", [0, 0, 0.138], [_QUARTER, 0, -_QUARTER]),
        "forearm": ("forearm", [0, 0, 0.007], [_QUARTER, 0, -_QUARTER]),
        "wrist_1": ("wrist1", [0, 0, -0.127], [_QUARTER, 0, 0]),
        "wrist_2": ("wrist2", [0, 0, -0.0997], [0, 0, 0]),
        "wrist_3": ("wrist3", [0, 0, -0.0989], [_QUARTER, 0, 0]),
    },
}


def link_surfaces(folder: Path, robot: str, link: str) -> dict[str, Array]:
    """Triangles (t, 3, 3) [m] of each of KINDS, in the frame of the link."""
    name, position, rpy = PLACEMENTS[robot][link]
    R = pin.rpy.rpyToMatrix(*rpy)
    return {kind: _triangles(folder / kind / f"{name}.obj") @ R.T + position for kind in KINDS}


def sampled(triangles: Array, count: int, rng: np.random.Generator) -> Array:
    """Points (count, 3) [m], uniformly distributed over the area of triangles (t, 3, 3) [m]."""
    sides = triangles[:, 1:] - triangles[:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    chosen = rng.choice(len(triangles), count, p=area / area.sum())
    shares = rng.uniform(size=(count, 2, 1))
    # the far half of the parallelogram is folded back onto the triangle
    shares = np.where(shares.sum(axis=1, keepdims=True) > 1, 1 - shares, shares)
    return np.asarray(triangles[chosen, 0] + (shares * sides[chosen]).sum(axis=1))


def _triangles(path: Path) -> Array:
    """Triangles (t, 3, 3) of a Wavefront OBJ file; its polygons are cut into fans."""
    vertices, faces = [], []
    for line in path.read_text(encoding="utf-8").splitlines():
        kind, *rest = line.split() or [""]
        if kind == "v":
            vertices.append([float(x) for x in rest[:3]])
        elif kind == "f":
            # numbered from 1; of `vertex/texture/normal` only the first counts
            corners = [int(corner.split("/")[0]) - 1 for corner in rest]
            faces += [[corners[0], *corners[k : k + 2]] for k in range(1, len(corners) - 1)]
    return np.asarray(np.array(vertices)[np.array(faces)])
