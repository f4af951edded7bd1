"""The description of an arm in a YAML file."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml
from pydantic import ConfigDict, TypeAdapter, ValidationError

from joulepath.models.own_arm.description import (
    Collision,
    Description,
    Drives,
    Electronics,
    InvalidArm,
    Motion,
)
from joulepath.models.own_arm.mesh_files import in_folder, in_zip

# no conversion of types, no unknown fields
for _part in (Collision, Description, Drives, Electronics, Motion):
    _part.__pydantic_config__ = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)  # type: ignore[union-attr]
_DESCRIPTION = TypeAdapter(Description)


def read_description(path: Path) -> Description:
    """The description in a YAML file.

    Its `urdf` is the path of the URDF, and `meshes` the path of a folder or zip with mesh files,
    both relative to the file. Without `meshes`, the folder of the URDF is searched.

    Raises:
        InvalidArm: the description is invalid; the error names the field.
        OSError: the file cannot be read.
    """
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
        place = data.pop("meshes", None) if isinstance(data, dict) else None
        # The strict validator accepts JSON lists as tuples.
        found = _DESCRIPTION.validate_json(json.dumps(data))
    except (yaml.YAMLError, UnicodeDecodeError, TypeError) as error:
        raise InvalidArm("", f"{path.name} is no description in YAML: {error}") from None
    except ValidationError as error:
        raise _first(error) from None
    urdf = path.parent / found.urdf
    if not urdf.is_file():
        raise InvalidArm(
            "urdf", f"There is no file {urdf}: give the path of the URDF, relative to {path.name}."
        )
    text = urdf.read_text(encoding="utf-8", errors="replace")
    if found.srdf is not None:
        srdf = path.parent / found.srdf
        if not srdf.is_file():
            raise InvalidArm(
                "srdf",
                f"There is no file {srdf}: give the path of the SRDF, relative to {path.name}.",
            )
        found = replace(found, srdf=srdf.read_text(encoding="utf-8", errors="replace"))
    return replace(found, urdf=text, meshes=_meshes(path.parent, place, urdf.parent, text))


def _meshes(folder: Path, place: Any, beside: Path, urdf: str) -> dict[str, bytes]:
    """Mesh files at a path relative to the description, or beside the URDF without a path."""
    if place is None:
        return in_folder(beside, urdf)
    if not isinstance(place, str) or not (folder / place).exists():
        raise InvalidArm(
            "meshes", "meshes must be the path of a folder or a zip, relative to the description."
        )
    at = folder / place
    return in_folder(at, urdf) if at.is_dir() else in_zip(at.read_bytes())


def _first(error: ValidationError) -> InvalidArm:
    """The first error, with its path in the file."""
    first = error.errors(include_url=False)[0]
    # Members of unions are not part of the path.
    place = ".".join(str(part) for part in first["loc"] if "[" not in str(part) and part != "float")
    return InvalidArm(place, f"{place or 'The file'}: {first['msg']}.")
