"""Request and answer of `POST /ik/path`, and its work in a worker."""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.answers.envelope import Answer
from joulepath.app.convert.arm import robot_named
from joulepath.app.convert.pose import to_base, to_base_pose
from joulepath.app.convert.tool import to_tcp
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.common import (
    BasePose,
    Frame,
    JointPositions,
    RobotWithTcp,
    Vector3,
    described,
    frame_of,
)
from joulepath.app.schemas.deadline import DeadlineSeconds
from joulepath.app.schemas.examples.values import HOME
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.declared import PerSample, PerSampleAndJoint, Seconds, Unit
from joulepath.optimizer.kinematics.tool_path.path_following import PathPoint, follow
from joulepath.optimizer.problem.arm import Arm

MOST_PATH_POINTS = 1000
"""Largest number of points of a path."""


class IKPathRequest(RobotWithTcp):
    """Positions or poses of the TCP over time, as exactly one of `points` and `poses`."""

    t: Annotated[
        list[Annotated[float, Field(ge=0, le=1e6)]],
        Field(min_length=1, max_length=MOST_PATH_POINTS),
    ] = described(
        "Time of each point; each later than the previous one by 1 µs or more.",
        "s",
        [0.0, 0.5, 1.0],
    )
    points: Annotated[list[Vector3], Field(min_length=1, max_length=MOST_PATH_POINTS)] | None = (
        described(
            "Positions [x, y, z] of the TCP in `frame`. The orientation is free.",
            "m",
            [[0.45, -0.15, 0.35], [0.45, 0.0, 0.4], [0.45, 0.15, 0.35]],
            default=None,
        )
    )
    frame: Frame = frame_of("`points`; each of `poses` has its own")
    poses: Annotated[list[BasePose], Field(min_length=1, max_length=MOST_PATH_POINTS)] | None = (
        described(
            "Poses of the TCP, each in the robot's base frame or in its `frame`.",
            None,
            [{"position": [0.4, -0.2, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}],
            default=None,
        )
    )
    guess: JointPositions = described(
        "Initial guess of the joint positions for the first point.", "rad", HOME
    )
    tolerance: float = described(
        "Largest error of a point that counts as reached. It applies to the position and, for "
        "poses, to the rotation.",
        "m, rad",
        1e-6,
        default=1e-6,
        ge=1e-9,
        le=0.1,
    )
    near_singular: float = described(
        "A configuration is left out if the smallest singular value of the TCP's Jacobian is below "
        "this.",
        "1",
        0.01,
        default=0.01,
        ge=0,
        le=1,
    )
    deadline: DeadlineSeconds = described(
        "Wall time from the arrival of the request, including the wait for a worker. After it, no "
        "further point is tried.",
        "s",
        10.0,
        default=10.0,
    )

    @model_validator(mode="after")
    def _one_path(self) -> Self:
        if (self.points is None) == (self.poses is None):
            raise PydanticCustomError("exactly_one", "Give exactly one of `points` and `poses`")
        if len(self.t) != len(self.points or self.poses or []):
            raise PydanticCustomError("lengths", "`t` must have one time per point")
        if any(later - earlier < 1e-6 for earlier, later in pairwise(self.t)):
            raise PydanticCustomError(
                "order", "`t` must increase by 1 µs or more from point to point"
            )
        return self


@dataclass(frozen=True)
class JointPath:
    """A trajectory in the form of a request of `POST /evaluate`."""

    t: Annotated[PerSample, Unit("s")]
    """Times of the samples."""
    q: Annotated[PerSampleAndJoint, Unit("rad")]
    """Joint positions, `[sample][joint]`."""


@dataclass(frozen=True)
class _AtTime:
    t: Seconds
    """Time of the point."""


@dataclass(frozen=True)
class TimedPathPoint(PathPoint, _AtTime):
    """Result for one point of the path."""

    @classmethod
    def of(cls, t: float, point: PathPoint) -> Self:
        """A point of the path and its time [s]."""
        own = {each.name: getattr(point, each.name) for each in fields(PathPoint) if each.init}
        return cls(t=t, **own)


@dataclass(frozen=True, kw_only=True)
class IKPathAnswer(Answer):
    """Configurations along the path."""

    trajectory: JointPath
    """Configurations of all points in reach, not nearly singular and within the joint ranges."""
    points: list[TimedPathPoint]
    """One entry per point."""


@dataclass(frozen=True)
class IKPathTask:
    """A validated request and its id."""

    request: IKPathRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /ik/path` with the points tried within about `deadline` seconds."""
        end = Deadline.after(deadline)
        request = self.request
        arm = Arm(robot=robot_named(request.robot), T_flange_tcp=to_tcp(request.tcp))
        T_base_frame = to_base(request.frame, arm.robot)
        targets = (
            np.array(request.points) @ T_base_frame[:3, :3].T + T_base_frame[:3, 3]
            if request.points is not None
            else [to_base_pose(pose, arm.robot) for pose in request.poses or []]
        )
        guess = np.array(request.guess)
        found = follow(arm, targets, guess, request.tolerance, request.near_singular, end)
        points = [TimedPathPoint.of(t, point) for t, point in zip(request.t, found, strict=True)]
        written = [point for point in points if point.written]
        answer = IKPathAnswer(
            request=self.request_id,
            robot=request.robot,
            trajectory=JointPath(
                np.array([point.t for point in written]), np.array([point.q for point in written])
            ),
            points=points,
        )
        return TaskResult.of_json(answer)
