"""Prescribed paths of the TCP."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, Tag, field_validator, model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.schemas.arm import Speed
from joulepath.app.schemas.common import BasePose, Request, described, number_or_object
from joulepath.app.schemas.orientation import Axis, ConeOrientedPose, TargetPose
from joulepath.optimizer.problem.line import LINE_RANGES
from joulepath.optimizer.problem.tool_path import MOST_POINTS, TOOL_PATH, PathShape

SPEED = "Largest speed of the TCP along the path. Null: as fast as the limits allow."


class SpeedRange(Request):
    """Bounds on the speed of the TCP along a path."""

    min: Speed | None = described(
        "Smallest speed, except on the ramps at both ends, where the arm starts from rest and "
        "comes to rest. Null: no bound.",
        "m/s",
        0.1,
        default=None,
    )
    max: Speed | None = described(
        "Largest speed, at least 1.05 times `min`; or equal to it: the speed is fixed then, and "
        f"held within {TOOL_PATH.speed_tolerance:.1%} between the ramps. Null: as fast as the "
        "limits allow.",
        "m/s",
        0.2,
        default=None,
    )
    ramp: float = described(
        "Length of the path at either end on which the speed may be below `min`.",
        "m",
        0.02,
        default=TOOL_PATH.ramp,
        ge=TOOL_PATH.least_ramp,
        le=1,
    )

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        between = self.min is not None and self.max is not None and self.fixed is None
        if between and (self.max or 0.0) < TOOL_PATH.speed_range * (self.min or 0.0):
            raise PydanticCustomError(
                "range",
                f"`max` must be at least {TOOL_PATH.speed_range:g} times `min`, or equal to it: "
                "then the speed is fixed",
            )
        return self

    @property
    def fixed(self) -> float | None:
        """The constant speed [m/s]; None for a range."""
        return self.min if self.min == self.max else None

    @property
    def limit(self) -> float | None:
        """The upper limit on the speed of the TCP [m/s]; None for a constant speed."""
        return self.max if self.fixed is None else None


PathSpeed = Annotated[
    Annotated[Speed, Tag("by number")] | Annotated[SpeedRange, Tag("range")],
    number_or_object(
        "by number", "speed", "Give null, a number of m/s, or an object with `min`, `max` or both"
    ),
]


class PathTolerance(Request):
    """Largest deviations of the motion from its path."""

    position: float = described(
        "Largest distance of the TCP.",
        "m",
        1e-4,
        default=TOOL_PATH.position_tolerance,
        ge=TOOL_PATH.least_tolerance,
        le=0.1,
    )
    rotation: float = described(
        "Largest angle of the tool.",
        "rad",
        2e-3,
        default=TOOL_PATH.rotation_tolerance,
        ge=TOOL_PATH.least_tolerance,
        le=0.5,
    )
    about: Axis | None = described(
        "Axis of the TCP, of any length, about which the tool may turn along the path, as the "
        "arm must and as needs the least energy. `rotation` then limits the direction of this "
        "axis. At both ends, the tool has its full orientation, unless it is `free_about` the "
        "same axis. Null: the orientation is that of the path.",
        "1",
        [0.0, 0.0, 1.0],
        default=None,
    )


class _OnPath(Request):
    shape: PathShape = described(
        "`lines`: straight from pose to pose, with rounded corners. `curve`: smoothly through "
        "every pose, as through those of a recorded curve. `arc`: on the circle through the start, "
        "the one pose between and the end.",
        None,
        "lines",
        default="lines",
    )
    blend: float = described(
        "Length of path before and after each pose between start and end on which a smooth "
        "curve replaces the corner of two lines. Required if there are such poses, because the "
        "arm cannot turn a sharp corner without a stop.",
        "m",
        0.02,
        default=0.0,
        ge=0,
        le=1,
    )
    tolerance: PathTolerance = described(
        "Largest deviation of the motion from the path.",
        None,
        {"position": 1e-4, "rotation": 2e-3},
        default=PathTolerance(),
    )
    speed: PathSpeed | None = described(
        "Largest speed of the TCP along the path, or bounds on it. Null: as fast as the limits "
        "allow.",
        "m/s",
        0.1,
        default=None,
    )

    @property
    def bounds(self) -> SpeedRange:
        """The bounds on the speed."""
        return self.speed if isinstance(self.speed, SpeedRange) else SpeedRange(max=self.speed)


class Path(_OnPath):
    """A path of the TCP from `start` to `goal`: straight lines with an even rotation about one axis
    per line; a smooth curve; or an arc.

    The branch and the timing are chosen; the tool is on the path from the start to the goal.
    """

    via: Annotated[list[BasePose], Field(max_length=max(MOST_POINTS.values()))] = described(
        f"Poses of the TCP between start and goal: at most {MOST_POINTS['lines']} of lines, "
        f"{MOST_POINTS['curve']} of a curve, exactly one of an arc.",
        None,
        [{"position": [0.4, 0.0, 0.2], "quaternion": [0.0, 1.0, 0.0, 0.0]}],
        default=[],
    )


class StopPath(_OnPath):
    """A path of the TCP at a stop, such as a bead of glue: the arm rests at the first pose, follows
    the path, and rests at the last pose. The branch is chosen for the whole cycle."""

    points: Annotated[
        list[TargetPose], Field(min_length=2, max_length=max(MOST_POINTS.values()) + 2)
    ] = described(
        f"Poses of the TCP: 2 to {MOST_POINTS['lines'] + 2} of lines, to "
        f"{MOST_POINTS['curve'] + 2} of a curve, exactly three of an arc. The first and the last "
        "may be `free_about` the axis `tolerance.about`: then the angles of the tool there are "
        "chosen for the whole cycle.",
        None,
        [
            {"position": [0.4, 0.0, 0.2], "quaternion": [0.0, 1.0, 0.0, 0.0]},
            {"position": [0.4, 0.3, 0.2], "quaternion": [0.0, 1.0, 0.0, 0.0]},
        ],
    )
    split: bool = described(
        "Whether a path that no arm configuration follows whole is divided: into as few parts as "
        "possible, with moves from one configuration to another between them. Each part is a stop "
        "of its own: `NAME/1`, `NAME/2` and so on, the last one `NAME`; each has the lines of the "
        "stop.",
        None,
        True,
        default=False,
    )

    @field_validator("points")
    @classmethod
    def _full_between(cls, points: list[TargetPose]) -> list[TargetPose]:
        for k, pose in enumerate(points[1:-1], 1):
            if isinstance(pose, ConeOrientedPose):
                raise PydanticCustomError(
                    "full_orientation",
                    "Only the first and the last pose may leave the orientation free: give pose "
                    "{number} a quaternion, rpy or rotvec",
                    {"number": k},
                )
        return points

    @property
    def via(self) -> list[BasePose]:
        """The poses between the first and the last."""
        return [pose for pose in self.points[1:-1] if not isinstance(pose, ConeOrientedPose)]


class Line(Request):
    """A straight line of the TCP into or out of a stop; the tool keeps its orientation."""

    direction: Axis = described("Direction of the motion, of any length.", "1", [0.0, 0.0, 1.0])
    frame: Literal["tcp", "base", "base_link"] = described(
        "Frame of `direction`: that of the TCP at the stop, the robot's base frame, or ROS's "
        "`base_link`.",
        None,
        "tcp",
        default="tcp",
    )
    distance: float = described(
        "Length of the line.",
        "m",
        0.08,
        ge=LINE_RANGES.least_distance,
        le=LINE_RANGES.greatest_distance,
    )
    speed: Speed | None = described(SPEED, "m/s", 0.1, default=None)
