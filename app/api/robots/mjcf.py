"""GET /robots/{name}/mjcf in a worker with the loaded model of the robot."""

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
        """The MJCF file, written within milliseconds regardless of `deadline`.

        Raises:
            UnknownRobot: no robot has this name.
        """
        return TaskResult(mjcf(robot_named(self.robot)).encode(), MEDIA_TYPE)
