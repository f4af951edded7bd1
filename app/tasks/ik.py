"""POST /ik in a worker, because its meshes may take seconds."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.app.convert.arm import robot_named
from joulepath.app.convert.ik import to_collision_arm, to_ik_response
from joulepath.app.convert.pose import to_base_pose, to_matrix
from joulepath.app.convert.until import until
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.ik import IKRequest
from joulepath.optimizer.collision.model import collision_model
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics


@dataclass(frozen=True)
class IKTask:
    """A validated request and its id."""

    request: IKRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /ik`, within about `deadline` seconds. Raises DeadlineExceeded."""
        with until(Deadline.after(deadline)):
            return self._solved()

    def _solved(self) -> TaskResult:
        request = self.request
        robot = robot_named(request.robot)
        kinematics = required_inverse_kinematics(robot, "pose")
        solutions = kinematics.solve(
            to_base_pose(request.pose, robot).T, to_matrix(request.tcp), robot.limits, request.windings, "goal"
        )
        model = collision_model(to_collision_arm(request, robot))
        contacts = model.closest_pairs([solution.q for solution in solutions])
        return TaskResult.of_json(
            to_ik_response(request, self.request_id, robot, solutions, contacts, kinematics.complete)
        )
