"""POST /robots and PUT /robots/{name} in a worker, because no URDF is to end the service: figures
of a user's arm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from joulepath.app.api.robots.request import OwnArm
from joulepath.app.convert.fields import decoded, location
from joulepath.app.convert.until import until
from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.base import FieldError, InvalidRequest
from joulepath.app.http.problems import MOST_ERRORS
from joulepath.models.own_arm.description import Description, InvalidArm
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.own_arm.mesh_files import in_zip
from joulepath.models.own_arm.reading import DESCRIPTION
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
        """`figures` and `warnings`, within about `deadline` seconds. Raises InvalidRequest or
        DeadlineExceeded.
        """
        try:
            with until(Deadline.after(deadline)):
                figures, warnings = own_figures(self.name, to_description(self.arm), checkpoint)
        except InvalidArm as error:
            raise invalid_arm(error) from None
        own_robot(self.name, figures)
        return TaskResult.of_json({"figures": figures, "warnings": warnings})


def invalid_arm(error: InvalidArm) -> InvalidRequest:
    """The error of a request with the field and message of every problem."""
    problems = [InvalidProblem(field, message) for field, message in error.problems[:MOST_ERRORS]]
    errors = [FieldError(loc=location(each, "body"), msg=str(each)) for each in problems]
    return InvalidRequest(errors, str(problems[0])) if len(errors) == 1 else InvalidRequest(errors)


def to_description(arm: OwnArm) -> Description:
    """The description of the library. Raises InvalidArm or InvalidProblem for meshes that are no
    zip, and DeadlinePassed once a watched deadline has passed."""
    fields = arm.model_dump_json(exclude={"name", "meshes"})
    meshes = None if arm.meshes is None else in_zip(decoded(arm.meshes, "meshes"), checkpoint)
    return replace(DESCRIPTION.validate_json(fields), meshes=meshes)
