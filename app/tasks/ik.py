"""POST /ik in a worker, because its meshes may take seconds."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.app.convert.arm import robot_named
from joulepath.app.convert.ik import to_ik_arm, to_ik_response
from joulepath.app.convert.pose import to_base_pose
from joulepath.app.convert.until import until
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.ik import IKRequest
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.inverse_kinematics import inverse_kinematics


@dataclass(frozen=True)
class IKTask:
    """A validated request and its id."""

    request: IKRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /ik`, within about `deadline` seconds. Raises DeadlineExceeded."""
        request, end = self.request, Deadline.after(deadline)
        with until(end):
            robot = robot_named(request.robot)
            arm, pose = to_ik_arm(request, robot), to_base_pose(request.pose, robot)
        found = inverse_kinematics(arm, pose, request.windings, end.left)
        return TaskResult.of_json(to_ik_response(request, self.request_id, found))
