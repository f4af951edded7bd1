"""Validation of the resources requested by a GLB.

Accessors without data and repeated meshes may request far more than the size of the file.
"""

from __future__ import annotations

import json
import struct
from typing import Any

from joulepath.models.uploads.limits import LIMITS, UnreadableFile
from joulepath.models.uploads.mesh_text import MeshSize

_MAGIC = b"glTF"
_JSON = 0x4E4F534A
_TRIANGLES = 4
"""Mode of a primitive with separate triangles; in strips and fans, every corner adds a triangle."""


def check_glb(content: bytes, most: MeshSize) -> None:
    """Raises UnreadableFile for a GLB with excessive demands on memory or time."""
    try:
        header = _header(content)
        accessors, nodes, meshes = (
            header.get(part, []) for part in ("accessors", "nodes", "meshes")
        )
        complete = bool(header) and all(
            "bufferView" in each and "sparse" not in each for each in accessors
        )
        counts = sum(int(each["count"]) for each in accessors)
        primitives = [
            [_triangles(each, accessors) for each in mesh["primitives"]] for mesh in meshes
        ]
        copies = [primitives[node["mesh"]] for node in nodes if "mesh" in node]
        depth = _depth([node.get("children", []) for node in nodes])
    except (struct.error, ValueError, TypeError, LookupError, AttributeError, RecursionError):
        raise UnreadableFile("is not a readable glb file: export the mesh again.") from None
    most.check(0, sum(map(sum, copies)))
    entries = max(len(accessors), len(nodes), sum(map(len, primitives)), sum(map(len, copies)))
    if (
        not complete
        or counts > len(content)
        or entries > LIMITS.glb_entries
        or depth > LIMITS.glb_depth
    ):
        raise UnreadableFile(
            "is not a plain glb file (accessors without data, repeated or deeply nested nodes, "
            "too many entries): export the mesh alone, without compression, animation or "
            "materials."
        )


def _header(content: bytes) -> dict[str, Any]:
    magic, _, _, length, kind = struct.unpack("<4sIIII", content[:20])
    if magic != _MAGIC or kind != _JSON:
        raise ValueError("no GLB")
    found: dict[str, Any] = json.loads(content[20 : 20 + length])
    return found


def _triangles(primitive: dict[str, Any], accessors: list[dict[str, Any]]) -> int:
    """Most triangles of a primitive."""
    of_corners = primitive.get("indices", primitive["attributes"]["POSITION"])
    count = int(accessors[of_corners]["count"])
    return count // 3 if primitive.get("mode", _TRIANGLES) == _TRIANGLES else count


def _depth(children: list[list[int]]) -> int:
    """Levels of nested nodes; above LIMITS for repeated or cyclic nodes."""
    below = [child for each in children for child in each]
    if len(below) != len(set(below)):
        return LIMITS.glb_depth + 1
    level, depth = [k for k, each in enumerate(children) if each], 0
    while level and depth <= LIMITS.glb_depth:
        level, depth = [child for node in level for child in children[node]], depth + 1
    return depth
