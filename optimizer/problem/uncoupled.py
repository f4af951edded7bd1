"""Check for requests without support for coupled joints."""

from __future__ import annotations

from joulepath.models.robot import Robot
from joulepath.optimizer.exceptions import InvalidProblem


def check_uncoupled(robot: Robot, field: str, what: str) -> None:
    """Refuse an arm with follower joints, as in a parallelogram.

    Args:
        robot: the robot of the arm.
        field: field named in the error.
        what: the unsupported request, as the beginning of the message.

    Raises:
        InvalidProblem: a joint of the robot follows another joint.
    """
    if robot.coupling.follows:
        raise InvalidProblem(
            field,
            f"{what} for {robot.name}: some of its joints follow others, as in a parallelogram. "
            "Motions between joint positions and poses, cycles of them, and evaluations are "
            "computed for such arms.",
        )
