"""Requests that do not model arms with joints that follow others."""

from __future__ import annotations

from joulepath.models.robot import Robot
from joulepath.optimizer.exceptions import InvalidProblem


def check_uncoupled(robot: Robot, field: str, what: str) -> None:
    """Raises InvalidProblem for an arm with joints that follow others, which `what` does not
    model.
    """
    if robot.coupling.follows:
        raise InvalidProblem(
            field,
            f"{what} for {robot.name}: some of its joints follow others, as in a parallelogram. "
            "Motions between joint positions and poses, cycles of them, and evaluations are "
            "computed for such arms.",
        )
