"""Course of a tool path: the TCP pose at every fraction of its length, and the deviation of a
motion from it.
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
from joulepath.optimizer.problem.tool_path import TOOL_PATH, ToolPath


@dataclass(frozen=True)
class CourseSettings:
    """Resolution of comparisons with a course."""

    compared_poses: int = 100
    """Smallest number of compared poses on each piece of the shape."""
    compared_distance: float = 0.002
    """Largest distance between compared poses [m]."""
    turning_weight: float = 1e-3
    """Length of turns in place in a course by distance, relative to its whole length."""
    same_fraction: float = 1e-9
    """Difference of fractions below which they are one."""


SETTINGS = CourseSettings()


@dataclass(frozen=True, eq=False)
class ToolCourse:
    """Course of a tool path: its TCP pose as a function of the fraction of the path, from 0 to
    1.
    """

    path: ToolPath
    shape: Shape
    by_distance: tuple[Array, Array] | None = None
    """Distances [m] along the shape and the course's fractions there; None if fractions are
    proportional to the distance along the shape.
    """
    turning: CubicSpline | None = None
    """Angle [rad] of the tool about the path's free axis over the fraction; None for no turning."""
    free_start: bool = False
    """Whether the tool may be turned about the free axis at the start, too."""
    free_end: bool = False
    """Whether the tool may be turned about the free axis at the goal, too."""
    first: float = 0.0
    """Fraction of the shape at which the course begins."""
    last: float = 1.0
    """Fraction of the shape at which the course ends; below `first` if it runs backwards."""

    @classmethod
    def of(
        cls, path: ToolPath, start: Array | ConeOrientedPose, goal: Array | ConeOrientedPose
    ) -> ToolCourse:
        """Course of a path, or of its section.

        Args:
            path: tool path.
            start: pose (4, 4), or a pose with a free rotation about the path's free axis; the tool
                then turns as little as possible to the next pose.
            goal: pose (4, 4), or a pose with a free rotation; the tool then turns as little as
                possible from the previous pose.

        Raises:
            InvalidProblem: the shape is invalid, see `shape_of`, or the ramps leave nothing between
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
            course = course._spaced_by_distance()
        if path.section is not None:
            course = course.part(path.section.first, path.section.last)
        if path.least_speed is not None:
            course._check_ramps()
        return course

    def part(self, first: float, last: float) -> ToolCourse:
        """Course from one fraction of the whole path to another."""
        return replace(self, first=first, last=last)

    @property
    def free_sides(self) -> list[Side]:
        """Ends at which the tool may be turned about the path's free axis."""
        free: dict[Side, bool] = {"start": self.free_start, "goal": self.free_end}
        return [side for side, is_free in free.items() if is_free]

    @property
    def length(self) -> float:
        """Length [m], with `meters_per_radian` of rotation."""
        return abs(self.last - self.first) * float(self.shape.pieces[-1])

    def measured(self, count: int, step: float) -> tuple[Array, Array]:
        """Fractions (k,) as of `grid`, and the distance (k,) [m] of the TCP up to each, without
        rotations.
        """
        at = self.grid(count, step)
        moved = np.linalg.norm(np.diff(self.poses(at)[:, :3, 3], axis=0), axis=1)
        return at, np.concatenate([[0.0], np.cumsum(moved)])

    def _spaced_by_distance(self) -> ToolCourse:
        """The same course, with fractions proportional to the distance that the TCP moves."""
        at, moved = self.measured(SETTINGS.compared_poses, SETTINGS.compared_distance)
        # Fractions must increase while the tool turns in place, too.
        rising = moved + SETTINGS.turning_weight * moved[-1] * at
        if not rising[-1] > 0:
            return self
        return replace(self, by_distance=(at * self.length, rising / rising[-1]))

    def _check_ramps(self) -> None:
        length = float(self.measured(SETTINGS.compared_poses, SETTINGS.compared_distance)[1][-1])
        if length <= 2 * self.path.ramp:
            raise InvalidProblem(
                "path.speed.ramp",
                f"The TCP moves {length:.4g} m along this path: its ramps, {self.path.ramp:g} m at "
                "either end, leave nothing between them for path.speed.min.",
            )

    def has_shape_of(self, other: ToolCourse) -> bool:
        """Whether both courses follow the same part of pieces of the same lengths."""
        own, others = self.shape.pieces, other.shape.pieces
        same = (
            len(own) == len(others)
            and np.abs(own - others).max() <= SETTINGS.same_fraction * own[-1]
        )
        section = (self.first, self.last) == (other.first, other.last)
        return bool(same and section and self.by_distance is None and other.by_distance is None)

    def poses(self, fraction: Array) -> Array:
        """TCP poses T_base_tcp (k, 4, 4) at fractions (k,)."""
        fraction = np.clip(np.asarray(fraction, dtype=float), 0.0, 1.0)
        at, whole = self.first + fraction * (self.last - self.first), float(self.shape.pieces[-1])
        distance = at * whole
        if self.by_distance is not None:
            distances, fractions = self.by_distance
            distance = np.clip(CubicSpline(fractions, distances)(at), 0.0, whole)
        T = self.shape.poses(distance)
        return T if self.turning is None else self.turned(T, self.turning(fraction))

    def turned(self, T: Array, angle: Array) -> Array:
        """Poses T (k, 4, 4), turned about the path's free axis by angles (k,) [rad]."""
        assert self.path.about is not None
        T = T.copy()
        T[:, :3, :3] @= Rotation.from_rotvec(angle[:, None] * np.array(self.path.about)).as_matrix()
        return T

    def angle_at_start(self, T: Array) -> float:
        """Angle [rad] about the path's free axis from the first pose to a pose T (4, 4) at a free
        start.
        """
        turned = self.poses(np.zeros(1))[0, :3, :3].T @ T[:3, :3]
        return float(Rotation.from_matrix(turned).as_rotvec() @ np.array(self.path.about))

    def deviation(self, T: Array) -> tuple[Array, Array]:
        """Upper bounds of the deviation between a motion and the course.

        Each pose is compared with one of the course, in the order of both. A piece of the course of
        length s, whose ends are c apart, is at most (s² - c²)^½ / 2 from the straight line between
        them if both are traversed evenly. This distance is added for the piece between two compared
        poses, so that no part of the course can be omitted. If the tool may turn about an axis,
        angles are between the directions of this axis.

        Args:
            T: TCP poses of the motion, shape (k, 4, 4).

        Returns:
            Distances (k,) [m] and angles (k,) [rad]; infinite if the motion does not end at the end
            of the course.
        """
        at = self.grid(SETTINGS.compared_poses, SETTINGS.compared_distance)
        known = self._embedded(self.poses(at))
        reach = (
            self.path.position_tolerance
            + TOOL_PATH.meters_per_radian * self.path.rotation_tolerance
        )
        best, left_out, rest = matched(at, known, self._embedded(T), reach)
        position, rotation = self._apart(T, self.poses(best))
        position, rotation = position + left_out, rotation + left_out / TOOL_PATH.meters_per_radian
        if rest > reach:
            return np.full_like(position, np.inf), np.full_like(rotation, np.inf)
        return position, rotation

    def ratios(self, T: Array, wanted: Array) -> Array:
        """Deviations (k,) of poses T (k, 4, 4) from wanted poses (k, 4, 4), relative to the path's
        tolerances.
        """
        position, rotation = self._apart(T, wanted)
        return np.maximum(
            position / self.path.position_tolerance, rotation / self.path.rotation_tolerance
        )

    def grid(self, count: int, step: float = np.inf) -> Array:
        """Fractions that divide each piece of the shape.

        Args:
            count: smallest number of parts of each piece.
            step: largest length of a part [m].
        """
        knots = self.shape.pieces
        knots = knots[np.append(True, np.diff(knots) > TOOL_PATH.same_pose)]
        at = knots / knots[-1] if self.by_distance is None else np.interp(knots, *self.by_distance)
        inside = np.sort((at - self.first) / (self.last - self.first))
        inside = inside[(inside > SETTINGS.same_fraction) & (inside < 1 - SETTINGS.same_fraction)]
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
        """Poses as points (k, d), with distances close to those of the positions plus
        `meters_per_radian` times those of the rotations.

        If the tool may turn about an axis, the direction of the axis takes the place of the
        rotation.
        """
        if self.path.about is not None:
            return np.hstack(
                [
                    T[:, :3, 3],
                    TOOL_PATH.meters_per_radian * T[:, :3, :3] @ np.array(self.path.about),
                ]
            )
        return np.hstack(
            [
                T[:, :3, 3],
                TOOL_PATH.meters_per_radian / np.sqrt(2) * T[:, :3, :3].reshape(len(T), 9),
            ]
        )


def _turned_least(end: ConeOrientedPose, R: Array) -> Array:
    """Pose (4, 4) at an end with the allowed orientation nearest to R (3, 3)."""
    return end.with_orientation(nearest_orientation(end, R)).T
