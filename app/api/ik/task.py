"""Request and answer of `POST /ik`, and its work in a worker: meshes may take seconds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from joulepath.app.answers.envelope import Answer
from joulepath.app.convert.arm import robot_named
from joulepath.app.convert.request import to_target_pose
from joulepath.app.convert.scene import to_attachment, to_scene
from joulepath.app.convert.tool import to_tcp, to_tool
from joulepath.app.convert.until import until
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.common import described
from joulepath.app.schemas.deadline import DeadlineSeconds
from joulepath.app.schemas.examples.values import BOX
from joulepath.app.schemas.orientation import TargetPose
from joulepath.app.schemas.scene import CarriedBody, CellRequest
from joulepath.models.robot import Robot
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.inverse_kinematics import IKSolution, IKSolutions, inverse_kinematics
from joulepath.optimizer.problem.arm import Arm, Payload


class IKRequest(CellRequest):
    """A pose of the TCP."""

    pose: TargetPose = described(
        "Pose of the TCP in the robot's base frame, or in its `frame`. Its orientation may be free "
        "in part.",
        None,
        {"position": [0.4, -0.2, 0.3], "quaternion": [0, 1, 0, 0]},
    )
    windings: bool = described(
        "Whether to return all full-turn alternatives q + 2πk within the joint range. If false: "
        "one solution per branch, the one nearest to zero.",
        None,
        True,
        default=True,
    )
    payload: CarriedBody | None = described(
        "Payload at the flange, for collision checking. Null: no payload.",
        None,
        {"shape": BOX},
        default=None,
    )
    deadline: DeadlineSeconds = described(
        "Wall time from the arrival of the request, including the wait for a worker.",
        "s",
        10.0,
        default=10.0,
    )


@dataclass(frozen=True, kw_only=True)
class IKAnswer(Answer):
    """All arm configurations of the pose within the joint ranges."""

    solutions: tuple[IKSolution, ...]
    """One entry per configuration."""
    complete: bool
    """Whether the solutions contain every branch. False for an arm without a complete inverse, and
    for an orientation that is free in part: some may be missing."""


@dataclass(frozen=True)
class IKTask:
    """A validated request and its id; the media type of the answer is `wanted`."""

    request: IKRequest
    request_id: str
    wanted: Literal["json", "csv"] = "json"

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /ik`, within about `deadline` seconds. Raises DeadlineExceeded."""
        request, end = self.request, Deadline.after(deadline)
        with until(end):
            robot = robot_named(request.robot)
            arm, pose = to_ik_arm(request, robot), to_target_pose(request.pose, robot)
        found = inverse_kinematics(arm, pose, request.windings, end.left)
        if self.wanted == "csv":
            return TaskResult.of_csv(_rows(found, robot.nq))
        answer = IKAnswer(
            request=self.request_id,
            robot=request.robot,
            solutions=found.solutions,
            complete=found.complete,
        )
        return TaskResult.of_json(answer)


def _rows(found: IKSolutions, nq: int) -> list[list[Any]]:
    """Rows with the columns q1 … qn [rad], one per configuration, for `POST /evaluate`."""
    return [[f"q{joint}" for joint in range(1, nq + 1)], *(each.q.tolist() for each in found)]


def to_ik_arm(request: IKRequest, robot: Robot) -> Arm:
    """The arm with its TCP, and its shapes for collision checking. Raises InvalidProblem."""
    carried = request.payload
    return Arm(
        robot=robot,
        T_flange_tcp=to_tcp(request.tcp, request.tool),
        tool=to_tool(request.tool),
        payload=Payload(
            shape=None if carried is None else to_attachment(carried.shape, carried.touches)
        ),
        scene=to_scene(request.scene, robot),
    )
