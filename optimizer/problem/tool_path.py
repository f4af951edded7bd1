"""Path of the TCP: straight lines with smooth corners, a smooth curve, or an arc."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arrays import unit_vector
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.scalars import check_number, check_speed

PathShape = Literal["lines", "curve", "arc"]
MOST_POINTS: dict[PathShape, int] = {"lines": 20, "curve": 500, "arc": 1}
"""Most poses between start and goal, by the shape of the path."""


@dataclass(frozen=True)
class ToolPathSettings:
    """Defaults and limits of tool paths."""

    least_tolerance: float = 1e-5
    """Least tolerance [m, rad]: ten times the bend of a motion between two certificate samples."""
    position_tolerance: float = 1e-4
    """Default tolerance of the position [m]."""
    rotation_tolerance: float = 1.745e-3
    """Default tolerance of the rotation [rad]: a tenth of a degree."""
    ramp: float = 0.02
    """Default length at either end on which the TCP may be slower than its least speed [m]."""
    least_ramp: float = 1e-3
    """Least length of a ramp [m]."""
    speed_range: float = 1.05
    """Least ratio of the greatest speed to the least one; a motion needs some freedom."""
    same_axis: float = 1e-12
    """Deviation of |cos| from 1 below which two axes are parallel."""
    meters_per_radian: float = 0.25
    """Length of path per radian of rotation [m/rad], so that a rotation in place is a path too."""
    speed_tolerance: float = 1e-3
    """Relative tolerance of a fixed speed [1]."""
    same_pose: float = 1e-6
    """Distance along the path below which two poses count as one [m]."""


TOOL_PATH = ToolPathSettings()


@dataclass(frozen=True)
class Section:
    """Part of a path from `start` to `goal`, between the fractions `first` and `last` of its
    length.
    """

    start: Pose
    goal: Pose
    first: float
    last: float


@dataclass(frozen=True, kw_only=True)
class ToolPath:
    """Path of the TCP from the start of a motion to its goal.

    On "lines" the position moves straight between two poses, and the orientation turns evenly about
    one axis; within `blend` of a pose, a smooth curve rounds the corner. A "curve" goes through
    every pose with continuous acceleration. An "arc" is part of the circle through the start, the
    single pose of `via` and the goal.

    Attributes:
        via: poses between start and goal in the base frame.
        shape: "lines", "curve" or "arc".
        blend: length of path before and after a pose on which a corner of lines is rounded [m].
        position_tolerance: greatest deviation of the position [m].
        rotation_tolerance: greatest deviation of the rotation [rad].
        about: axis in the TCP frame about which the tool may turn freely between the ends, shape
            (3,); the rotation tolerance is then for the direction of the axis. None without one.
        least_speed: least speed of the TCP except on the ramps [m/s]; None without one.
        fixed_speed: speed of the TCP between the ramps, within `speed_tolerance`, and an upper
            bound with the same tolerance on the ramps [m/s]; None without one.
        ramp: length of the ramps at both ends [m].
        section: part of the path to be followed; None for the whole path.

    Raises:
        InvalidProblem: a value is malformed; names the field.
    """

    via: Sequence[Pose] = ()
    shape: PathShape = "lines"
    blend: float = 0.0
    position_tolerance: float = TOOL_PATH.position_tolerance
    rotation_tolerance: float = TOOL_PATH.rotation_tolerance
    about: Sequence[float] | None = None
    least_speed: float | None = None
    fixed_speed: float | None = None
    ramp: float = TOOL_PATH.ramp
    section: Section | None = None

    def __post_init__(self) -> None:
        check_fields(self, "path.")
        object.__setattr__(self, "via", tuple(self.via))
        most = MOST_POINTS[self.shape]
        if len(self.via) > most:
            raise InvalidProblem(
                "path.via", f"A path of this shape has at most {most} poses between start and goal."
            )
        if self.shape == "arc" and not self.via:
            raise InvalidProblem(
                "path.via", "An arc needs one pose between start and goal, which it goes through."
            )
        if self.about is not None:
            object.__setattr__(
                self, "about", tuple(unit_vector(self.about, "path.tolerance.about").tolist())
            )
        for name in ("position_tolerance", "rotation_tolerance"):
            kind, least = name.removesuffix("_tolerance"), TOOL_PATH.least_tolerance
            unit = "metres" if kind == "position" else "radians"
            check_number(f"path.tolerance.{kind}", getattr(self, name), unit, least=least)
        check_speed("path.speed", self.fixed_speed)
        if self.fixed_speed is not None:
            object.__setattr__(
                self, "least_speed", self.fixed_speed * (1 - TOOL_PATH.speed_tolerance)
            )
        check_speed("path.speed.min", self.least_speed)
        check_number("path.speed.ramp", self.ramp, "metres", least=TOOL_PATH.least_ramp)
        check_number("path.blend", self.blend, "metres")
        if self.shape != "lines" and self.blend > 0:
            raise InvalidProblem(
                "path.blend", "Only lines have corners: leave path.blend out for a curve or an arc."
            )
        if self.shape == "lines" and self.via and self.blend < self.position_tolerance:
            raise InvalidProblem(
                "path.blend",
                "The arm cannot turn a sharp corner without a stop: give a path.blend of at least "
                "the position's "
                f"tolerance, {self.position_tolerance:g} m, one path for each line, or the shape "
                '"curve".',
            )

    def check_free(self, name: str, end: ConeOrientedPose) -> None:
        """Check that an end leaves only the rotation about the path's free axis free.

        Args:
            name: `start` or `goal`.
            end: pose of the end.

        Raises:
            InvalidProblem: another rotation is free.
        """
        along = 0.0 if self.about is None else abs(float(end.axis @ np.array(self.about)))
        if end.half_angle > 0 or along < 1 - TOOL_PATH.same_axis:
            raise InvalidProblem(
                f"{name}.pose.orientation",
                f"With a path, the {name}'s orientation may be free only about the axis "
                "path.tolerance.about: give the same axis as free_about, or the orientation in "
                "full.",
            )

    def check_speed(self, most: float | None) -> None:
        """Check that the least speed leaves room below the greatest one, `most` [m/s].

        Raises:
            InvalidProblem: it does not.
        """
        if self.fixed_speed is not None:
            if most is not None and most < self.fixed_speed * (1 + TOOL_PATH.speed_tolerance):
                raise InvalidProblem(
                    "path.speed",
                    f"On the path, the TCP can move at most at {most:.4g} m/s: give a fixed "
                    f"path.speed of at most {most / (1 + TOOL_PATH.speed_tolerance):.4g} m/s.",
                )
            return
        if (
            self.least_speed is not None
            and most is not None
            and most < TOOL_PATH.speed_range * self.least_speed
        ):
            raise InvalidProblem(
                "path.speed.min",
                f"On the path, the TCP can move at most at {most:.4g} m/s: give a path.speed.min "
                f"of at most {most / TOOL_PATH.speed_range:.4g} m/s.",
            )
