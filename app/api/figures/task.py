"""PUT /figures in a worker: the check of a document against the robot's own figures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from joulepath.app.api.figures.request import FiguresDocument
from joulepath.app.convert.arm import robot_named
from joulepath.app.engine.result import TaskResult
from joulepath.models.own_arm.robots import own_robot
from joulepath.models.uncertainty.document import InvalidFigures, merged, replaced_in
from joulepath.optimizer.exceptions import InvalidProblem


@dataclass(frozen=True)
class FiguresTask:
    """A document, and the request's id."""

    request: FiguresDocument
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The replacing figures as JSON, in milliseconds without a watch on `deadline`.

        Raises UnknownRobot, or InvalidProblem with the place.
        """
        return TaskResult.of_json(replacing(self.request.robot, self.request.document()))


def replacing(name: str, document: dict[str, Any]) -> dict[str, Any]:
    """Figures of a document replacing the robot's own. Raises UnknownRobot or InvalidProblem."""
    robot = robot_named(name)
    try:
        content = replaced_in(robot.name, robot.figures, document)
        own_robot(robot.name, merged(robot.figures, content))
    except InvalidFigures as error:
        raise InvalidProblem(error.field or "robot", str(error)) from None
    return content
