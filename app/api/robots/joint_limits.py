"""GET /robots/{name}/joint_limits in a worker, which proves the limits."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from joulepath.app.api.export.request import LimitsOptions
from joulepath.app.convert.arm import robot_named
from joulepath.app.convert.until import until
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.common import described
from joulepath.app.schemas.queries import Query
from joulepath.models.robot import MOST_ROBOTS, Robot
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.joint_limits.joint_limits import JointLimits, joint_limits
from joulepath.optimizer.problem.arm import Arm, Payload

MEDIA_TYPE = "application/yaml"


class JointLimitsQuery(LimitsOptions, Query):
    """The payload, and the prefix of the joints."""

    mass: float | None = described(
        "Largest mass of the payload. Null: the rated one.", "kg", 2.0, default=None, ge=0
    )
    distance: float = described(
        "Distance of its centre of mass from the flange, along the flange's z axis.",
        "m",
        0.1,
        default=0.0,
        ge=0,
        le=2,
    )


@dataclass(frozen=True)
class JointLimitsTask:
    """The name of a robot, the query, and the request's id."""

    robot: str
    asked: JointLimitsQuery
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The file. Raises UnknownRobot, InvalidProblem, NoJointLimits or DeadlineExceeded."""
        with until(Deadline.after(deadline)):
            found = proven_limits(robot_named(self.robot), self.asked.mass, self.asked.distance)
        return TaskResult(found.to_yaml(self.asked.prefix).encode(), MEDIA_TYPE)


@lru_cache(MOST_ROBOTS)
def proven_limits(robot: Robot, mass: float | None, distance: float) -> JointLimits:
    """The limits of a robot, kept because the proof for seven joints takes seconds.

    Args:
        robot: the robot.
        mass: largest mass of the payload [kg]; None for the rated one.
        distance: distance of its centre of mass from the flange [m].

    Raises:
        InvalidProblem: the mass exceeds the rating.
        NoJointLimits: gravity leaves too little torque.
    """
    payload = Payload(robot.rated_payload if mass is None else mass, np.array([0.0, 0.0, distance]))
    arm = Arm(robot=robot, payload=payload)
    arm.check_rating("mass", payload.mass)
    return joint_limits(arm)
