"""The course of a tool path: the pose of the TCP at every fraction of the way, and how far another
pose is from it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.kinematics.orientation_tolerance import nearest_orientation
from joulepath.optimizer.kinematics.tool_path.course_matching import matched
from joulepath.optimizer.kinematics.tool_path.course_shapes import Shape, shape_of
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.targets import Side
from joulepath.optimizer.problem.tool_path import SAME_POSE, TURNING, ToolPath

# poses of the course that a motion is compared with, on each piece of its shape at least, and the
# way between two [m] at most
COMPARED, STEP = 100, 0.002
# how much of the length of a course by distance its turns are counted as
TURNS = 1e-3
# fractions of a course that differ by less are the same
SAME_FRACTION = 1e-9


@dataclass(frozen=True, eq=False)
class ToolCourse:
    """The course of a tool path in its shape."""

    path: ToolPath
    shape: Shape
    # ways [m] along the shape, and the fractions of this course at them; None where these are those
    # of the way
    by_distance: tuple[Array, Array] | None = None
    # the angle [rad] by which the tool is turned about the path's free axis at a fraction of the
    # way; None: by none
    turning: CubicSpline | None = None
    # whether the tool may be turned about this axis at the start and at the goal, too
    free_start: bool = False
    free_end: bool = False
    # the part of the shape that the course follows, from one fraction to another one, in this
    # direction
    first: float = 0.0
    last: float = 1.0

    @classmethod
    def of(
        cls, path: ToolPath, start: Array | ConeOrientedPose, goal: Array | ConeOrientedPose
    ) -> ToolCourse:
        """The course of a path, or a section of it, from a `start` to a `goal`.

        Both are poses (4, 4). Or the rotation about the path's free axis is free there: then the
        tool turns as little as may be to the pose after the start, and from the one before the
        goal.

        Raises InvalidProblem; see `shape_of`. The ramps of a path must leave something between
        them.
        """
        if path.section is not None:
            start, goal = path.section.start.T, path.section.goal.T
        free_start, free_end = (isinstance(end, ConeOrientedPose) for end in (start, goal))
        poses = [start, *(pose.T for pose in path.via), goal]
        if isinstance(start, ConeOrientedPose):
            after = poses[1]
            poses[0] = _turned_least(
                start, np.eye(3) if isinstance(after, ConeOrientedPose) else after[:3, :3]
            )
        if isinstance(goal, ConeOrientedPose):
            poses[-1] = _turned_least(goal, np.asarray(poses[-2])[:3, :3])
        course = cls(
            path, shape_of(path, np.array(poses)), free_start=free_start, free_end=free_end
        )
        if path.least_speed is not None:
            course = course._by_distance()
        if path.section is not None:
            course = course.part(path.section.first, path.section.last)
        if path.least_speed is not None:
            course._check_ramps()
        return course

    def part(self, first: float, last: float) -> ToolCourse:
        """The course from one fraction of the whole way to another one."""
        return replace(self, first=first, last=last)

    @property
    def free_sides(self) -> list[Side]:
        """The ends at which the tool may be turned about the path's free axis."""
        free: dict[Side, bool] = {"start": self.free_start, "goal": self.free_end}
        return [side for side, is_free in free.items() if is_free]

    @property
    def length(self) -> float:
        """Length of the way [m]; a radian of turning counts as TURNING."""
        return abs(self.last - self.first) * float(self.shape.pieces[-1])

    def measured(self, count: int, step: float) -> tuple[Array, Array]:
        """Fractions (k,) of the way, as of `grid`, and how far the TCP has moved until there (k,)
        [m], turns left out."""
        at = self.grid(count, step)
        moved = np.linalg.norm(np.diff(self.poses(at)[:, :3, 3], axis=0), axis=1)
        return at, np.concatenate([[0.0], np.cumsum(moved)])

    def _by_distance(self) -> ToolCourse:
        """The same course, whose fractions are those of the distance that the TCP moves: at an even
        speed they rise evenly."""
        at, gone = self.measured(COMPARED, STEP)
        # where the tool turns in place, the fractions have to rise, too
        rising = gone + TURNS * gone[-1] * at
        if not rising[-1] > 0:
            return self
        return replace(self, by_distance=(at * self.length, rising / rising[-1]))

    def _check_ramps(self) -> None:
        length = float(self.measured(COMPARED, STEP)[1][-1])
        if length <= 2 * self.path.ramp:
            raise InvalidProblem(
                "path.speed.ramp",
                f"The TCP moves {length:.4g} m along this path: its ramps, {self.path.ramp:g} m at "
                "either end, leave "
                "nothing between them for path.speed.min.",
            )

    def has_shape_of(self, other: ToolCourse) -> bool:
        """Whether the pieces of both courses are as long, and they follow the same part of them."""
        own, others = self.shape.pieces, other.shape.pieces
        same = len(own) == len(others) and np.abs(own - others).max() <= SAME_FRACTION * own[-1]
        section = (self.first, self.last) == (other.first, other.last)
        return bool(same and section and self.by_distance is None and other.by_distance is None)

    def poses(self, fraction: Array) -> Array:
        """T_base_tcp (k, 4, 4) at fractions (k,) of the way."""
        fraction = np.clip(np.asarray(fraction, dtype=float), 0.0, 1.0)
        at, whole = self.first + fraction * (self.last - self.first), float(self.shape.pieces[-1])
        way = at * whole
        if self.by_distance is not None:
            ways, fractions = self.by_distance
            way = np.clip(CubicSpline(fractions, ways)(at), 0.0, whole)
        T = self.shape.poses(way)
        return T if self.turning is None else self.turned(T, self.turning(fraction))

    def turned(self, T: Array, angle: Array) -> Array:
        """Poses T (k, 4, 4), turned about the path's free axis by angles (k,) [rad]."""
        assert self.path.about is not None
        T = T.copy()
        T[:, :3, :3] @= Rotation.from_rotvec(angle[:, None] * np.array(self.path.about)).as_matrix()
        return T

    def angle_at_start(self, T: Array) -> float:
        """The angle [rad] about the path's free axis by which a pose T (4, 4) at a free start is
        turned.
        """
        turned = self.poses(np.zeros(1))[0, :3, :3].T @ T[:3, :3]
        return float(Rotation.from_matrix(turned).as_rotvec() @ np.array(self.path.about))

    def deviation(self, T: Array) -> tuple[Array, Array]:
        """How far poses T (k, 4, 4) of a motion and the course are from each other: at most so many
        metres and radians.

        Where the tool may turn about an axis, the radians are those between the directions of this
        axis.

        Each pose is compared with one of the course, in the order of both. A piece of the course of
        length s, whose ends are c apart, is at most (s² - c²)^½ / 2 from the straight line between
        them, if both are gone through evenly: so much is added for the piece between two compared
        poses, so that none of it can be left out. Infinite for all poses (k,) if the motion does
        not end where the course does.
        """
        at = self.grid(COMPARED, STEP)
        known = self._embedded(self.poses(at))
        reach = self.path.position_tolerance + TURNING * self.path.rotation_tolerance
        best, left_out, rest = matched(at, known, self._embedded(T), reach)
        position, rotation = self._apart(T, self.poses(best))
        position, rotation = position + left_out, rotation + left_out / TURNING
        if rest > reach:
            return np.full_like(position, np.inf), np.full_like(rotation, np.inf)
        return position, rotation

    def ratios(self, T: Array, wanted: Array) -> Array:
        """How far poses T (k, 4, 4) are from poses that are `wanted` (k, 4, 4), over the path's
        tolerances.
        """
        position, rotation = self._apart(T, wanted)
        return np.maximum(
            position / self.path.position_tolerance, rotation / self.path.rotation_tolerance
        )

    def grid(self, count: int, step: float = np.inf) -> Array:
        """Fractions of the way: each piece of the shape divided into `count` and more parts, none
        longer than a `step` [m]."""
        knots = self.shape.pieces
        knots = knots[np.append(True, np.diff(knots) > SAME_POSE)]
        at = knots / knots[-1] if self.by_distance is None else np.interp(knots, *self.by_distance)
        inside = np.sort((at - self.first) / (self.last - self.first))
        inside = inside[(inside > SAME_FRACTION) & (inside < 1 - SAME_FRACTION)]
        pieces = [
            np.linspace(
                a, b, max(count, int(np.ceil((b - a) * self.length / step))), endpoint=False
            )
            for a, b in pairwise([0.0, *inside.tolist(), 1.0])
        ]
        return np.append(np.concatenate(pieces), 1.0)

    def _apart(self, T: Array, others: Array) -> tuple[Array, Array]:
        """Distances (k,) [m] and angles (k,) [rad] between poses (k, 4, 4)."""
        position = np.linalg.norm(T[:, :3, 3] - others[:, :3, 3], axis=1)
        if self.path.about is None:
            turned = (
                Rotation.from_matrix(T[:, :3, :3]) * Rotation.from_matrix(others[:, :3, :3]).inv()
            )
            return position, np.asarray(turned.magnitude())
        own, other = (each[:, :3, :3] @ np.array(self.path.about) for each in (T, others))
        return position, np.arctan2(
            np.linalg.norm(np.cross(own, other), axis=1), (own * other).sum(axis=1)
        )

    def _embedded(self, T: Array) -> Array:
        """Poses as points (k, d), whose distances are those of the positions [m], and TURNING times
        those of rotations, or of the directions of an axis about which the tool may turn."""
        if self.path.about is not None:
            return np.hstack([T[:, :3, 3], TURNING * T[:, :3, :3] @ np.array(self.path.about)])
        return np.hstack([T[:, :3, 3], TURNING / np.sqrt(2) * T[:, :3, :3].reshape(len(T), 9)])


def _turned_least(end: ConeOrientedPose, R: Array) -> Array:
    """The pose (4, 4) at an end whose orientation is nearest to R (3, 3)."""
    return end.with_orientation(nearest_orientation(end, R)).T
