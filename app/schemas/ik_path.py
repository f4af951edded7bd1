"""What `POST /ik/path` takes and answers."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from app.schemas.common import (
    IDENTITY,
    JointPositions,
    Pose,
    Request,
    Response,
    RobotName,
    Vector3,
    described,
    part,
)

MAX_POINTS = 1000
"""Most points of a path."""
_Q = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
_POINTS = [[0.45, -0.15, 0.35], [0.45, 0.0, 0.4], [0.45, 0.15, 0.35]]


class IKPathRequest(Request):
    """A path of the TCP over time: exactly one of `points` and `poses`."""

    robot: RobotName = described("A name from `GET /robots`.", None, "ur5e", default="ur5e")
    tcp: Pose = described(
        "Pose of the TCP in the flange frame.",
        None,
        {"position": [0.0, 0.0, 0.12], "rpy": [0.0, 0.0, 0.0]},
        default=IDENTITY,
    )
    t: Annotated[list[Annotated[float, Field(ge=0, le=1e6)]], Field(min_length=1, max_length=MAX_POINTS)] = described(
        "When the TCP is to be at each point: each later than the one before.", "s", [0.0, 0.5, 1.0]
    )
    points: Annotated[list[Vector3], Field(min_length=1, max_length=MAX_POINTS)] | None = described(
        "Positions of the TCP in the robot's base frame; its orientation is free.", "m", _POINTS, default=None
    )
    poses: Annotated[list[Pose], Field(min_length=1, max_length=MAX_POINTS)] | None = described(
        "Poses of the TCP in the robot's base frame.",
        None,
        [{"position": [0.4, -0.2, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}],
        default=None,
    )
    guess: JointPositions = described("Joint positions from which the search for the first point starts.", "rad", _Q)
    tolerance: float = described(
        "A point is reached within this, in position [m] and, for poses, rotation [rad].",
        "m",
        1e-6,
        default=1e-6,
        ge=1e-9,
        le=0.1,
    )
    near_singular: float = described(
        "Configurations whose Jacobian has a smaller smallest singular value are left out.",
        "1",
        0.01,
        default=0.01,
        ge=0,
        le=1,
    )

    @model_validator(mode="after")
    def _one_path(self) -> Self:
        if (self.points is None) == (self.poses is None):
            raise PydanticCustomError("exactly_one", "Give exactly one of `points` and `poses`")
        if len(self.t) != len(self.points or self.poses or []):
            raise PydanticCustomError("lengths", "`t` must have one time per point")
        if any(later - earlier < 1e-6 for earlier, later in pairwise(self.t)):
            raise PydanticCustomError("order", "`t` must increase from point to point by a microsecond or more")
        return self


class PathPoint(Response):
    """What became of a point of the path."""

    t: float = described("Its time.", "s", 0.5)
    q: list[float] = described("The nearest configuration found.", "rad", _Q)
    position_error: float = described("How far from the point the TCP is there.", "m", 1e-14)
    rotation_error: float | None = described("How far it is turned from the pose; null for positions.", "rad", None)
    smallest_singular_value: float = described(
        "Of the TCP's Jacobian: its translational rows for a position, all rows, in metres and radians, for a pose.",
        "1",
        0.21,
    )
    reached: bool = described("Whether the errors are within `tolerance`.", None, True)
    written: bool = described("Whether the configuration is part of `trajectory`.", None, True)
    reason: Literal["unreachable", "near_singular", "outside_limits"] | None = described(
        "Why it is not; null where it is.", None, "near_singular"
    )


class JointPath(Response):
    """A trajectory as `POST /evaluate` takes it."""

    t: list[float] = described("Times.", "s", [0.0, 0.5, 1.0])
    q: list[list[float]] = described("Joint positions, [sample][joint].", "rad", [_Q, _Q, _Q])


class IKPathResponse(Response):
    """Configurations along the path."""

    id: str = described(
        "The request's id, as in the `X-Request-ID` header.", None, "0b0f3b0e-4c4f-4a43-9d6b-1f6f2f1f6a55"
    )
    robot: str = described("Name of the robot.", None, "ur5e")
    trajectory: JointPath = part("The configurations that were written: the `trajectory` of `POST /evaluate`.")
    points: list[PathPoint] = part("Every point, one entry each.")
