"""How much an uploaded file may hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

Checkpoint = Callable[[], None]
"""Called while a file is read, some hundred times a second or more; it raises whatever is to end
the reading.
"""


def unwatched() -> None:
    """The checkpoint of a caller who waits for as long as the reading takes."""


@dataclass(frozen=True)
class UploadLimits:
    """Greatest numbers of what a file may hold: each is several times that of any published file
    that was looked at.
    """

    xml_bytes: int = 8 << 20
    """Bytes of one document; published arms have up to 0.5 MB. The attributes of one element are
    all read before they can be counted, so many of them in 1.5 s."""
    xml_depth: int = 100
    """Elements inside one another; a URDF needs 5, and what simulators add to it some 10 more.
    Libraries that copy and write the tree call themselves once for each level, and run out of stack
    at about 1,000."""
    xml_attributes: int = 200
    """Attributes of one element; a URDF needs 6. The XML library below Pinocchio searches them one
    by one, so that its time grows with their square."""
    xml_nodes: int = 200_000
    """Elements, comments and processing instructions of one document; published arms have up to
    3,000. The tree of so many takes some 50 MB."""
    xml_piece: int = 1 << 18
    """Bytes that are parsed between two checkpoints, in some 10 ms. Of what follows a fault, the
    parser still scans the rest of the piece; a token that is longer than a piece is scanned again
    with each."""
    shapes: int = 1000
    """Collision shapes and capsules of one arm. Each pair of shapes is compared in 300
    configurations.
    """
    mesh_files: int = 200
    """Mesh files of one arm."""
    mesh_bytes: int = 128 << 20
    """Bytes of all mesh files of one arm, unpacked."""
    mesh_corners: int = 1_500_000
    """Corners of one mesh of a link."""
    mesh_triangles: int = 3_000_000
    """Triangles of one mesh of a link: a closed surface has twice as many as corners."""
    mesh_line: int = 1 << 20
    """Bytes of one line of an OBJ; a polygon of so many has some 150,000 corners. A line is split
    as a whole, which takes ten times its memory."""
    mesh_lines: int = 4096
    """Lines of a mesh that are read between two checkpoints, about 4 ms."""
    glb_entries: int = 4096
    """Nodes, accessors, and copies of primitives of one GLB. Each copy becomes a mesh of its own,
    in 0.2 ms.
    """
    glb_depth: int = 32
    """Nodes of a GLB below one another: each node's pose is computed from the root on, and a
    drawing program's assemblies have up to 10 levels."""


LIMITS = UploadLimits()


class UnreadableFile(ValueError):
    """A file that cannot be read, or holds too much. The message is a sentence without a subject,
    as "has no …".
    """
