"""Simplified meshes of a robot as one GLB file with a node per link.

Nodes have the names of the links and coordinates in link frames [m], so that a viewer can place
them. Meshes and the package `fast-simplification` are optional.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from scipy.spatial import cKDTree

from joulepath.models.meshes import installed, mesh_file, mesh_placement
from joulepath.models.registry import bundled_robot
from joulepath.models.robot import Array

if TYPE_CHECKING:
    from trimesh import Trimesh

KIND = "visual"


@dataclass(frozen=True)
class PictureSettings:
    """Settings of the simplification."""

    faces: int = 22_000
    """Desired faces of a whole arm; more remain, since edges of parts are kept."""
    small: int = 100
    """Faces below which a part is not simplified."""
    crease: float = math.radians(35)
    """Least angle of an edge with sharp shading [rad]."""
    steps: int = 1 << 14
    """Steps per metre of rounded positions (0.06 mm), for better compression."""
    normal_steps: int = 1 << 5
    """Steps of rounded components of normals, for the same reason."""


PICTURE = PictureSettings()


def picture_sources(robot: str) -> list[Path] | None:
    """Mesh files of a robot's picture, base first; None without meshes or the simplification."""
    folder = installed(robot)
    if folder is None or find_spec("fast_simplification") is None:
        return None
    return [mesh_file(folder, KIND, link) for link in range(len(_links(robot)))]


def picture(robot: str) -> bytes:
    """The GLB file of a robot with `picture_sources`, with normals and colours, in about 1 s."""
    import trimesh  # most processes never need it

    sources = picture_sources(robot)
    assert sources is not None
    links = [_parts(path) for path in sources]
    share = PICTURE.faces / sum(len(part.faces) for parts in links for part, _ in parts)
    scene = trimesh.Scene()
    for link, (name, parts) in enumerate(zip(_links(robot), links, strict=True)):
        mesh = _merged(
            [(_simplified(part, share), colour) for part, colour in parts],
            mesh_placement(robot, link),
        )
        scene.add_geometry(mesh, node_name=name, geom_name=name)
    content = scene.export(file_type="glb", include_normals=True)  # type: ignore[no-untyped-call]
    return bytes(content)


def _links(robot: str) -> list[str]:
    return ["base", *bundled_robot(robot).figures["kinematics"]["link_names"]["value"]]


def _parts(path: Path) -> list[tuple[Trimesh, Array]]:
    """Parts of a mesh file by material, with colour and opacity (red, green, blue, alpha: 0 to
    255).
    """
    import trimesh

    parts = []
    for given in trimesh.load_scene(path, process=False).geometry.values():
        part = trimesh.Trimesh(given.vertices, given.faces, process=False)
        # Merge corners of neighbouring faces to keep the surface closed.
        part.merge_vertices(digits_vertex=6)
        parts.append((part, given.visual.material.main_color))
    return parts


def _simplified(part: Trimesh, share: float) -> Trimesh:
    """A part with about this share of its faces.

    Its corners are a subset of the original ones, so that capsules still cover it.
    """
    if len(part.faces) <= PICTURE.small:
        return part
    simple = part.simplify_quadric_decimation(percent=1 - share)
    simple.vertices = part.vertices[cKDTree(part.vertices).query(simple.vertices)[1]]
    simple.merge_vertices()
    simple.update_faces(simple.nondegenerate_faces())
    return simple


def _merged(parts: list[tuple[Trimesh, Array]], T: pin.SE3) -> Trimesh:
    """One mesh, moved by T, with separate corners on both sides of sharp edges."""
    import trimesh

    shaded = [trimesh.graph.smooth_shade(part, angle=PICTURE.crease) for part, _ in parts]
    colours = [
        np.tile(colour, (len(part.vertices), 1))
        for part, (_, colour) in zip(shaded, parts, strict=True)
    ]
    mesh = trimesh.util.concatenate(shaded)
    assert isinstance(mesh, trimesh.Trimesh)
    mesh.apply_transform(T.homogeneous)
    # At folds, the normals of adjacent faces may cancel.
    normals = mesh.vertex_normals.copy()
    folded = np.linalg.norm(normals, axis=1) < 0.5
    normals[folded] = mesh.face_normals[mesh.vertex_faces[folded, 0]]
    return trimesh.Trimesh(
        vertices=np.round(mesh.vertices * PICTURE.steps) / PICTURE.steps,
        faces=mesh.faces,
        vertex_normals=np.round(normals * PICTURE.normal_steps) / PICTURE.normal_steps,
        vertex_colors=np.concatenate(colours),
        process=False,
    )
