"""Ceilings on the content of uploaded files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

Checkpoint = Callable[[], None]
"""Function called at least a hundred times a second while a file is read; it may raise an exception
to stop reading."""


def unwatched() -> None:
    """A checkpoint without a time limit."""


@dataclass(frozen=True)
class UploadLimits:
    """Ceilings on files, several times the largest values of published files."""

    xml_bytes: int = 8 << 20
    """Bytes of one document; published arms have up to 0.5 MB. All attributes of an element are
    read before they are counted, in at most 1.5 s for a document of this size."""
    collada_bytes: int = 32 << 20
    """Bytes of one COLLADA file, nearly all of which are numbers; published ones of links have up
    to 20 MB."""
    xml_depth: int = 100
    """Levels of nested elements; a URDF needs 5, and extensions of simulators some 10 more.
    Libraries copy and write the tree recursively and exhaust the stack at about 1,000."""
    xml_attributes: int = 200
    """Attributes of one element; a URDF needs 6. The XML library of Pinocchio searches linearly, so
    that its time grows with their square."""
    xml_nodes: int = 200_000
    """Elements, comments and processing instructions of one document; published arms have up to
    3,000. A tree of this size takes some 50 MB."""
    xml_piece: int = 1 << 18
    """Bytes parsed between two checkpoints, in some 10 ms. After a fault the parser still scans the
    rest of the piece; it scans a token longer than a piece again with every piece."""
    shapes: int = 1000
    """Collision shapes and capsules of one arm; all pairs are compared in 300 configurations."""
    mesh_files: int = 200
    """Mesh files of one arm."""
    mesh_bytes: int = 128 << 20
    """Bytes of all mesh files of one arm, unpacked."""
    mesh_corners: int = 1_500_000
    """Corners of one mesh of a link."""
    mesh_triangles: int = 3_000_000
    """Triangles of one mesh of a link: a closed surface has twice as many as corners."""
    mesh_line: int = 1 << 20
    """Bytes of one line of an OBJ, some 150,000 corners of a polygon. Splitting a line takes ten
    times its memory."""
    mesh_lines: int = 4096
    """Lines of a mesh read between two checkpoints, in about 4 ms."""
    glb_entries: int = 4096
    """Nodes, accessors, and copies of primitives of one GLB; every copy becomes a mesh in 0.2
    ms."""
    glb_depth: int = 32
    """Levels of nested nodes of a GLB: poses are computed from the root, and assemblies of drawing
    programs have up to 10 levels."""


LIMITS = UploadLimits()


class UnreadableFile(ValueError):
    """An unreadable or oversized file. The message is a predicate such as "has no faces."."""
