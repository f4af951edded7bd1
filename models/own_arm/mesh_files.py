"""Mesh files of an own arm in a folder or zip, found by the end of their paths."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Mapping
from io import BytesIO
from itertools import islice
from pathlib import Path

import numpy as np
import numpy.typing as npt

from joulepath.models.own_arm.description import PLAUSIBLE, InvalidArm
from joulepath.models.robot import Array
from joulepath.models.uploads.collada import collada_corners
from joulepath.models.uploads.limits import LIMITS, Checkpoint, UnreadableFile, unwatched
from joulepath.models.uploads.mesh import read_mesh
from joulepath.models.uploads.mesh_text import MeshSize
from joulepath.models.uploads.xml_tree import xml_tree

# supported kinds; a link with other meshes has a capsule from joint to joint
KINDS = ("stl", "obj", "dae")
_PIECE = 1 << 20
"""Bytes unpacked between two checkpoints."""


def in_zip(content: bytes, checkpoint: Checkpoint = unwatched) -> dict[str, bytes]:
    """Mesh files of a zip by their paths. Raises InvalidArm."""
    try:
        archive = zipfile.ZipFile(BytesIO(content))
    except Exception as error:  # zipfile raises many kinds for broken files
        raise _no_zip(error) from error
    entries = [each for each in archive.infolist() if _kind(each.filename) in KINDS]
    if len(entries) > LIMITS.mesh_files:
        raise InvalidArm(
            "meshes",
            f"The zip has {len(entries)} mesh files: at most {LIMITS.mesh_files} are read.",
        )
    left, found = LIMITS.mesh_bytes, {}
    for entry in entries:
        pieces = list[bytes]()
        for piece in _unpacked(archive, entry):
            checkpoint()
            pieces.append(piece)
            # The size in the header may be wrong.
            left -= len(piece)
            if left < 0:
                most = LIMITS.mesh_bytes >> 20
                raise InvalidArm("meshes", f"The zip unpacks to more than {most} MiB of meshes.")
        found[entry.filename] = b"".join(pieces)
    return found


def _unpacked(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Iterator[bytes]:
    """The content of a file, piece by piece. Raises InvalidArm."""
    try:
        with archive.open(entry) as file:
            while piece := file.read(_PIECE):
                yield piece
    except Exception as error:  # what unpacks the methods of a zip raises many kinds, too
        raise _no_zip(error) from error


def _no_zip(error: Exception) -> InvalidArm:
    return InvalidArm("meshes", "The meshes are not a readable zip: pack them again.")


def in_folder(folder: Path, urdf: str) -> dict[str, bytes]:
    """The mesh files of a URDF in a folder; none if the text is not XML."""
    try:
        named = (each.get("filename", "") for each in xml_tree(urdf).iter("mesh"))
    except UnreadableFile:
        return {}
    found = {}
    for reference in islice(dict.fromkeys(named), LIMITS.mesh_files):
        file = next((each for each in _below(folder, reference) if each.is_file()), None)
        if (
            file is not None
            and _kind(reference) in KINDS
            and file.stat().st_size <= LIMITS.mesh_bytes
        ):
            found[reference] = file.read_bytes()
    return found


def surface(
    meshes: Mapping[str, bytes], reference: str, checkpoint: Checkpoint = unwatched
) -> tuple[Array, npt.NDArray[np.int64]] | None:
    """Corners (n, 3) of a mesh of the URDF, in its own units, and index triples (m, 3) of its
    triangles; None without its file. A COLLADA file is in metres, and its triangles are not read.

    Raises InvalidArm for an unreadable file, or several matching files.
    """
    path = _file_of(meshes, reference)
    if path is None:
        return None
    most = MeshSize()
    try:
        if _kind(path) == "dae":
            corners = collada_corners(meshes[path], most, checkpoint)
            triangles = np.empty((0, 3), dtype=np.int64)
        else:
            corners, triangles = read_mesh(_kind(path), meshes[path], most, checkpoint)
    except UnreadableFile as error:
        raise InvalidArm("meshes", f"{reference[: PLAUSIBLE.name]!r} {error}") from error
    if len(corners) < 4 or not np.isfinite(corners).all():
        raise InvalidArm(
            "meshes",
            f"{reference[: PLAUSIBLE.name]!r} must have from 4 to {most.corners} finite corners.",
        )
    return corners, triangles


def _file_of(meshes: Mapping[str, bytes], reference: str) -> str | None:
    """The path with the longest common ending with the reference."""
    wanted = _parts(reference)[::-1]

    def agreement(path: str) -> int:
        pairs = zip(wanted, _parts(path)[::-1], strict=False)
        return next(
            (k for k, (a, b) in enumerate(pairs) if a != b), min(len(wanted), len(_parts(path)))
        )

    best = max(map(agreement, meshes), default=0)
    fitting = [path for path in meshes if best and agreement(path) == best]
    if len(fitting) > 1 and len({meshes[path] for path in fitting}) > 1:
        raise InvalidArm(
            "meshes",
            f"Several files fit {reference[: PLAUSIBLE.name]!r}: {', '.join(sorted(fitting)[:3])}.",
        )
    return fitting[0] if fitting else None


def _below(folder: Path, reference: str) -> Iterator[Path]:
    parts = _parts(reference)
    yield from (folder.joinpath(*parts[k:]) for k in range(len(parts)))


def _parts(path: str) -> list[str]:
    """Components of a path or URL, without scheme, `.` and `..`."""
    plain = path.partition("://")[2] or path
    return [part for part in plain.replace("\\", "/").split("/") if part not in ("", ".", "..")]


def _kind(path: str) -> str:
    return path.rsplit(".", 1)[-1].lower()
