"""Reduction of text mesh files to corners and triangles.

trimesh separates groups, materials and solids, and its time grows with the square of their number.
They have no meaning here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from itertools import pairwise

from joulepath.models.uploads.limits import LIMITS, Checkpoint, UnreadableFile


@dataclass(frozen=True)
class MeshSize:
    """Most corners and triangles of a mesh."""

    corners: int = LIMITS.mesh_corners
    triangles: int = LIMITS.mesh_triangles

    def check(self, corners: int, triangles: int) -> None:
        """Raises UnreadableFile if a mesh has more."""
        if corners > self.corners:
            raise UnreadableFile(f"has more than {self.corners} corners: simplify the mesh.")
        if triangles > self.triangles:
            raise UnreadableFile(f"has more than {self.triangles} triangles: simplify the mesh.")


def plain_obj(content: bytes, most: MeshSize, checkpoint: Checkpoint) -> bytes:
    """An OBJ reduced to corners and triangles. Raises UnreadableFile."""
    corners, faces = list[bytes](), list[bytes]()
    # A backslash joins lines.
    for line in _lines(content.replace(b"\r\n", b"\n").replace(b"\\\n", b""), checkpoint):
        kind = line[:2].rstrip()
        if kind not in (b"v", b"f") and not line[:1].isspace():
            continue
        if len(line) > LIMITS.mesh_line:
            raise UnreadableFile(f"has a line of more than {LIMITS.mesh_line} bytes.")
        words = line.split()
        if words[:1] == [b"v"]:
            if len(words) < 4:
                raise UnreadableFile("has a corner of fewer than three coordinates.")
            corners.append(b"v " + b" ".join(words[1:4]))
        elif words[:1] == [b"f"]:
            indices = [_index(word, len(corners)) for word in words[1:]]
            faces += [b"f %d %d %d" % (indices[0], *pair) for pair in pairwise(indices[1:])]
        most.check(len(corners), len(faces))
    return b"\n".join([*corners, *faces])


def _index(word: bytes, corners: int) -> int:
    """Number of a face's corner, from 1; negative numbers count back from the latest corner."""
    try:
        index = int(word.partition(b"/")[0])
    except ValueError:
        index = 0
    if index < 0:
        index += corners + 1
    if index < 1:
        raise UnreadableFile("has a face with a missing corner.")
    return index


def plain_stl(content: bytes, most: MeshSize, checkpoint: Checkpoint) -> bytes:
    """A text STL reduced to one solid. Raises UnreadableFile."""
    found, count = [b"solid"], 0
    for line in _lines(content, checkpoint):
        place = line.lower().find(b"vertex")
        if place >= 0:
            found.append(line[place:])
            count += line.lower().count(b"vertex")
            most.check(count, count // 3)
    return b"\n".join([*found, b"endsolid\n"])


def _lines(content: bytes, checkpoint: Checkpoint) -> Iterator[bytes]:
    for number, line in enumerate(BytesIO(content)):
        if number % LIMITS.mesh_lines == 0:
            checkpoint()
        yield line
