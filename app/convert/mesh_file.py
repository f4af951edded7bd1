"""From mesh files in a request to triangles of the library, by trimesh.

A file is untrusted. Its size is limited before it is decoded. trimesh reads it from memory and follows no reference to
another file. A GLB may ask for more memory than it has bytes, by accessors without data and by meshes that many nodes
repeat: both are refused before trimesh sees it. Files in these formats hold no compressed parts that are unpacked here.
"""

from __future__ import annotations

import hashlib
import json
import struct
import threading
from io import BytesIO
from typing import Any, Literal

import numpy as np
from cachetools import LRUCache, cached

from app.convert.base64_data import decoded
from optimizer.exceptions import InvalidProblem
from optimizer.problem.clouds import MOST_TRIANGLES, TriangleMesh

# meshes that are kept for the next request with the same file, of so many triangles in all: 72 bytes each
MOST_KEPT_TRIANGLES = 400_000
GLB_MAGIC, GLB_JSON = b"glTF", 0x4E4F534A
# most nodes, meshes and accessors of a GLB
MOST_ENTRIES = 4096

Format = Literal["stl", "obj", "glb"]


def mesh_from_file(file_format: Format, data: str, scale: float) -> TriangleMesh:
    """The mesh of a file in base64, whose unit of length is `scale` [m]. Raises InvalidProblem at the field `data`."""
    return _mesh(file_format, decoded(data, "data"), scale)


def _digest(file_format: Format, content: bytes, scale: float) -> bytes:
    return hashlib.blake2b(content, person=file_format.encode()).digest() + struct.pack("<d", scale)


@cached(LRUCache(MOST_KEPT_TRIANGLES, getsizeof=lambda mesh: len(mesh.corners)), key=_digest, lock=threading.Lock())
def _mesh(file_format: Format, content: bytes, scale: float) -> TriangleMesh:
    if file_format == "glb":
        _check_glb(content)
    if file_format == "stl":
        _check_stl(content)
    import trimesh  # only requests with a mesh file need it

    try:
        scene = trimesh.load_scene(
            BytesIO(content), file_type=file_format, resolver=None, process=False, skip_materials=True
        )
        # each entry of the graph is one copy of a geometry: counted before they are made
        copies = [scene.geometry[scene.graph[node][1]] for node in scene.graph.nodes_geometry]
        count = sum(len(copy.faces) for copy in copies if hasattr(copy, "faces"))
        corners = np.zeros((0, 3, 3)) if count > MOST_TRIANGLES else np.asarray(scene.to_mesh().triangles, dtype=float)
    except Exception as error:  # trimesh raises many kinds for broken files
        raise InvalidProblem(
            "data", f"data is no {file_format} file that can be read: check `format`, and export the mesh again."
        ) from error
    if count > MOST_TRIANGLES:
        raise InvalidProblem("data", f"data has {count} triangles: simplify the mesh to at most {MOST_TRIANGLES}.")
    if not len(corners):
        raise InvalidProblem("data", f"data has no triangles: give a {file_format} file of a mesh with faces.")
    return TriangleMesh(corners * scale)


def _check_stl(content: bytes) -> None:
    """Refuses a binary file whose header promises another number of triangles than it has bytes for."""
    if content[:5].lower() == b"solid" and b"facet" in content[:1024]:
        return
    if len(content) < 84 or len(content) < 84 + 50 * struct.unpack("<I", content[80:84])[0]:
        raise InvalidProblem("data", "data is no complete STL file: it is shorter than its header says.")


def _check_glb(content: bytes) -> None:
    """Refuses a GLB that would take more memory than its own size allows for."""
    try:
        magic, _, _, length, kind = struct.unpack("<4sIIII", content[:20])
        header: dict[str, Any] = (
            json.loads(content[20 : 20 + length]) if magic == GLB_MAGIC and kind == GLB_JSON else {}
        )
        accessors, nodes = header.get("accessors", []), header.get("nodes", [])
        children = [child for node in nodes for child in node.get("children", [])]
        complete = bool(header) and all("bufferView" in each and "sparse" not in each for each in accessors)
        counts = sum(int(each["count"]) for each in accessors)
        entries = max(len(accessors), len(nodes), len(header.get("meshes", [])))
    except (struct.error, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise InvalidProblem("data", "data is no glb file that can be read: export the mesh again.") from None
    if not complete or counts > len(content) or entries > MOST_ENTRIES or len(children) != len(set(children)):
        raise InvalidProblem(
            "data",
            "data is no plain glb file (accessors without data, repeated nodes, too many entries): export the mesh "
            "alone, without compression, animation or materials.",
        )
