"""The description of an arm in a YAML file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import yaml
from pydantic import ConfigDict, TypeAdapter, ValidationError

from models.own_arm.description import Collision, Description, Drives, Electronics, InvalidArm, Motion

# no conversion of types, no unknown fields
for _part in (Collision, Description, Drives, Electronics, Motion):
    _part.__pydantic_config__ = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)  # type: ignore[union-attr]
_DESCRIPTION = TypeAdapter(Description)


def read_description(path: Path) -> Description:
    """The description in a YAML file, whose `urdf` is the path of the URDF, relative to the file.

    Raises InvalidArm, which names the field; OSError if there is no such file.
    """
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
        # as JSON, whose lists are tuples to the validator
        found = _DESCRIPTION.validate_json(json.dumps(data))
    except (yaml.YAMLError, UnicodeDecodeError, TypeError) as error:
        raise InvalidArm("", f"{path.name} is no description in YAML: {error}") from None
    except ValidationError as error:
        raise _first(error) from None
    urdf = path.parent / found.urdf
    if not urdf.is_file():
        raise InvalidArm("urdf", f"There is no file {urdf}: give the path of the URDF, relative to {path.name}.")
    text: dict[str, Any] = {"urdf": urdf.read_text(encoding="utf-8", errors="replace")}
    return type(found)(**(vars(found) | text))


def _first(error: ValidationError) -> InvalidArm:
    """The first fault, with its place in the words of the file."""
    first = error.errors(include_url=False)[0]
    # a union's members are no places
    place = ".".join(str(part) for part in first["loc"] if "[" not in str(part) and part != "float")
    return InvalidArm(place, f"{place or 'The file'}: {first['msg']}.")
