"""GET /robots/{name}/mjcf in a worker, which has the robot's model."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.app.convert.arm import robot_named
from joulepath.app.engine.result import TaskResult
from joulepath.models.mjcf import mjcf

MEDIA_TYPE = "application/xml"


@dataclass(frozen=True)
class MjcfTask:
    """The name of a robot, and the request's id."""

    robot: str
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The MJCF file. `deadline` is not watched: it takes milliseconds. Raises UnknownRobot."""
        return TaskResult(mjcf(robot_named(self.robot)).encode(), MEDIA_TYPE)
