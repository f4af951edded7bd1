"""POST /ik/path in a worker."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.app.convert.arm import robot_named
from joulepath.app.convert.fields import fields
from joulepath.app.convert.pose import to_base, to_base_pose, to_matrix
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.ik_path import IKPathRequest
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.kinematics.path_following import follow
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class IKPathTask:
    """A validated request and its id."""

    request: IKPathRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /ik/path`, with the points that were tried within about `deadline` seconds."""
        end = Deadline.after(deadline)
        request = self.request
        arm = Arm(robot=robot_named(request.robot), T_flange_tcp=to_matrix(request.tcp))
        T_base_frame = to_base(request.frame, arm.robot)
        targets = (
            np.array(request.points) @ T_base_frame[:3, :3].T + T_base_frame[:3, 3]
            if request.points is not None
            else [to_base_pose(pose, arm.robot) for pose in request.poses or []]
        )
        found = follow(arm, targets, np.array(request.guess), request.tolerance, request.near_singular, end)
        written = [(t, point.q) for t, point in zip(request.t, found, strict=True) if point.written]
        names = ("q", "position_error", "rotation_error", "smallest_singular_value", "reached", "written", "reason")
        return TaskResult.of_json(
            {
                "request": self.request_id,
                "id": None,
                "robot": request.robot,
                "trajectory": {"t": [t for t, _ in written], "q": [q for _, q in written]},
                "points": [{"t": t, **fields(point, *names)} for t, point in zip(request.t, found, strict=True)],
            }
        )
