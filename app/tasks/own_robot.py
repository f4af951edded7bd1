"""POST /robots and PUT /robots/{name} in a worker, because no URDF is to end the service: figures of a user's arm."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.app.convert.own_arm import to_description
from joulepath.app.convert.until import until
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.own_arm import OwnArm
from joulepath.models.own_arm.description import InvalidArm
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.own_arm.robots import own_robot
from joulepath.optimizer.deadline import Deadline, checkpoint
from joulepath.optimizer.exceptions import InvalidProblem


@dataclass(frozen=True)
class OwnRobotTask:
    """A validated arm, its name, and the request's id."""

    name: str
    arm: OwnArm
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """`figures` and `warnings`, within about `deadline` seconds. Raises InvalidProblem or DeadlineExceeded."""
        try:
            with until(Deadline.after(deadline)):
                figures, warnings = own_figures(self.name, to_description(self.arm), checkpoint)
        except InvalidArm as error:
            raise InvalidProblem(error.field, str(error)) from None
        own_robot(self.name, figures)
        return TaskResult.of_json({"figures": figures, "warnings": warnings})
