"""The description of an arm in a YAML file."""

from __future__ import annotations

import json
from collections.abc import Sequence
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
from joulepath.models.own_arm.xacro_file import (
    SUFFIX,
    expanded,
    package_folders,
    repositories,
)

# no conversion of types, no unknown fields
_STRICT = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)
for _part in (Collision, Description, Drives, Electronics, Motion):
    _part.__pydantic_config__ = _STRICT  # type: ignore[union-attr]
DESCRIPTION = TypeAdapter(Description)
"""Reads a description in JSON, without mesh files: these are bytes."""
_MESSAGES = {
    "unexpected_keyword_argument": "A description has no such field: correct its name, or leave it "
    "out",
    "missing": "This field is required: add it",
}
"""Messages replacing those of pydantic, which are about Python's arguments."""


def read_description(path: Path) -> Description:
    """The description in a YAML file.

    Its `urdf` is the path of the URDF, and `meshes` the path of a folder or zip with mesh files,
    both relative to the file. Without `meshes`, the folder of the URDF is searched, the ROS package
    that it belongs to, and the folder `packages`. A URDF whose name ends with .xacro is expanded
    with the `arguments`.

    Raises:
        InvalidArm: the description is invalid; the error names the field.
        OSError: the file cannot be read.
    """
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
        is_mapping = isinstance(data, dict)
        place, folder, arguments = (
            data.pop(name, None) if is_mapping else None
            for name in ("meshes", "packages", "arguments")
        )
        # The strict validator accepts JSON lists as tuples.
        found = DESCRIPTION.validate_json(json.dumps(data))
    except (yaml.YAMLError, UnicodeDecodeError, TypeError) as error:
        raise InvalidArm("", f"{path.name} is not a description in YAML: {error}") from None
    except ValidationError as error:
        raise _first(error) from None
    urdf = path.parent / found.urdf
    if not urdf.is_file():
        raise InvalidArm(
            "urdf", f"There is no file {urdf}: give the path of the URDF, relative to {path.name}."
        )
    given = _folder_of_packages(path.parent, folder)
    folders = [*given, *package_folders(urdf)]
    if urdf.suffix == SUFFIX:
        text = expanded(urdf, _arguments(arguments), folders)
    else:
        text = urdf.read_text(encoding="utf-8", errors="replace")
    if found.srdf is not None:
        srdf = path.parent / found.srdf
        if not srdf.is_file():
            raise InvalidArm(
                "srdf",
                f"There is no file {srdf}: give the path of the SRDF, relative to {path.name}.",
            )
        found = replace(found, srdf=srdf.read_text(encoding="utf-8", errors="replace"))
    near = [urdf.parent, *folders, *(each for one in given for each in repositories(one))]
    return replace(found, urdf=text, meshes=_meshes(path.parent, place, near, text))


def _arguments(given: Any) -> dict[str, str]:
    """Values of the arguments of a file with macros, as text."""
    if not isinstance(given, dict | None):
        raise InvalidArm("arguments", "arguments must have the values of <xacro:arg> by name.")
    # xacro reads `true`, not Python's `True`
    return {
        str(name): str(value).lower() if isinstance(value, bool) else str(value)
        for name, value in (given or {}).items()
    }


def _folder_of_packages(folder: Path, place: Any) -> list[Path]:
    """The folder `packages` of a description, relative to it; none without one."""
    if place is None:
        return []
    if not isinstance(place, str) or not (folder / place).is_dir():
        raise InvalidArm(
            "packages", "packages must be the path of a folder, relative to the description."
        )
    return [folder / place]


def _meshes(folder: Path, place: Any, near: Sequence[Path], urdf: str) -> dict[str, bytes]:
    """Mesh files at a path relative to the description, or in folders near the URDF without a
    path.
    """
    if place is None:
        found = dict[str, bytes]()
        for each in near:
            found = in_folder(each, urdf) | found
        return found
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
    return InvalidArm(
        place, f"{place or 'The file'}: {_MESSAGES.get(first['type'], first['msg'])}."
    )
