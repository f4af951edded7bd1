"""Shapes of a tool path: the pose of the TCP along straight lines with rounded corners, a smooth
curve, or an arc.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.tool_path import SAME_POSE, TURNING, ToolPath

# bends of a right angle that are counted at most
MOST_BENDS = 10
# an arc's three positions are on a line if its radius is so many times as long as it
STRAIGHT = 1e3


class Shape(Protocol):
    """The pose of the TCP at every way [m] from the start; a radian of turning counts as TURNING.

    `pieces` (m,) are the ways at which smooth pieces begin and end, from 0 to the length. `bends`
    is how many times the motion has to slow down, roughly.
    """

    @property
    def pieces(self) -> Array:
        """Ways (m,) [m] at which smooth pieces begin and end."""

    @property
    def bends(self) -> int:
        """Number of bends by about a right angle."""

    def poses(self, way: Array) -> Array:
        """T_base_tcp (k, 4, 4) at ways (k,) [m]."""


def shape_of(path: ToolPath, T: Array) -> Shape:
    """The shape of a path through poses T (n, 4, 4), from its start over its `via` to its goal.

    Raises InvalidProblem if two poses in a row are the same, or too near each other for the blend,
    or on no arc.
    """
    rotation = Rotation.from_matrix(T[:, :3, :3])
    shift, turn = np.diff(T[:, :3, 3], axis=0), (rotation[1:] * rotation[:-1].inv()).as_rotvec()
    way = np.hypot(np.linalg.norm(shift, axis=1), TURNING * np.linalg.norm(turn, axis=1))
    _check(path, way)
    ends = np.concatenate([[0.0], np.cumsum(way)])
    if path.shape == "arc":
        return Arc.through(T[:, :3, 3], rotation)
    if path.shape == "curve" and len(T) > 2:
        return Curve(
            ends, CubicSpline(ends, T[:, :3, 3]), RotationSpline(ends, rotation), _bends(shift)
        )
    return Lines(path.blend, T[:-1, :3, 3], rotation[:-1], shift, turn, ends)


def _check(path: ToolPath, way: Array) -> None:
    for k, length in enumerate(way):
        last = k + 1 == len(way)
        blended = path.blend * ((k > 0) + (not last))
        if length < max(SAME_POSE, blended * (1 - 1e-9)):
            which = "The last two poses of this path are" if last else "This pose is"
            apart = f"{length:.4g} m apart" if last else f"{length:.4g} m from the one before"
            raise InvalidProblem(
                "path" if last else f"path.via.{k}",
                f"{which} {apart}: they must differ, and be at least as far apart as path.blend "
                "takes of the way "
                f"between them, {blended:.4g} m.",
            )


def _bends(shift: Array) -> int:
    chords = shift / np.maximum(np.linalg.norm(shift, axis=1, keepdims=True), SAME_POSE)
    angles = np.arccos(np.clip((chords[1:] * chords[:-1]).sum(axis=1), -1.0, 1.0))
    return min(int(np.ceil(angles.sum() / (np.pi / 2))), MOST_BENDS)


def _matrices(position: Array, rotation: Rotation) -> Array:
    T = np.tile(np.eye(4), (len(position), 1, 1))
    T[:, :3, 3], T[:, :3, :3] = position, rotation.as_matrix()
    return T


@dataclass(frozen=True, eq=False)
class Lines:
    """Straight lines: `position` (n, 3) [m] and `rotation` (n) where each begins, `shift` (n, 3)
    [m] and `turn` (n, 3) [rad] from there to its end, in the base frame; and `ends` (n + 1,), the
    way [m] at the ends of the lines.

    On a line the position moves at an even rate and the orientation turns at an even rate about one
    axis. Within the blend of a corner the path is a Bézier curve of degree five between the two
    lines, with two derivatives in common with either: so the path has two continuous derivatives.
    """

    blend: float
    position: Array
    rotation: Rotation
    shift: Array
    turn: Array
    ends: Array

    @property
    def pieces(self) -> Array:
        """The ends of the lines, and those of the corners' halves."""
        corners = self.ends[1:-1]
        return np.unique(np.concatenate([self.ends, corners - self.blend, corners + self.blend]))

    @property
    def bends(self) -> int:
        """The corners."""
        return len(self.shift) - 1

    def poses(self, way: Array) -> Array:
        """T_base_tcp (k, 4, 4) at ways (k,) [m]."""
        part = np.searchsorted(self.ends[1:-1], way, side="right")
        T = _matrices(*self._on(part, way))
        for corner in range(1, len(self.shift)):
            near = np.flatnonzero(np.abs(way - self.ends[corner]) < self.blend)
            if len(near):
                T[near] = self._blended(corner, way[near])
        return T

    def _on(self, part: npt.NDArray[np.intp], way: Array) -> tuple[Array, Rotation]:
        """Position and orientation on the line of a part, carried on beyond its ends, at a way [m]
        of the whole.
        """
        share = ((way - self.ends[part]) / (self.ends[part + 1] - self.ends[part]))[:, None]
        turned = Rotation.from_rotvec(share * self.turn[part]) * self.rotation[part]
        return self.position[part] + share * self.shift[part], turned

    def _blended(self, corner: int, way: Array) -> Array:
        """Poses near a corner: what is left of the part before it goes to zero, and what is gone of
        the next one rises from there, both smoothly."""
        blend, lengths = self.blend, np.diff(self.ends)
        x = (way - self.ends[corner] + blend) / (2 * blend)
        left = (_fading(x) * blend / lengths[corner - 1])[:, None]
        gone = (_fading(1 - x) * blend / lengths[corner])[:, None]
        position = self.position[corner] - left * self.shift[corner - 1] + gone * self.shift[corner]
        before = Rotation.from_rotvec(-left * self.turn[corner - 1])
        after = Rotation.from_rotvec(gone * self.turn[corner])
        return _matrices(position, after * before * self.rotation[corner])


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve through poses at ways `ends` (n,) [m]: position and orientation are cubic splines
    with two continuous derivatives."""

    ends: Array
    position: CubicSpline
    rotation: RotationSpline
    bends: int

    @property
    def pieces(self) -> Array:
        """The curve is one piece."""
        return self.ends[[0, -1]]

    def poses(self, way: Array) -> Array:
        """T_base_tcp (k, 4, 4) at ways (k,) [m]."""
        return _matrices(self.position(way), self.rotation(way))


@dataclass(frozen=True, eq=False)
class Arc:
    """An arc about `centre` (3,): from there, `first` and `second` (3,) [m] span its plane, the
    first to the start; it ends at `angle` [rad]. The orientation is a cubic spline by the angle."""

    centre: Array
    first: Array
    second: Array
    angle: float
    length: float
    rotation: RotationSpline

    @classmethod
    def through(cls, position: Array, rotation: Rotation) -> Arc:
        """The arc through three positions (3, 3) [m], with three orientations there. Raises
        InvalidProblem.
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
        if not radius < STRAIGHT * longest:
            raise InvalidProblem(
                "path.via.0",
                "The start, this pose and the goal are on a line, so that no arc goes through "
                "them: move it aside, or "
                'leave "shape" out for straight lines.',
            )
        first = -offset
        second = np.cross(normal / np.sqrt(area), first)
        angles = [
            float(np.arctan2(each @ second, each @ first) % (2 * np.pi))
            for each in (a - offset, b - offset)
        ]
        turning = TURNING * (rotation[1:] * rotation[:-1].inv()).magnitude().sum()
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
        """The arc is one piece."""
        return np.array([0.0, self.length])

    @property
    def bends(self) -> int:
        """Quarters of the circle."""
        return int(np.ceil(self.angle / (np.pi / 2)))

    def poses(self, way: Array) -> Array:
        """T_base_tcp (k, 4, 4) at ways (k,) [m]."""
        angle = np.asarray(way) / self.length * self.angle
        position = (
            self.centre + np.cos(angle)[:, None] * self.first + np.sin(angle)[:, None] * self.second
        )
        return _matrices(position, self.rotation(angle))


def _fading(x: Array) -> Array:
    """From 1 to 0 over [0, 1], as 1 - 2 x at first: the Bézier curve of the values 1, 3/5, 1/5, 0,
    0, 0.
    """
    y = 1 - x
    return np.asarray(y**5 + 3 * x * y**4 + 2 * x**2 * y**3)
