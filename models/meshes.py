"""Triangles of the meshes covered by the capsules of a robot, in link frames.

The meshes are not part of this package. A folder contains them as the maker's repository does, each
as OBJ, STL or COLLADA. For arms of Universal Robots, these are the folders of the package
`airo-models` on PyPI, or meshes/ur10e in
github.com/UniversalRobots/Universal_Robots_ROS2_Description, and for the others those of
MESH_FILES.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

from joulepath.models.robot import Array
from joulepath.models.uploads.collada import collada_corners
from joulepath.models.uploads.limits import unwatched
from joulepath.models.uploads.mesh import read_mesh
from joulepath.models.uploads.mesh_text import MeshSize

_FILE_KINDS = ("obj", "stl", "dae")
# detailed surfaces for display, and the maker's coarser surfaces for collision checks
KINDS = ("visual", "collision")
# shifts [m] of the meshes of upper arm, forearm and wrists along the joint axis, the only
# difference between these arms; from github.com/UniversalRobots/Universal_Robots_ROS2_Description
SHIFTS = {
    "ur3e": (0.12, 0.027, -0.104, -0.08535, -0.0921),
    "ur5e": (0.138, 0.007, -0.127, -0.0997, -0.0989),
    "ur10e": (0.1762, 0.0393, -0.135, -0.12, -0.1168),
    "ur16e": (0.176, 0.04, -0.135, -0.12, -0.1168),
}
# the files of the links of the other arms, base first, in these folders:
# meshes/robot_arms/fer in github.com/frankaemika/franka_description,
# iiwa_description/meshes/iiwa14 in github.com/RobotLocomotion/models,
# kuka_agilus_support/meshes/kr10_r1100_2 in github.com/kroshu/kuka_robot_descriptions,
# xarm_description/meshes/xarm7 in github.com/xArm-Developer/xarm_ros2, and
# kortex_description/arms/gen3/7dof/meshes in github.com/Kinovarobotics/ros2_kortex
MESH_FILES: dict[str, list[tuple[str, ...]]] = {
    "panda": [(f"visual/link{k}", f"collision/link{k}") for k in range(8)],
    "iiwa14": [(f"collision/link_{k}",) for k in range(8)],
    "kr10_r1100": [(f"collision/{k}",) for k in ("base_link", *(f"link_{k}" for k in range(1, 7)))],
    "xarm7": [(f"visual/link{k}",) for k in ("_base", *range(1, 8))],
    "gen3": [
        (name,)
        for name in (
            "base_link",
            "shoulder_link",
            "half_arm_1_link",
            "half_arm_2_link",
            "forearm_link",
            "spherical_wrist_1_link",
            "spherical_wrist_2_link",
            "bracelet_no_vision_link",
        )
    ],
}
# x, y, z [m] and roll, pitch, yaw [rad] of the meshes in the link frames, base first, from
# kuka_agilus_support/urdf/kr10_r1100_2_macro.xacro; the meshes of the other arms of MESH_FILES are
# in these frames
_PLACED = {
    "kr10_r1100": (
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.208, np.pi, 0.0, 0.0),
        (-0.4, -0.025, -0.0907, np.pi / 2, 0.0, np.pi / 2),
        (-0.025, 0.96, -0.0865, np.pi / 2, 0.0, 0.0),
        (-0.985, 0.0, 0.221, 0.0, np.pi / 2, 0.0),
        (-0.54, 0.985, -0.0505, np.pi / 2, 0.0, 0.0),
        (-0.985, 0.0, 0.6015, 0.0, np.pi / 2, 0.0),
    )
}
# files of the links, base first, and roll, pitch, yaw [rad] of the meshes in the link frames
_ALONG = (np.pi / 2, 0.0, -np.pi / 2)
_UPRIGHT = (np.pi / 2, 0.0, 0.0)
_FILES = ("base", "shoulder", "upperarm", "forearm", "wrist1", "wrist2", "wrist3")
_TURNS = ((0.0, 0.0, np.pi), (0.0, 0.0, np.pi), _ALONG, _ALONG, _UPRIGHT, (0.0, 0.0, 0.0), _UPRIGHT)


def installed(robot: str) -> Path | None:
    """The folder of a robot's meshes in the package `airo-models`; None without the package."""
    return in_package("arms", robot) if robot in SHIFTS else None


def in_package(*names: str) -> Path | None:
    """A folder in the package `airo-models`, by the names that lead to it; None if missing."""
    package = find_spec("airo_models")
    if package is None or package.origin is None:
        return None
    folder = Path(package.origin).parent.joinpath(*names)
    return folder if folder.is_dir() else None


def mesh_file(folder: Path, kind: str, link: int) -> Path:
    """The file of a link's mesh, of one of KINDS."""
    return folder / kind / f"{_FILES[link]}.obj"


def mesh_placement(robot: str, link: int) -> pin.SE3:
    """Pose of the mesh of a link in the link frame. `robot` is one of SHIFTS."""
    position = np.array([0.0, 0.0, (0.0, 0.0, *SHIFTS[robot])[link]])
    return pin.SE3(pin.rpy.rpyToMatrix(*_TURNS[link]), position)


def link_surfaces(folder: Path, robot: str, link: int) -> dict[str, Array]:
    """Triangles (t, 3, 3) [m] of each mesh of a link, in its frame, by kind or file; of a COLLADA
    file, the triangles of its convex hull. `robot` is one of SHIFTS or MESH_FILES.
    """
    if robot in SHIFTS:
        T = mesh_placement(robot, link)
        found = {kind: surface(folder / kind / _FILES[link]) for kind in KINDS}
    else:
        row = _PLACED[robot][link] if robot in _PLACED else (0.0,) * 6
        T = pin.SE3(pin.rpy.rpyToMatrix(*row[3:]), np.array(row[:3]))
        found = {file: surface(folder / file) for file in MESH_FILES[robot][link]}
    return {kind: each @ T.rotation.T + T.translation for kind, each in found.items()}


def sampled(triangles: Array, count: int, rng: np.random.Generator) -> Array:
    """Points (count, 3) [m], uniformly distributed over the area of triangles (t, 3, 3) [m].

    Raises:
        ValueError: the triangles have no area.
    """
    sides = triangles[:, 1:] - triangles[:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    if not area.sum() > 0:
        raise ValueError("The triangles have no area.")
    chosen = rng.choice(len(triangles), count, p=area / area.sum())
    shares = rng.uniform(size=(count, 2, 1))
    # Fold the far half of the parallelogram back onto the triangle.
    shares = np.where(shares.sum(axis=1, keepdims=True) > 1, 1 - shares, shares)
    return np.asarray(triangles[chosen, 0] + (shares * sides[chosen]).sum(axis=1))


def surface(stem: Path) -> Array:
    """Triangles (t, 3, 3) of the mesh file with this path, whatever its suffix is; of a COLLADA
    file, those of its convex hull.
    """
    for kind in _FILE_KINDS:
        for suffix in (f".{kind}", f".{kind.upper()}"):
            if (path := stem.with_suffix(suffix)).is_file():
                return _triangles(kind, path.read_bytes())
    raise FileNotFoundError(f"no mesh {stem} as {', '.join(_FILE_KINDS)}")


def _triangles(kind: str, content: bytes) -> Array:
    if kind == "dae":
        corners = collada_corners(content, MeshSize(), unwatched)
        return np.asarray(corners[ConvexHull(corners).simplices])
    corners, triangles = read_mesh(kind, content, MeshSize())
    return np.asarray(corners[triangles])
