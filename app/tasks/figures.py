"""PUT /figures in a worker: the check of a document against the robot's own figures."""

from __future__ import annotations

from dataclasses import dataclass

from app.convert.arm import robot_named
from app.engine.result import TaskResult
from app.schemas.figures import FiguresDocument
from models.own_arm.robots import own_robot
from models.uncertainty.document import InvalidFigures, merged, replaced_in
from optimizer.exceptions import InvalidProblem


@dataclass(frozen=True)
class FiguresTask:
    """A document, and the request's id."""

    request: FiguresDocument
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """What takes the place of the robot's own figures, as JSON. `deadline` is not watched: it takes milliseconds.

        Raises UnknownRobot, or InvalidProblem, which names the place.
        """
        robot = robot_named(self.request.robot)
        try:
            content = replaced_in(robot.name, robot.figures, self.request.document())
            own_robot(robot.name, merged(robot.figures, content))
        except InvalidFigures as error:
            raise InvalidProblem(error.field or "robot", str(error)) from None
        return TaskResult.of_json(content)
