"""URDFs from files with xacro macros, and the folders of ROS packages.

xacro evaluates expressions in the file. Therefore only files named by the user of this machine are
expanded, never files in a request to the service.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from joulepath.models.own_arm.description import InvalidArm

SUFFIX = ".xacro"
"""End of the name of a file with macros."""
MANIFEST = "package.xml"
"""File at the root of a ROS package."""


def expanded(path: Path, arguments: Mapping[str, str], folders: Sequence[Path]) -> str:
    """Expand a file with xacro macros.

    Args:
        path: the file.
        arguments: values of its <xacro:arg> by name.
        folders: folders searched for packages by `$(find …)`, besides the package of the file.

    Returns:
        The URDF.

    Raises:
        InvalidArm: the file cannot be expanded, or the package `xacrodoc` is not installed.
    """
    try:
        import xacro
        from xacrodoc import packages
    except ImportError:
        raise InvalidArm(
            "urdf",
            f"{path.name} is xacro: install joulepath[xacro], which expands it, or make a URDF of "
            f"it by `xacro {path.name} > arm.urdf`.",
        ) from None
    packages.reset()
    packages.look_in([str(each) for each in folders])
    packages.walk_up_from(path)
    try:
        return str(xacro.process_file(str(path), mappings=dict(arguments)).toxml())
    except Exception as error:  # xacro and the expressions of the file raise many kinds
        missing = isinstance(error.__context__, packages.PackageNotFoundError)
        cause = error.__context__ if missing else error
        raise InvalidArm(
            "urdf",
            f"xacro cannot expand {path.name}: {cause}. Give the folder of missing packages in "
            "`packages`, and values of arguments in `arguments`.",
        ) from None


def package_folders(path: Path) -> list[Path]:
    """Folder of the ROS package of a file, and its parent; empty outside of packages."""
    for folder in path.resolve().parents:
        if (folder / MANIFEST).is_file():
            return [folder, folder.parent]
    return []


def repositories(folder: Path) -> list[Path]:
    """Folders with ROS packages below a folder, such as the repositories of a workspace."""
    found, seen = list[Path](), set[str]()
    for place, inner, files in os.walk(folder, followlinks=True):
        is_package = MANIFEST in files
        if is_package and Path(place).parent not in found:
            found.append(Path(place).parent)
        # Packages do not contain packages, and symbolic links may form a circle.
        is_known = os.path.realpath(place) in seen
        seen.add(os.path.realpath(place))
        inner[:] = [] if is_package or is_known else [n for n in sorted(inner) if n[0] != "."]
    return found
