"""Tools by name: a tool is a YAML file of this package with the figures of one gripper."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Any

import yaml

from joulepath.models.registry import LOADER

_ENDING = ".yaml"
FIGURES = ("mass", "center_of_mass", "inertia", "tcp", "capsules")
"""Names of the figures of every tool."""
HULL_FIGURES = ("hulls", "hull_radius")
"""Names of further figures of tools with public meshes."""


@cache
def tool_names() -> tuple[str, ...]:
    """Names of the bundled tools for `load_tool`.

    Returns:
        The names in alphabetical order.
    """
    names = (each.name for each in files("joulepath.models.tools").iterdir())
    return tuple(sorted(name.removesuffix(_ENDING) for name in names if name.endswith(_ENDING)))


@cache
def tool_figures(name: str) -> dict[str, Any]:
    """The figures of a tool of `tool_names()`: `title`, and all figures with value, unit, source,
    trust and note.
    """
    text = (files("joulepath.models.tools") / f"{name}{_ENDING}").read_text(encoding="utf-8")
    figures: dict[str, Any] = yaml.load(text, Loader=LOADER)
    return figures
