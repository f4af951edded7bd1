"""Robots by name: a robot is a folder of this package with a file of figures."""

from __future__ import annotations

import threading
from functools import cache
from importlib.resources import files
from os import PathLike
from pathlib import Path
from typing import Any

import yaml

from joulepath.models.from_figures import robot_of
from joulepath.models.robot import Robot

# libyaml, if PyYAML has it, is ten times as fast
LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
FIGURES = "figures.yaml"
# file extensions of descriptions of own arms
DESCRIPTIONS = (".yaml", ".yml")


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


def load_robot(
    robot: str | PathLike[str], figures: str | PathLike[str] | dict[str, Any] | None = None
) -> Robot:
    """Load a robot that comes with the library, or a user's own arm.

    A robot is loaded once per process: all threads get the same object.

    Args:
        robot: one of `robot_names()`, or the path of a YAML file that describes an own arm; see
            docs/reference/own_robot.md.
        figures: figures identified on one arm of this robot: their document, or the path of one in
            YAML; see docs/reference/identification.md.

    Returns:
        The robot, with its model, limits and figures.

    Raises:
        LookupError: no robot has this name.
        InvalidArm: the description makes no robot; the error names the field.
        InvalidFigures: the figures do not fit the robot.
        OSError: a file cannot be read.
    """
    if figures is not None:
        return _identified(load_robot(robot), figures)
    if isinstance(robot, PathLike) or robot.endswith(DESCRIPTIONS):
        from joulepath.models.own_arm.robots import (
            read_robot,  # importing its validator takes as long as the rest of this package
        )

        return read_robot(Path(robot))
    # Robots are compared by identity, but `cache` alone would let two threads load one twice.
    with _LOADING:
        return _load_robot(robot)


def _identified(robot: Robot, figures: str | PathLike[str] | dict[str, Any]) -> Robot:
    """The robot with the figures of a document or file. Raises InvalidFigures or OSError."""
    from joulepath.models.own_arm.robots import own_robot  # as above
    from joulepath.models.uncertainty.document import with_document

    document = figures if isinstance(figures, dict) else _read_document(Path(figures))
    return own_robot(robot.name, with_document(robot.name, robot.figures, document))


def _read_document(path: Path) -> Any:
    from joulepath.models.uncertainty.document import InvalidFigures

    try:
        return yaml.load(path.read_text(encoding="utf-8"), Loader=LOADER)
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InvalidFigures("", f"{path.name} is no YAML: {error}") from None


@cache
def _load_robot(name: str) -> Robot:
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
