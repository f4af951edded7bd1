"""The own robot of a request, whose figures accompany the task from the database."""

from __future__ import annotations

from contextlib import AbstractContextManager
from contextvars import ContextVar
from typing import Any

from joulepath.models.own_arm.robots import own_robot
from joulepath.models.robot import Robot
from joulepath.models.shape_sizes import WrongSize
from joulepath.optimizer.context_value import assigned
from joulepath.optimizer.exceptions import InvalidProblem

_ROBOT: ContextVar[tuple[str, dict[str, Any]] | None] = ContextVar("own robot", default=None)


def own_robot_named(name: str, figures: dict[str, Any]) -> AbstractContextManager[None]:
    """Within the context, and its thread, requests may name this robot."""
    return assigned(_ROBOT, (name, figures))


def own_figures_of(name: str) -> dict[str, Any] | None:
    """Figures of the own robot of this name; None without them."""
    robot = _ROBOT.get()
    return robot[1] if robot is not None and robot[0] == name else None


def own_robot_of(name: str, figures: dict[str, Any]) -> Robot:
    """The robot of these figures. Raises InvalidProblem for invalid shapes of earlier versions."""
    try:
        return own_robot(name, figures)
    except WrongSize as error:
        raise InvalidProblem(
            "robot", f"The robot {name} cannot be used: {error} Add it again."
        ) from None
