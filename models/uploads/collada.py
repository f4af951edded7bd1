"""Corners of the meshes of a COLLADA file, placed by its scene and in metres.

The axis that the file calls upright has no effect, as in RViz: a URDF places the mesh.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.models.uploads.limits import LIMITS, Checkpoint, UnreadableFile
from joulepath.models.uploads.mesh_text import MeshSize
from joulepath.models.uploads.xml_tree import xml_tree

FACES = ("triangles", "trifans", "tristrips", "polylist", "polygons")
"""Elements of a mesh with faces."""
LEAST_AXIS = 1e-12
"""Length of an axis of rotation below which nothing turns."""


def collada_corners(content: bytes, most: MeshSize, checkpoint: Checkpoint) -> Array:
    """Corners (n, 3) [m] of a COLLADA file. Raises UnreadableFile."""
    text = content.decode("utf-8-sig", errors="replace")
    root = xml_tree(text, checkpoint, LIMITS.collada_bytes)
    if root.tag != "COLLADA":
        raise UnreadableFile("is not a COLLADA file: export the mesh again.")
    unit = root.find("asset/unit")
    metres = _floats(unit.get("meter", "1") if unit is not None else "1", 1)[0]
    document = _Document(root, most, checkpoint)
    return np.asarray(metres * np.vstack([np.zeros((0, 3)), *document.placed()]))


@dataclass
class _Document:
    """The geometries and nodes of a file, and the corners counted so far."""

    root: Element
    most: MeshSize
    checkpoint: Checkpoint
    _by_id: dict[str, Element] = field(init=False)
    _points: dict[str, Array] = field(default_factory=dict)
    _corners: int = 0
    _nodes: int = 0

    def __post_init__(self) -> None:
        self._by_id = {each.get("id", ""): each for each in self.root.iter()}

    def placed(self) -> Iterator[Array]:
        """Corners (n, 3) of every geometry where the scene has it; of a file without a scene, where
        it is drawn.
        """
        scene = self.root.find("library_visual_scenes/visual_scene")
        if scene is not None:
            yield from self._of_node(scene, np.eye(4), 0)
        else:
            for each in self.root.iterfind("library_geometries/geometry"):
                yield self._counted(each)

    def _of_node(self, node: Element, above: Array, depth: int) -> Iterator[Array]:
        self.checkpoint()
        self._nodes += 1
        if depth > LIMITS.xml_depth or self._nodes > LIMITS.xml_nodes:
            raise UnreadableFile("has too many nodes, or nodes in a loop.")
        T = above
        for part in node:
            T = T @ _transform(part)
        for part in node:
            if part.tag == "node":
                yield from self._of_node(part, T, depth + 1)
            elif part.tag == "instance_node":
                yield from self._of_node(self._named(part.get("url")), T, depth + 1)
            elif part.tag == "instance_geometry":
                points = self._counted(self._named(part.get("url")))
                yield points @ T[:3, :3].T + T[:3, 3]

    def _counted(self, geometry: Element) -> Array:
        """Corners (n, 3) of the faces of a geometry, in its own units."""
        name = geometry.get("id", "")
        if name not in self._points:
            self._points[name] = self._read(geometry)
        self._corners += len(self._points[name])
        self.most.check(self._corners, 0)
        return self._points[name]

    def _read(self, geometry: Element) -> Array:
        inputs = [
            each
            for each in geometry.iterfind("mesh/vertices/input")
            if each.get("semantic") == "POSITION"
        ]
        if not inputs:
            return np.zeros((0, 3))
        source = self._named(inputs[0].get("source"))
        accessor = source.find("technique_common/accessor")
        stride = 3 if accessor is None else int(_floats(accessor.get("stride", "3"), 1)[0])
        values = _floats(source.findtext("float_array") or "")
        if stride < 3 or len(values) % stride:
            raise UnreadableFile("has corners of fewer than three coordinates.")
        places = values.reshape(-1, stride)[:, :3]
        # Parts of one body may share the corners of all.
        used = _used(geometry, len(places))
        return places[used] if len(used) else places

    def _named(self, url: str | None) -> Element:
        name = (url or "").removeprefix("#")
        if name not in self._by_id:
            raise UnreadableFile(f"names an element {name[:100]!r} that it does not have.")
        return self._by_id[name]


def _used(geometry: Element, count: int) -> npt.NDArray[np.int64]:
    """Numbers of the corners of the faces of a geometry, below `count`; empty without faces.

    Raises UnreadableFile.
    """
    found = [np.zeros(0)]
    for faces in geometry.iterfind("mesh/*"):
        if faces.tag not in FACES:
            continue
        offsets = [
            (int(_floats(each.get("offset", "0"), 1)[0]), each.get("semantic"))
            for each in faces.iterfind("input")
        ]
        of_corners = next((k for k, semantic in offsets if semantic == "VERTEX"), 0)
        step = max((k for k, _ in offsets), default=0) + 1
        found += [_floats(each.text or "")[of_corners::step] for each in faces.iter("p")]
    used = np.unique(np.concatenate(found))
    if len(used) and not (used[0] >= 0 and used[-1] < count):
        raise UnreadableFile("has faces with corners outside its list of corners.")
    return used.astype(np.int64)


def _transform(part: Element) -> Array:
    """The transformation (4, 4) of a part of a node; the identity for other parts."""
    T = np.eye(4)
    if part.tag == "matrix":
        T = _floats(part.text or "", 16).reshape(4, 4)
    elif part.tag == "translate":
        T[:3, 3] = _floats(part.text or "", 3)
    elif part.tag == "scale":
        T[:3, :3] = np.diag(_floats(part.text or "", 3))
    elif part.tag == "rotate":
        turn = _floats(part.text or "", 4)
        length = max(float(np.linalg.norm(turn[:3])), LEAST_AXIS)
        T[:3, :3] = pin.exp3(np.radians(turn[3]) * turn[:3] / length)
    return T


def _floats(text: str, count: int | None = None) -> Array:
    try:
        values = np.array(text.split(), dtype=float)
    except ValueError:
        values = np.zeros(0)
    if count is not None and len(values) != count:
        raise UnreadableFile(f"has {text[:40]!r} where {count} numbers are expected.")
    return values
