"""URDFs from files with xacro macros, and the folders of ROS packages.

xacro evaluates the file's expressions, so files are expanded that the user of this machine names:
never those of a request to the service.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from joulepath.models.own_arm.description import InvalidArm

SUFFIX = ".xacro"
"""End of the name of a file with macros."""
MANIFEST = "package.xml"
"""File at the root of a ROS package."""


def expanded(path: Path, arguments: Mapping[str, str], folders: Sequence[Path]) -> str:
    """The URDF that a file with macros stands for.

    Args:
        path: the file.
        arguments: values of its <xacro:arg> by name.
        folders: folders in which `$(find …)` looks for packages, beside the package of the file.

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
        raise InvalidArm(
            "urdf",
            f"xacro does not expand {path.name}: {error}. Give the folder of missing packages in "
            "`packages`, and values of arguments in `arguments`.",
        ) from None


def package_folders(path: Path) -> list[Path]:
    """The ROS package that a file belongs to, and the folder of it; none outside of packages."""
    for folder in path.resolve().parents:
        if (folder / MANIFEST).is_file():
            return [folder, folder.parent]
    return []
