"""Shapes of a tool path: straight lines with rounded corners, a smooth curve, or an arc."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.tool_path import TOOL_PATH, ToolPath


@dataclass(frozen=True)
class ShapeSettings:
    """Limits of shapes."""

    most_bends: int = 10
    """Largest number of right-angle bends that are counted."""
    straight: float = 1e3
    """Ratio of an arc's radius to its longest chord above which its three positions count as
    collinear.
    """


SETTINGS = ShapeSettings()


class Shape(Protocol):
    """TCP pose over the distance [m] from the start, with `meters_per_radian` of rotation."""

    @property
    def pieces(self) -> Array:
        """Distances (m,) [m] at which smooth pieces begin and end, from 0 to the length."""

    @property
    def bends(self) -> int:
        """Approximate number of right-angle bends, at which the motion slows down."""

    def poses(self, distance: Array) -> Array:
        """TCP poses T_base_tcp (k, 4, 4) at distances (k,) [m]."""


def shape_of(path: ToolPath, T: Array) -> Shape:
    """Shape of a path through poses T (n, 4, 4), from its start over its `via` poses to its goal.

    Raises:
        InvalidProblem: two consecutive poses coincide or are too close for the blend, or no arc
            goes through the poses.
    """
    rotation = Rotation.from_matrix(T[:, :3, :3])
    shift, turn = np.diff(T[:, :3, 3], axis=0), (rotation[1:] * rotation[:-1].inv()).as_rotvec()
    distance = np.hypot(
        np.linalg.norm(shift, axis=1), TOOL_PATH.meters_per_radian * np.linalg.norm(turn, axis=1)
    )
    _check(path, distance)
    ends = np.concatenate([[0.0], np.cumsum(distance)])
    if path.shape == "arc":
        return Arc.through(T[:, :3, 3], rotation)
    if path.shape == "curve" and len(T) > 2:
        return Curve(
            ends, CubicSpline(ends, T[:, :3, 3]), RotationSpline(ends, rotation), _bends(shift)
        )
    return Lines(path.blend, T[:-1, :3, 3], rotation[:-1], shift, turn, ends)


def _check(path: ToolPath, distance: Array) -> None:
    for k, length in enumerate(distance):
        last = k + 1 == len(distance)
        blended = path.blend * ((k > 0) + (not last))
        if length < max(TOOL_PATH.same_pose, blended * (1 - 1e-9)):
            which = "The last two poses of this path are" if last else "This pose is"
            apart = f"{length:.4g} m apart" if last else f"{length:.4g} m from the one before"
            raise InvalidProblem(
                "path" if last else f"path.via.{k}",
                f"{which} {apart}: they must differ, and be at least {blended:.4g} m apart, as "
                "path.blend takes this length between them.",
            )


def _bends(shift: Array) -> int:
    chords = shift / np.maximum(np.linalg.norm(shift, axis=1, keepdims=True), TOOL_PATH.same_pose)
    angles = np.arccos(np.clip((chords[1:] * chords[:-1]).sum(axis=1), -1.0, 1.0))
    return min(int(np.ceil(angles.sum() / (np.pi / 2))), SETTINGS.most_bends)


def _matrices(position: Array, rotation: Rotation) -> Array:
    T = np.tile(np.eye(4), (len(position), 1, 1))
    T[:, :3, 3], T[:, :3, :3] = position, rotation.as_matrix()
    return T


@dataclass(frozen=True, eq=False)
class Lines:
    """Straight lines with rounded corners.

    On a line the position moves at a uniform rate, and the orientation turns at a uniform rate
    about one axis. Within the blend of a corner the path is a Bézier curve of degree five between
    the two lines, which shares two derivatives with either: so the path has two continuous
    derivatives.
    """

    blend: float
    """Distance from a corner at which the rounding begins [m]."""
    position: Array
    """Start of each line, shape (n, 3) [m]."""
    rotation: Rotation
    """Orientation at the start of each line (n)."""
    shift: Array
    """Translation from start to end of each line, shape (n, 3) [m]."""
    turn: Array
    """Rotation vector from start to end of each line, in the base frame, shape (n, 3) [rad]."""
    ends: Array
    """Distances of the ends of the lines, shape (n + 1,) [m]."""

    @property
    def pieces(self) -> Array:
        """Distances [m] of the ends of the lines and of the halves of corners."""
        corners = self.ends[1:-1]
        return np.unique(np.concatenate([self.ends, corners - self.blend, corners + self.blend]))

    @property
    def bends(self) -> int:
        """Number of corners."""
        return len(self.shift) - 1

    def poses(self, distance: Array) -> Array:
        """TCP poses T_base_tcp (k, 4, 4) at distances (k,) [m]."""
        part = np.searchsorted(self.ends[1:-1], distance, side="right")
        T = _matrices(*self._on(part, distance))
        for corner in range(1, len(self.shift)):
            near = np.flatnonzero(np.abs(distance - self.ends[corner]) < self.blend)
            if len(near):
                T[near] = self._blended(corner, distance[near])
        return T

    def _on(self, part: npt.NDArray[np.intp], distance: Array) -> tuple[Array, Rotation]:
        """Position and orientation on the line of a part, extended beyond its ends, at a distance
        [m] from the start.
        """
        share = ((distance - self.ends[part]) / (self.ends[part + 1] - self.ends[part]))[:, None]
        turned = Rotation.from_rotvec(share * self.turn[part]) * self.rotation[part]
        return self.position[part] + share * self.shift[part], turned

    def _blended(self, corner: int, distance: Array) -> Array:
        """Poses near a corner: the remainder of the line before fades to zero while the next line
        fades in.
        """
        blend, lengths = self.blend, np.diff(self.ends)
        x = (distance - self.ends[corner] + blend) / (2 * blend)
        left = (_fading(x) * blend / lengths[corner - 1])[:, None]
        entered = (_fading(1 - x) * blend / lengths[corner])[:, None]
        position = (
            self.position[corner] - left * self.shift[corner - 1] + entered * self.shift[corner]
        )
        before = Rotation.from_rotvec(-left * self.turn[corner - 1])
        after = Rotation.from_rotvec(entered * self.turn[corner])
        return _matrices(position, after * before * self.rotation[corner])


@dataclass(frozen=True, eq=False)
class Curve:
    """Curve through poses at distances `ends` (n,) [m]: cubic splines of position and orientation
    with two continuous derivatives.
    """

    ends: Array
    position: CubicSpline
    rotation: RotationSpline
    bends: int

    @property
    def pieces(self) -> Array:
        """Both ends: the curve is one piece."""
        return self.ends[[0, -1]]

    def poses(self, distance: Array) -> Array:
        """TCP poses T_base_tcp (k, 4, 4) at distances (k,) [m]."""
        return _matrices(self.position(distance), self.rotation(distance))


@dataclass(frozen=True, eq=False)
class Arc:
    """Arc about `centre` (3,) [m], in the plane of the radii `first` and `second` (3,) [m].

    `first` points to the start, and the arc ends at `angle` [rad]. The orientation is a cubic
    spline over the angle.
    """

    centre: Array
    first: Array
    second: Array
    angle: float
    length: float
    rotation: RotationSpline

    @classmethod
    def through(cls, position: Array, rotation: Rotation) -> Arc:
        """Arc through three positions (3, 3) [m] with three orientations.

        Raises:
            InvalidProblem: the positions are collinear.
        """
        a, b = position[1] - position[0], position[2] - position[0]
        normal = np.cross(a, b)
        area = float(normal @ normal)
        longest = float(np.linalg.norm(np.stack([a, b, b - a]), axis=1).max())
        offset = (
            np.cross((a @ a) * b - (b @ b) * a, normal) / (2 * area)
            if area > 0
            else np.full(3, np.inf)
        )
        radius = float(np.linalg.norm(offset))
        if not radius < SETTINGS.straight * longest:
            raise InvalidProblem(
                "path.via.0",
                "The start, this pose and the goal are on a line, so no arc passes through "
                'them: move this pose aside, or leave "shape" out for straight lines.',
            )
        first = -offset
        second = np.cross(normal / np.sqrt(area), first)
        angles = [
            float(np.arctan2(each @ second, each @ first) % (2 * np.pi))
            for each in (a - offset, b - offset)
        ]
        turning = (
            TOOL_PATH.meters_per_radian * (rotation[1:] * rotation[:-1].inv()).magnitude().sum()
        )
        spline = RotationSpline(np.array([0.0, *angles]), rotation)
        return cls(
            position[0] + offset,
            first,
            second,
            angles[1],
            float(np.hypot(radius * angles[1], turning)),
            spline,
        )

    @property
    def pieces(self) -> Array:
        """Both ends: the arc is one piece."""
        return np.array([0.0, self.length])

    @property
    def bends(self) -> int:
        """Number of quarter circles."""
        return int(np.ceil(self.angle / (np.pi / 2)))

    def poses(self, distance: Array) -> Array:
        """TCP poses T_base_tcp (k, 4, 4) at distances (k,) [m]."""
        angle = np.asarray(distance) / self.length * self.angle
        position = (
            self.centre + np.cos(angle)[:, None] * self.first + np.sin(angle)[:, None] * self.second
        )
        return _matrices(position, self.rotation(angle))


def _fading(x: Array) -> Array:
    """Function from 1 to 0 over [0, 1] that begins like 1 - 2 x: the Bézier curve with the values
    1, 3/5, 1/5, 0, 0, 0.
    """
    y = 1 - x
    return np.asarray(y**5 + 3 * x * y**4 + 2 * x**2 * y**3)
