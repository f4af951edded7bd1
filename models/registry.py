"""Robots by name: a robot is a folder of this package with a file of figures."""

from __future__ import annotations

import threading
from functools import cache
from importlib.resources import files
from typing import Any

import yaml

from joulepath.models.from_figures import robot_of
from joulepath.models.robot import Robot

# libyaml, if PyYAML has it, is ten times as fast
LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
FIGURES = "figures.yaml"


@cache
def robot_names() -> tuple[str, ...]:
    """Names of the robots that come with the library, for `load_robot`.

    Returns:
        The names in alphabetical order.
    """
    return tuple(
        sorted(
            folder.name
            for folder in files("joulepath.models").iterdir()
            if (folder / FIGURES).is_file()
        )
    )


_LOADING = threading.Lock()


def bundled_robot(name: str) -> Robot:
    """The robot of this name that comes with the library.

    It is loaded once per process: all threads get the same object. Raises LookupError for an
    unknown name.
    """
    # Robots are compared by identity, but `cache` alone would let two threads load one twice.
    with _LOADING:
        return _bundled_robot(name)


@cache
def _bundled_robot(name: str) -> Robot:
    return robot_of(name, load_figures(name))


def load_figures(name: str) -> dict[str, Any]:
    """The content of the robot's figures.yaml: section, figure, then value, unit, source, trust,
    note.

    Raises LookupError for an unknown name.
    """
    if name not in robot_names():
        raise LookupError(
            f"There is no robot named {name!r}: use one of {', '.join(robot_names())}."
        )
    text = (files("joulepath.models") / name / FIGURES).read_text(encoding="utf-8")
    figures: dict[str, Any] = yaml.load(text, Loader=LOADER)
    return figures
