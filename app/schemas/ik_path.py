"""What `POST /ik/path` takes and answers."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.schemas.common import (
    Answer,
    BasePose,
    Frame,
    JointPositions,
    Response,
    RobotWithTcp,
    Vector3,
    described,
    frame_of,
    part,
)
from joulepath.app.schemas.examples.ik import ARC
from joulepath.app.schemas.examples.values import HOME
from joulepath.optimizer.problem.problem import LONGEST_DURATION

MAXARC = 1000
"""Largest number of points of a path."""


class IKPathRequest(RobotWithTcp):
    """Positions or poses of the TCP over time, as exactly one of `points` and `poses`."""

    t: Annotated[list[Annotated[float, Field(ge=0, le=1e6)]], Field(min_length=1, max_length=MAXARC)] = described(
        "Time of each point; each later than the previous one by 1 µs or more.", "s", [0.0, 0.5, 1.0]
    )
    points: Annotated[list[Vector3], Field(min_length=1, max_length=MAXARC)] | None = described(
        "Positions [x, y, z] of the TCP in `frame`. The orientation is free.", "m", ARC, default=None
    )
    frame: Frame = frame_of("`points`; each of `poses` has its own")
    poses: Annotated[list[BasePose], Field(min_length=1, max_length=MAXARC)] | None = described(
        "Poses of the TCP, each in the robot's base frame or in its `frame`.",
        None,
        [{"position": [0.4, -0.2, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}],
        default=None,
    )
    guess: JointPositions = described("Initial guess of the joint positions for the first point.", "rad", HOME)
    tolerance: float = described(
        "Largest error of a point that counts as reached. It applies to the position and, for poses, to the rotation.",
        "m, rad",
        1e-6,
        default=1e-6,
        ge=1e-9,
        le=0.1,
    )
    near_singular: float = described(
        "A configuration is left out if the smallest singular value of the TCP's Jacobian is below this.",
        "1",
        0.01,
        default=0.01,
        ge=0,
        le=1,
    )
    deadline: float = described(
        "Wall time from the arrival of the request, including the wait for a worker. After it, no further point is "
        "tried.",
        "s",
        10.0,
        default=10.0,
        ge=1e-3,
        le=LONGEST_DURATION,
    )

    @model_validator(mode="after")
    def _one_path(self) -> Self:
        if (self.points is None) == (self.poses is None):
            raise PydanticCustomError("exactly_one", "Give exactly one of `points` and `poses`")
        if len(self.t) != len(self.points or self.poses or []):
            raise PydanticCustomError("lengths", "`t` must have one time per point")
        if any(later - earlier < 1e-6 for earlier, later in pairwise(self.t)):
            raise PydanticCustomError("order", "`t` must increase by 1 µs or more from point to point")
        return self


class PathPoint(Response):
    """Result for one point of the path."""

    t: float = described("Time of the point.", "s", 0.5)
    q: list[float] = described("Joint positions of the configuration found with the smallest error.", "rad", HOME)
    position_error: float = described("Distance of the TCP from the point.", "m", 1e-14)
    rotation_error: float | None = described(
        "Angle of the TCP to the orientation of the pose; null for positions.", "rad", None
    )
    smallest_singular_value: float = described(
        "Smallest singular value of the TCP's Jacobian in metres and radians: of its translational rows for a "
        "position, of all rows for a pose.",
        "1",
        0.21,
    )
    reached: bool = described("Whether the errors are within `tolerance`.", None, True)
    written: bool = described("Whether the configuration is part of `trajectory`.", None, True)
    reason: Literal["unreachable", "near_singular", "outside_limits", "deadline"] | None = described(
        "Why it is not part of `trajectory`; null if it is. `deadline`: no time was left to search for it, and `q` is "
        "where the search would have begun.",
        None,
        "near_singular",
    )


class JointPath(Response):
    """A trajectory in the form that `POST /evaluate` takes."""

    t: list[float] = described("Time of each sample.", "s", [0.0, 0.5, 1.0])
    q: list[list[float]] = described("Joint positions, [sample][joint].", "rad", [HOME, HOME, HOME])


class IKPathResponse(Answer):
    """Configurations along the path."""

    trajectory: JointPath = part(
        "Configurations of all points that are reached, not nearly singular and within the joint range."
    )
    points: list[PathPoint] = part("One entry per point.")
