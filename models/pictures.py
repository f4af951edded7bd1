"""A robot as it looks: the meshes of its maker, simplified, as one GLB file with a node for each
link.

The nodes are named as the links and stand in the link frames [m]: who draws the file moves each to
where its link is. Simplification needs the package `fast-simplification`, which is optional, as the
meshes are.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from scipy.spatial import cKDTree

from joulepath.models.meshes import installed, mesh_file, mesh_placement
from joulepath.models.registry import load_robot
from joulepath.models.robot import Array

if TYPE_CHECKING:
    from trimesh import Trimesh

KIND = "visual"
# of a whole arm; edges of its parts are kept, so that more are left
FACES = 22_000
# parts with fewer faces stay as they are
_SMALL = 100
# edges that are sharper stay sharp in the light [rad]
_CREASE = np.radians(35)
# positions are rounded to these shares of a metre, 0.06 mm, and normals to those of their length:
# they compress better
_STEPS, _NORMAL_STEPS = 1 << 14, 1 << 5


def picture_sources(robot: str) -> list[Path] | None:
    """Files that a robot's picture is made of, base first. None if they, or what simplifies them,
    are not installed.
    """
    folder = installed(robot)
    if folder is None or find_spec("fast_simplification") is None:
        return None
    return [mesh_file(folder, KIND, link) for link in range(len(_links(robot)))]


def picture(robot: str) -> bytes:
    """The GLB file of a robot that has `picture_sources`, with normals and colours. Takes about a
    second.
    """
    import trimesh  # most processes never need it

    sources = picture_sources(robot)
    assert sources is not None
    links = [_parts(path) for path in sources]
    share = FACES / sum(len(part.faces) for parts in links for part, _ in parts)
    scene = trimesh.Scene()
    for link, (name, parts) in enumerate(zip(_links(robot), links, strict=True)):
        mesh = _merged(
            [(_simplified(part, share), colour) for part, colour in parts],
            mesh_placement(robot, link),
        )
        scene.add_geometry(mesh, node_name=name, geom_name=name)
    return bytes(scene.export(file_type="glb", include_normals=True))  # type: ignore[no-untyped-call]


def _links(robot: str) -> list[str]:
    return ["base", *load_robot(robot).figures["kinematics"]["link_names"]["value"]]


def _parts(path: Path) -> list[tuple[Trimesh, Array]]:
    """A mesh file by its materials: each part and its colour, red, green, blue and opacity from 0
    to 255.
    """
    import trimesh

    parts = []
    for given in trimesh.load_scene(path, process=False).geometry.values():
        part = trimesh.Trimesh(given.vertices, given.faces, process=False)
        # corners of neighbours are one, so that the surface stays closed
        part.merge_vertices(digits_vertex=6)
        parts.append((part, given.visual.material.main_color))
    return parts


def _simplified(part: Trimesh, share: float) -> Trimesh:
    """A part with about this share of its faces. All its corners are corners of the part: capsules
    hold it, too.
    """
    if len(part.faces) <= _SMALL:
        return part
    simple = part.simplify_quadric_decimation(percent=1 - share)
    simple.vertices = part.vertices[cKDTree(part.vertices).query(simple.vertices)[1]]
    simple.merge_vertices()
    simple.update_faces(simple.nondegenerate_faces())
    return simple


def _merged(parts: list[tuple[Trimesh, Array]], T: pin.SE3) -> Trimesh:
    """One mesh, moved by T. On both sides of a sharp edge it has corners of its own."""
    import trimesh

    shaded = [trimesh.graph.smooth_shade(part, angle=_CREASE) for part, _ in parts]
    colours = [
        np.tile(colour, (len(part.vertices), 1))
        for part, (_, colour) in zip(shaded, parts, strict=True)
    ]
    mesh = trimesh.util.concatenate(shaded)
    assert isinstance(mesh, trimesh.Trimesh)
    mesh.apply_transform(T.homogeneous)
    # where a surface folds, the normals of its faces may cancel
    normals = mesh.vertex_normals.copy()
    folded = np.linalg.norm(normals, axis=1) < 0.5
    normals[folded] = mesh.face_normals[mesh.vertex_faces[folded, 0]]
    return trimesh.Trimesh(
        vertices=np.round(mesh.vertices * _STEPS) / _STEPS,
        faces=mesh.faces,
        vertex_normals=np.round(normals * _NORMAL_STEPS) / _NORMAL_STEPS,
        vertex_colors=np.concatenate(colours),
        process=False,
    )
