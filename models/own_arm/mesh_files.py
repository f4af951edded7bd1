"""Mesh files of a user's own arm: in a folder or a zip, found by the end of their paths, read by trimesh."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator, Mapping
from io import BytesIO
from pathlib import Path

import numpy as np

from models.own_arm.description import InvalidArm
from models.robot import Array

# kinds that are read; of others, as of DAE, a link has its capsule from joint to joint
KINDS = ("stl", "obj")
# most files, bytes of all of them unpacked, and corners of one mesh
MOST_FILES, MOST_BYTES, MOST_CORNERS = 200, 128 * 2**20, 1_500_000


def in_zip(content: bytes) -> dict[str, bytes]:
    """Mesh files of a zip by their paths. Raises InvalidArm."""
    try:
        with zipfile.ZipFile(BytesIO(content)) as archive:
            entries = [each for each in archive.infolist() if _kind(each.filename) in KINDS]
            if len(entries) > MOST_FILES:
                raise InvalidArm("meshes", f"The zip has {len(entries)} mesh files: at most {MOST_FILES} are read.")
            left, found = MOST_BYTES, {}
            for entry in entries:
                # a size that the header states may be false
                with archive.open(entry) as file:
                    found[entry.filename] = file.read(left + 1)
                left -= len(found[entry.filename])
                if left < 0:
                    raise InvalidArm("meshes", f"The zip unpacks to more than {MOST_BYTES >> 20} MiB of meshes.")
            return found
    except InvalidArm:
        raise
    except Exception as error:  # zipfile, and what unpacks its methods, raise many kinds for broken files
        raise InvalidArm("meshes", "The meshes are no zip that can be read: pack them again.") from error


def in_folder(folder: Path, urdf: str) -> dict[str, bytes]:
    """The mesh files that the text of a URDF names, as far as they are in a folder."""
    found = {}
    for reference in re.findall(r'<mesh[^>]*filename\s*=\s*"([^"]+)"', urdf)[:MOST_FILES]:
        file = next((each for each in _below(folder, reference) if each.is_file()), None)
        if file is not None and _kind(reference) in KINDS and file.stat().st_size <= MOST_BYTES:
            found[reference] = file.read_bytes()
    return found


def corners(meshes: Mapping[str, bytes], reference: str) -> Array | None:
    """Corners (n, 3) of the mesh that a URDF names, in its own units; None if it is not among the files.

    Raises InvalidArm for a file that is none, or if several files fit.
    """
    path = _file_of(meshes, reference)
    if path is None:
        return None
    import trimesh  # only arms with meshes need it

    try:
        mesh = trimesh.load_mesh(BytesIO(meshes[path]), file_type=_kind(path), process=False)
        found = np.asarray(mesh.vertices, dtype=float).reshape(-1, 3)
    except Exception as error:  # trimesh raises many kinds for broken files
        raise InvalidArm("meshes", f"{reference!r} is no {_kind(path)} file that can be read.") from error
    if not 4 <= len(found) <= MOST_CORNERS or not np.isfinite(found).all():
        raise InvalidArm("meshes", f"{reference!r} must have from 4 to {MOST_CORNERS} finite corners.")
    return found


def _file_of(meshes: Mapping[str, bytes], reference: str) -> str | None:
    """The path whose end agrees longest with the reference's."""
    wanted = _parts(reference)[::-1]

    def agreement(path: str) -> int:
        pairs = zip(wanted, _parts(path)[::-1], strict=False)
        return next((k for k, (a, b) in enumerate(pairs) if a != b), min(len(wanted), len(_parts(path))))

    best = max(map(agreement, meshes), default=0)
    fitting = [path for path in meshes if best and agreement(path) == best]
    if len(fitting) > 1 and len({meshes[path] for path in fitting}) > 1:
        raise InvalidArm("meshes", f"Several files fit {reference!r}: {', '.join(sorted(fitting)[:3])}.")
    return fitting[0] if fitting else None


def _below(folder: Path, reference: str) -> Iterator[Path]:
    parts = _parts(reference)
    yield from (folder.joinpath(*parts[k:]) for k in range(len(parts)))


def _parts(path: str) -> list[str]:
    """Parts of a path or a URL, without scheme and steps up."""
    plain = re.sub(r"^[a-z]+://", "", path).replace("\\", "/")
    return [part for part in plain.split("/") if part not in ("", ".", "..")]


def _kind(path: str) -> str:
    return path.rsplit(".", 1)[-1].lower()
