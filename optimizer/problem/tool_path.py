"""A path that the TCP must follow: straight lines with smooth corners, a smooth curve, or an
arc."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arrays import unit_vector
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.pose import Pose

PathShape = Literal["lines", "curve", "arc"]
# poses between start and goal at most
MOST_POINTS: dict[PathShape, int] = {"lines": 20, "curve": 500, "arc": 1}
# finest tolerances [m, rad]: ten times what a motion may bend between two samples of its
# certificate
LEAST_TOLERANCE = 1e-5
# tolerances [m, rad] unless given: a tenth of a millimetre and of a degree
POSITION_TOLERANCE, ROTATION_TOLERANCE = 1e-4, 1.745e-3
# how much path [m] a radian of turning counts as: so a turn in place is a path, too
TURNING = 0.25
# m: way at either end of a path on which it may be slower than its least speed, unless given, and
# least of it
RAMP, LEAST_RAMP = 0.02, 1e-3
# a fixed speed is held within this share of it
SPEED_TOLERANCE = 1e-3
# a greatest speed must be so many times the least one: a motion needs some freedom between them
SPEED_RANGE = 1.05
# two axes are the same, or opposite ones, if the cosine of their angle differs from one by less
SAME_AXIS = 1e-12
# poses that are nearer than this [m] along the path are one
SAME_POSE = 1e-6


@dataclass(frozen=True)
class Section:
    """The part of a path from the fraction `first` to `last` of its way; all of it leads from
    `start` to `goal`.
    """

    start: Pose
    goal: Pose
    first: float
    last: float


@dataclass(frozen=True, kw_only=True)
class ToolPath:
    """How the TCP goes from the start of a motion to its goal over the poses `via` in the base
    frame.

    `shape` is "lines", "curve" or "arc". On lines the position moves straight between two poses,
    and the orientation turns evenly about one axis; within `blend` [m] of path before and after a
    pose of `via`, a smooth curve leads past it. A curve goes through every pose, with continuous
    acceleration. An arc is part of the circle through the start, the one pose of `via` and the
    goal. The motion may be off by at most `position_tolerance` [m] and `rotation_tolerance` [rad].
    With `about`, an axis (3,) of the TCP, the tool may turn about it between the ends as it likes:
    the tolerance is for the direction of the axis then. The TCP is no slower than `least_speed`
    [m/s], but within `ramp` [m] of either end. A `fixed_speed` [m/s] is held between the ramps
    within SPEED_TOLERANCE of it, and not exceeded by more on them. With a `section` only this part
    of the path is followed.

    Raises InvalidProblem, with the field named.
    """

    via: Sequence[Pose] = ()
    shape: PathShape = "lines"
    blend: float = 0.0
    position_tolerance: float = POSITION_TOLERANCE
    rotation_tolerance: float = ROTATION_TOLERANCE
    about: Sequence[float] | None = None
    least_speed: float | None = None
    fixed_speed: float | None = None
    ramp: float = RAMP
    section: Section | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "via", tuple(self.via))
        if self.shape not in MOST_POINTS:
            raise InvalidProblem(
                "path.shape", f"path.shape must be one of {', '.join(MOST_POINTS)}."
            )
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
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= LEAST_TOLERANCE):
                field = f"path.tolerance.{name.removesuffix('_tolerance')}"
                raise InvalidProblem(field, f"{field} must be at least {LEAST_TOLERANCE:g}.")
        if self.fixed_speed is not None:
            if not (np.isfinite(self.fixed_speed) and self.fixed_speed > 0):
                raise InvalidProblem(
                    "path.speed", "path.speed must be a positive number of metres per second."
                )
            object.__setattr__(self, "least_speed", self.fixed_speed * (1 - SPEED_TOLERANCE))
        if self.least_speed is not None and not (
            np.isfinite(self.least_speed) and self.least_speed > 0
        ):
            raise InvalidProblem(
                "path.speed.min", "path.speed.min must be a positive number of metres per second."
            )
        if not (np.isfinite(self.ramp) and self.ramp >= LEAST_RAMP):
            raise InvalidProblem(
                "path.speed.ramp", f"path.speed.ramp must be at least {LEAST_RAMP:g} m."
            )
        if not (np.isfinite(self.blend) and self.blend >= 0):
            raise InvalidProblem(
                "path.blend", "path.blend must be a length in metres, zero or more."
            )
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
        """Raises InvalidProblem unless the rotation about the path's free axis is all that an end
        leaves free.

        `name` is that of the end: start or goal.
        """
        along = 0.0 if self.about is None else abs(float(end.axis @ np.array(self.about)))
        if end.half_angle > 0 or along < 1 - SAME_AXIS:
            raise InvalidProblem(
                f"{name}.pose.orientation",
                f"With a path, the {name}'s orientation may be free about the axis "
                "path.tolerance.about alone: give "
                "the same axis as free_about, or the orientation in full.",
            )

    def check_speed(self, most: float | None) -> None:
        """Raises InvalidProblem if the least speed leaves no room below the greatest one, `most`
        [m/s].
        """
        if self.fixed_speed is not None:
            if most is not None and most < self.fixed_speed * (1 + SPEED_TOLERANCE):
                raise InvalidProblem(
                    "path.speed",
                    f"On the path the TCP may be no faster than {most:.4g} m/s: give a fixed "
                    "path.speed of at most "
                    f"{most / (1 + SPEED_TOLERANCE):.4g} m/s.",
                )
            return
        if (
            self.least_speed is not None
            and most is not None
            and most < SPEED_RANGE * self.least_speed
        ):
            raise InvalidProblem(
                "path.speed.min",
                f"On the path the TCP may be no faster than {most:.4g} m/s: give a path.speed.min "
                "of at most "
                f"{most / SPEED_RANGE:.4g} m/s.",
            )
