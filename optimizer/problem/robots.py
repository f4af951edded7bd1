"""Robots of the library, and users' own arms."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

import yaml

from joulepath.models.registry import LOADER, bundled_robot, robot_names
from joulepath.models.robot import Robot
from joulepath.optimizer.exceptions import UnknownRobot
from joulepath.optimizer.problem.declared_types import check_type

DESCRIPTIONS = (".yaml", ".yml")
"""File extensions of descriptions of own arms."""


def load_robot(
    robot: str | PathLike[str], figures: str | PathLike[str] | dict[str, Any] | None = None
) -> Robot:
    """Load a robot that comes with the library, or a user's own arm.

    A robot is loaded once per process: all threads get the same object. Its arrays and figures are
    read-only; its Pinocchio model is not.

    Args:
        robot: one of `robot_names()`, or the path of a YAML file that describes an own arm; see
            docs/reference/own_robot.md.
        figures: figures identified on one arm of this robot: their document, or the path of one in
            YAML; see docs/reference/identification.md.

    Returns:
        The robot, with its model, limits and figures.

    Raises:
        UnknownRobot: no robot has this name.
        InvalidProblem: `robot` or `figures` has another type.
        InvalidArm: the description makes no robot; the error names the field.
        InvalidFigures: the figures do not fit the robot.
        OSError: a file cannot be read.
    """
    if figures is not None:
        return _identified(load_robot(robot), figures)
    check_type("robot", robot, str, PathLike)
    if isinstance(robot, PathLike) or robot.endswith(DESCRIPTIONS):
        from joulepath.models.own_arm.robots import (
            read_robot,  # importing its validator takes as long as the rest of this package
        )

        return read_robot(Path(robot))
    if robot not in robot_names():
        raise UnknownRobot(robot, list(robot_names()))
    return bundled_robot(robot)


def _identified(robot: Robot, figures: str | PathLike[str] | dict[str, Any]) -> Robot:
    """The robot with the figures of a document or file.

    Raises:
        InvalidProblem: `figures` is neither a document nor a path.
        InvalidFigures: they do not fit the robot.
        OSError: the file cannot be read.
    """
    from joulepath.models.own_arm.robots import own_robot  # as above
    from joulepath.models.uncertainty.document import with_document

    check_type("figures", figures, dict, str, PathLike)
    document = figures if isinstance(figures, dict) else _read_document(Path(figures))
    return own_robot(robot.name, with_document(robot.name, robot.figures, document))


def _read_document(path: Path) -> Any:
    from joulepath.models.uncertainty.document import InvalidFigures

    try:
        return yaml.load(path.read_text(encoding="utf-8"), Loader=LOADER)
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InvalidFigures("", f"{path.name} is no YAML: {error}") from None
