"""Robots of requests: users' robots and identified figures come with the task."""

from __future__ import annotations

from contextlib import AbstractContextManager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

from joulepath.app.exceptions.stored import UnknownFigures
from joulepath.models.own_arm.robots import own_robot
from joulepath.models.robot import Robot
from joulepath.models.shape_sizes import WrongSize
from joulepath.models.uncertainty.document import merged
from joulepath.optimizer.context_value import assigned
from joulepath.optimizer.exceptions import InvalidProblem

_ROBOT: ContextVar[tuple[str, dict[str, Any]] | None] = ContextVar("own robot", default=None)


def own_robot_named(name: str, figures: dict[str, Any]) -> AbstractContextManager[None]:
    """A context for requests with the given own robot, in the current thread only."""
    return assigned(_ROBOT, (name, figures))


def own_figures_of(name: str) -> dict[str, Any] | None:
    """Figures of the own robot with the given name; None if the context has no such robot."""
    robot = _ROBOT.get()
    return robot[1] if robot is not None and robot[0] == name else None


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
    """Identified figures by their id, replacing the robot's own."""

    id: str
    robot: str
    content: dict[str, Any]


_FIGURES: ContextVar[Identified | None] = ContextVar("identified figures", default=None)


def identified_as(figures: Identified) -> AbstractContextManager[None]:
    """Within the context, and its thread, requests may name these figures."""
    return assigned(_FIGURES, figures)


def with_figures(robot: Robot, id: str) -> Robot:
    """The robot with the figures of this id: the same object for the same content.

    Raises UnknownFigures for missing figures, and InvalidProblem for figures of another robot.
    """
    figures = _FIGURES.get()
    if figures is None or figures.id != id:
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
