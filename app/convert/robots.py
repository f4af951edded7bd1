"""Robots of requests: users' robots and identified figures come with the task."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from joulepath.app.convert.items import item
from joulepath.app.exceptions.stored import UnknownFigures
from joulepath.models.own_arm.robots import own_robot
from joulepath.models.robot import Robot
from joulepath.models.shape_sizes import WrongSize
from joulepath.models.uncertainty.document import merged
from joulepath.optimizer.exceptions import InvalidProblem


def own_robot_of(name: str, figures: dict[str, Any]) -> Robot:
    """The robot with the given figures.

    Raises:
        InvalidProblem: an earlier version stored a shape with invalid sizes.
    """
    try:
        return own_robot(name, figures)
    except WrongSize as error:
        raise InvalidProblem(
            "robot", f"The robot {name} cannot be used: {error} Add it again."
        ) from None


@dataclass(frozen=True)
class Identified:
    """Identified figures, replacing the robot's own."""

    robot: str
    content: dict[str, Any]


def with_figures(robot: Robot, id: str) -> Robot:
    """The robot with the figures of this id: the same object for the same content.

    Raises UnknownFigures for missing figures, and InvalidProblem for figures of another robot.
    """
    figures: Identified | None = item(("figures", id))
    if figures is None:
        raise UnknownFigures(id)
    if figures.robot != robot.name:
        raise InvalidProblem(
            "figures",
            f"These figures belong to the robot {figures.robot}: use this robot, or other figures.",
        )
    try:
        return own_robot(robot.name, merged(robot.figures, figures.content))
    except (ValueError, KeyError):
        raise InvalidProblem(
            "figures",
            "These figures no longer fit the robot, which was replaced: identify them again.",
        ) from None
