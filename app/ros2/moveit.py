"""MoveIt's service of motion plans, and its planning scene. Needs `moveit_msgs`."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from typing import Any, Protocol

from moveit_msgs.msg import PlanningScene as SceneMessage
from moveit_msgs.srv import GetMotionPlan
from sensor_msgs.msg import JointState

from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.ros2.messages import BASE_FRAMES, JointNames, Json, refusal
from joulepath.app.ros2.motion_plan import REQUEST, SUCCESS, error_code, request_of
from joulepath.app.ros2.parameters import Parameters
from joulepath.app.ros2.planner import Plan, Planner
from joulepath.app.ros2.planning_scene import PlanningScene
from joulepath.app.ros2.trajectory import trajectory_message
from joulepath.optimizer.deadline import Stopped
from joulepath.optimizer.exceptions import DeclaredError


class PlanServer(Protocol):
    """Methods of the planning node that the interface uses."""

    create_subscription: Callable[..., Any]
    create_service: Callable[..., Any]

    @property
    def planner(self) -> Planner | None:
        """The planner; None before the robot is known."""

    def outcome(self, fields: Callable[[], Json]) -> Awaitable[Plan | Exception | Stopped]:
        """The plan for the fields of a request, or the error of planning."""

    def refuse(self, error: DeclaredError) -> None:
        """Publish an error outside of any goal."""


class MoveitInterface:
    """The service `~/plan_kinematic_path` of a node, and its topic `planning_scene`."""

    def __init__(self, node: PlanServer, own: Parameters) -> None:
        """Serve for a node with these parameters."""
        self._node, self._own = node, own
        # UR's `base` is turned against `base_link`: objects must be in the latter
        frames = ("", own.prefix + BASE_FRAMES[1], own.base_frame)
        self.scene = PlanningScene(frames)
        node.create_subscription(SceneMessage, "planning_scene", self._on_scene, 10)
        node.create_service(GetMotionPlan, "~/plan_kinematic_path", self._on_request)

    def _on_scene(self, message: SceneMessage) -> None:
        try:
            self.scene.update(message)
        except InvalidRequest as error:
            self._node.refuse(error)

    async def _on_request(
        self, asked: GetMotionPlan.Request, response: GetMotionPlan.Response
    ) -> GetMotionPlan.Response:
        request, answer = asked.motion_plan_request, response.motion_plan_response
        began = time.perf_counter()
        plan = await self._node.outcome(lambda: self._fields(request))
        answer.planning_time = time.perf_counter() - began
        answer.group_name = request.group_name
        if not isinstance(plan, Plan):
            answer.error_code.val = error_code(plan)
            answer.error_code.message = str(plan) or "The plan was cancelled."
            return response
        trajectory = trajectory_message(plan.trajectory)
        answer.error_code.val = SUCCESS
        answer.trajectory.joint_trajectory = trajectory
        answer.trajectory_start.joint_state = JointState(
            name=trajectory.joint_names, position=trajectory.points[0].positions
        )
        return response

    def _fields(self, request: object) -> Json:
        planner, own = self._node.planner, self._own
        if planner is None:
            raise refusal((REQUEST,), "No robot is known yet: see the parameter `robot`.")
        names = JointNames(planner.joints, own.prefix)
        limits = {**planner.limits, **own.request().get("limits", {})}
        return request_of(request, names, limits, own.base_frame, own.tip_link)
