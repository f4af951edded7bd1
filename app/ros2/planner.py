"""Plans for the node: computed in this process, or by a service."""

from __future__ import annotations

import threading
import uuid
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from queue import SimpleQueue
from typing import Protocol

import orjson
from pydantic import ValidationError

from joulepath.app.api.optimize.task import OptimizeTask
from joulepath.app.client.client import Client
from joulepath.app.convert.arm import robot_named, to_arm
from joulepath.app.convert.items import given
from joulepath.app.engine.result import json_document
from joulepath.app.http.problems import invalid_request
from joulepath.app.ros2.messages import Json
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.models.own_arm.description import Description, InvalidArm
from joulepath.models.own_arm.figures import own_figures
from joulepath.optimizer.deadline import Stopped, stoppable
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.export.program import Move, Program
from joulepath.optimizer.export.quintic_points import quintic_points
from joulepath.optimizer.export.ros_messages import joint_trajectory

DESCRIBED = "robot_description"
"""Name of the robot of a URDF on the topic of this name."""
POLL = 0.02
"""Time between two looks for a cancellation while a service computes [s]."""


@dataclass(frozen=True)
class Plan:
    """A planned motion.

    Attributes:
        answer: answer of `POST /optimize`.
        trajectory: fields of trajectory_msgs/msg/JointTrajectory.
    """

    answer: Json
    trajectory: Json


class Planner(Protocol):
    """Computes plans for one robot."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the robot's joints, from base to tip."""
        ...

    @property
    def limits(self) -> Mapping[str, list[float]]:
        """Limits on `velocity` [rad/s] and `acceleration` [rad/s²] of the joints."""
        ...

    def plan(self, body: Json, is_stopped: Callable[[], bool]) -> Plan:
        """The plan for a body of `POST /optimize`.

        Raises:
            DeclaredError: there is no plan.
            Stopped: the plan is of no use any more.
        """
        ...


class LocalPlanner:
    """Computes plans in this process by the library."""

    def __init__(self, robot: str, prefix: str = "", figures: Json | None = None) -> None:
        """Load a robot.

        Args:
            robot: its name.
            prefix: prefix of the joint names in trajectories.
            figures: figures of a robot that does not come with the library.

        Raises:
            UnknownRobot: no robot has this name.
        """
        self._prefix, self._figures, self._name = prefix, figures, robot
        with self._known():
            found = robot_named(robot)
        self.joints: tuple[str, ...] = tuple(found.joint_names)
        self.limits = {
            "velocity": found.limits.v_max.tolist(),
            "acceleration": found.limits.a_max.tolist(),
        }

    @classmethod
    def of_description(cls, arm: Description, prefix: str = "") -> LocalPlanner:
        """A planner for the arm in a URDF; figures that are not given are engineering defaults.

        Args:
            arm: the URDF, and what it does not have.
            prefix: prefix of all joint names in it.

        Raises:
            InvalidProblem: the description makes no robot.
        """
        try:
            figures, _ = own_figures(DESCRIBED, arm)
        except InvalidArm as error:
            raise InvalidProblem(DESCRIBED, str(error)) from None
        planner = cls(DESCRIBED, "", figures)
        planner.joints = tuple(joint.removeprefix(prefix) for joint in planner.joints)
        return planner

    def plan(self, body: Json, is_stopped: Callable[[], bool]) -> Plan:
        """The plan for a body of `POST /optimize`."""
        try:
            request = OptimizeRequest.model_validate(body | {"robot": self._name})
        except ValidationError as error:
            raise invalid_request(error, "body") from None
        with self._known(), stoppable(is_stopped):
            answer = OptimizeTask(request, str(uuid.uuid4())).answer(request.deadline)
            arm = to_arm(request)
        program = Program((Move(answer.trajectory.spline, arm),))
        points = quintic_points(program, "ros2")
        return Plan(
            orjson.loads(json_document(answer)), joint_trajectory(program, points, self._prefix)
        )

    def _known(self) -> AbstractContextManager[None]:
        if self._figures is None:
            return nullcontext()
        return given({("robot", self._name): self._figures})


class RemotePlanner:
    """Lets a service compute the plans."""

    def __init__(self, client: Client, robot: str, prefix: str = "") -> None:
        """Ask the service for the robot's joints.

        Args:
            client: connection to the service.
            robot: name of a robot that the service has.
            prefix: prefix of the joint names in trajectories.

        Raises:
            UnknownRobot: the service has no robot of this name.
            ServiceUnreachable: no service answers.
        """
        self._client, self._robot, self._prefix = client, robot, prefix
        found = client.get(f"/robots/{robot}")
        self.joints: tuple[str, ...] = tuple(found["joints"])
        self.limits = {
            name: found["limits"][name]["value"] for name in ("velocity", "acceleration")
        }

    def plan(self, body: Json, is_stopped: Callable[[], bool]) -> Plan:
        """The plan for a body of `POST /optimize`."""
        done: SimpleQueue[Plan | Exception] = SimpleQueue()
        work = partial(self._answer, body | {"robot": self._robot}, done)
        # a thread of its own: nothing waits for the answer of a cancelled request
        request = threading.Thread(target=work, daemon=True)
        request.start()
        while request.is_alive():
            if is_stopped():
                raise Stopped
            request.join(POLL)
        result = done.get()
        if isinstance(result, Exception):
            raise result
        return result

    def _answer(self, body: Json, done: SimpleQueue[Plan | Exception]) -> None:
        try:
            answer = self._client.optimize(body)
            options = {"message": "trajectory", "encoding": "json", "prefix": self._prefix}
            file = self._client.export(answer, "ros2", ros2=options)
            done.put(Plan(answer, orjson.loads(file)["msg"]))
        except Exception as error:
            done.put(error)
