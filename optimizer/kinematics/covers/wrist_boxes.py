"""Boxes of joint positions, narrowed in the first two joints of the wrist, which may be wide open.

The wrist is the last three joints, q_w its first. In the frame of joint w before its rotation, the
TCP is within `across` of Rz(q_w) v(q_{w+1}), with v the point on the last axis nearest to the TCP.
The goal is at the point x in this frame. If the joints before the wrist are within h of the middles
of their ranges, x is within β of its position for the middles, with β_0 = 0 and β_j = β_{j-1} + h_j
(r_j + β_{j-1}), r_j the goal's distance from axis j: a rotation by δ moves a point at radius r by
at most δ r, and earlier rotations have moved it by at most β_{j-1}.

q_{w+1} is divided into cells. In a cell, v is within η of its position for the middle. The
distances from axis w, and the heights along it, of two points differ by at most the distance of the
points. So |(ρ, z)(x) - (ρ, z)(v)| ≤ e = β + across + η, or the cell holds no solution. If it may,
the azimuths of x and Rz(q_w) v differ by at most asin(e / max(ρ_x, ρ_v)). The same holds for the
tool's axis and the direction d of its cone, with lengths of 1, if this axis is nearly the last
joint's axis u.

If the tool's axis makes an angle α with u, the last joint turns it around u. The remaining
condition of the cone: the angle between u and d is within half_angle of α. In a cell, u · d = ρ_u
ρ_d cos(φ - q_w) + z_u z_d, with φ the difference of their azimuths, and it is within e of its value
for the middles. This leaves q_w two intervals, φ ± [least, most].
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.covers.wrist_geometry import WristGeometry
from joulepath.optimizer.kinematics.forward import link_frames
from joulepath.optimizer.kinematics.tcp import T_last_tcp
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose


@dataclass(frozen=True)
class WristBoxSettings:
    """Resolution and tolerances of the narrowing."""

    cells: int = 16
    """Number of cells of the wrist's second joint."""
    aligned: float = 0.1
    """Distance between the unit vectors of the tool's axis and the last joint's axis below which
    the tool's axis is bounded as a vector [1]; otherwise by its angle to the last axis.
    """
    rounding: float = 1e-9
    """Margin of lengths for rounding [m, 1]."""


SETTINGS = WristBoxSettings()


@dataclass(frozen=True)
class _Vector:
    """Vector of the tool that the goal fixes at `base` (3,) in the base frame.

    In the wrist, the vector v is offset + Rz(q) arm, before the rotation of the second joint's
    frame. The tool's vector is within `slack` of v, or of `base`.
    """

    base: Array
    offset: Array
    arm: Array
    slack: float
    is_point: bool


@dataclass(frozen=True)
class _Cells:
    """Boxes and their cells of the wrist's second joint."""

    frames: Array
    """Frames of the joints before the wrist at the middles of the boxes, shape (b, w + 1, 4, 4)."""
    half: Array
    """Half sides of the boxes, shape (b, nq) [rad]."""
    eta: Array
    """Half sides of the cells, shape (b,) [rad]."""
    angle: Array
    """Middles of the cells, shape (b, cells) [rad]."""

    @cached_property
    def cosine(self) -> Array:
        return np.cos(self.angle)

    @cached_property
    def sine(self) -> Array:
        return np.sin(self.angle)


@dataclass(frozen=True)
class _Places:
    """Cylindrical coordinates of goal and tool about the wrist's first axis, per box and cell."""

    azimuth: Array
    """Difference of the azimuths of goal and tool, shape (b, cells) [rad]."""
    rho_goal: Array
    """Distance of the goal from the axis, shape (b, 1)."""
    rho_tool: Array
    """Distance of the tool from the axis, shape (b, cells)."""
    z_goal: Array
    """Height of the goal along the axis, shape (b, 1)."""
    z_tool: Array
    """Height of the tool along the axis, shape (b, cells)."""
    e: Array
    """Largest displacement of both together, shape (b, cells)."""


@dataclass(frozen=True)
class WristBoxes:
    """Bounds on the first two joints of the wrist in boxes of joint positions, for a TCP at a
    pose.
    """

    geometry: WristGeometry
    pose: ConeOrientedPose

    @cached_property
    def _tilt(self) -> float:
        """Distance between the unit vectors of the tool's axis and the last joint's axis, or its
        opposite.
        """
        return float(np.linalg.norm(self._axis - [0.0, 0.0, self._sign]))

    @cached_property
    def _axis(self) -> Array:
        """Tool's axis (3,) in the last joint's frame."""
        return np.asarray(T_last_tcp(self.geometry.arm)[:3, :3] @ self.pose.axis)

    @property
    def _sign(self) -> float:
        return 1.0 if self._axis[2] >= 0 else -1.0

    @cached_property
    def _point(self) -> _Vector:
        """Vector of the TCP."""
        second, third = self.geometry.placements[self.geometry.inner + 1 :]
        T = T_last_tcp(self.geometry.arm)
        point = third[:3, 3] + third[:3, 2] * T[2, 3]
        return _Vector(self.pose.position, second[:3, 3], point, float(np.hypot(*T[:2, 3])), True)

    @cached_property
    def _direction(self) -> _Vector:
        """Vector of the last joint's axis, with the direction of the cone as its goal."""
        third = self.geometry.placements[self.geometry.inner + 2]
        slack = (
            self._tilt + 2 * float(np.sin(self.pose.half_angle / 2))
            if self._tilt < SETTINGS.aligned
            else 0.0
        )
        sign = self._sign if self._tilt < SETTINGS.aligned else 1.0
        return _Vector(self.pose.direction, np.zeros(3), sign * third[:3, 2], slack, False)

    @cached_property
    def _cosines(self) -> tuple[float, float]:
        """Smallest and largest cosine of the angle between the last joint's axis and the direction
        of the cone.
        """
        angle = float(np.arctan2(np.hypot(*self._axis[:2]), self._axis[2]))
        half = self.pose.half_angle
        return float(np.cos(min(angle + half, np.pi))), float(np.cos(max(angle - half, 0.0)))

    def narrowed(self, centre: Array, half: Array) -> tuple[Array, Array, Mask]:
        """Narrows boxes to the configurations that reach the pose.

        Args:
            centre: middles of the boxes, shape (b, nq) [rad].
            half: half sides, shape (b, nq) [rad].

        Returns:
            Middles and half sides (b, nq) [rad] of boxes that hold all these configurations, and a
            mask (b,) of the boxes that may hold any.
        """
        w = self.geometry.inner
        frames = link_frames(self.geometry.placements[:w], centre[:, :w])
        eta = half[:, w + 1] / SETTINGS.cells
        cell = centre[:, w + 1, None] + eta[:, None] * (
            2 * np.arange(SETTINGS.cells) + 1 - SETTINGS.cells
        )
        cells = _Cells(frames, half, eta, cell)
        reference, spread, possible = _nearby(self._places(self._point, cells))
        low, high = -spread, spread
        if self._tilt < SETTINGS.aligned and self._direction.slack < 1:
            azimuth, other, may = _nearby(self._places(self._direction, cells))
            low, high, held = _met(
                low, high, wrapped(azimuth - reference), np.zeros_like(other), other
            )
            possible &= may & held
        elif self._tilt >= SETTINGS.aligned and self._cosines != (-1.0, 1.0):
            azimuth, least, most, may = _at_angle(
                self._places(self._direction, cells), *self._cosines
            )
            low, high, held = _met(low, high, wrapped(azimuth - reference), least, most)
            possible &= may & held
        return _hull(centre, half, w, reference, low, high, eta, possible)

    def _places(self, vector: _Vector, cells: _Cells) -> _Places:
        """Coordinates of a vector of the tool in every cell, and of its goal in every box."""
        w = self.geometry.inner
        wrist = cells.frames[:, -1] @ self.geometry.placements[w]
        x = (
            vector.base - wrist[:, :3, 3]
            if vector.is_point
            else np.tile(vector.base, (len(wrist), 1))
        )
        x = np.einsum("bxy,bx->by", wrist[:, :3, :3], x)
        a, (c, s) = vector.arm, (cells.cosine, cells.sine)
        turned = np.stack(
            [c * a[0] - s * a[1], s * a[0] + c * a[1], np.full_like(c, a[2])], axis=-1
        )
        v = vector.offset + turned @ self.geometry.placements[w + 1][:3, :3].T
        reach = self._moved(vector, cells.frames, cells.half) + vector.slack + SETTINGS.rounding
        e = reach[:, None] + cells.eta[:, None] * float(np.hypot(*a[:2]))
        azimuth = np.arctan2(x[:, 1], x[:, 0])[:, None] - np.arctan2(v[..., 1], v[..., 0])
        radii = np.hypot(x[:, 0], x[:, 1])[:, None], np.hypot(v[..., 0], v[..., 1])
        return _Places(azimuth, *radii, x[:, 2, None], v[..., 2], e)

    def _moved(self, vector: _Vector, frames: Array, half: Array) -> Array:
        """Largest displacement (b,) of the goal of a vector in the wrist's frame, over the boxes of
        the joints before the wrist.
        """
        moved = np.zeros(len(half))
        for j in range(self.geometry.inner):
            axis = frames[:, j + 1, :3, 2]
            r = (
                vector.base - frames[:, j + 1, :3, 3]
                if vector.is_point
                else np.tile(vector.base, (len(half), 1))
            )
            radius = np.linalg.norm(np.cross(axis, r), axis=1)
            moved = moved + half[:, j] * (radius + moved)
        return moved


def _nearby(at: _Places) -> tuple[Array, Array, Mask]:
    """Intervals of q_w that bring two vectors within e of each other.

    Returns:
        Middles and half lengths of the intervals, and a mask of the cells where it is possible.
    """
    possible = np.hypot(at.rho_goal - at.rho_tool, at.z_goal - at.z_tool) <= at.e
    longest = np.maximum(np.maximum(at.rho_goal, at.rho_tool), SETTINGS.rounding)
    spread = np.arcsin(np.minimum(at.e / longest, 1.0))
    return at.azimuth, np.where(spread < np.pi / 2, spread + SETTINGS.rounding, np.pi), possible


def _at_angle(at: _Places, lowest: float, highest: float) -> tuple[Array, Array, Array, Mask]:
    """Intervals of q_w at which the cosine of two unit vectors is within [lowest, highest], up to
    e.

    Returns:
        Azimuth, smallest and largest difference of q_w from it, and a mask of the cells where it is
        possible.
    """
    across, along = at.rho_goal * at.rho_tool, at.z_goal * at.z_tool
    low, high = lowest - at.e - along, highest + at.e - along
    possible = (low <= across) & (high >= -across)
    across = np.maximum(across, SETTINGS.rounding)
    least = np.arccos(np.clip(high / across, -1.0, 1.0))
    return at.azimuth, least, np.arccos(np.clip(low / across, -1.0, 1.0)), possible


def _met(
    low: Array, high: Array, middle: Array, least: Array, most: Array
) -> tuple[Array, Array, Mask]:
    """Hull of the intersection of [low, high] within [-π, π] and middle ± [least, most], on the
    circle.

    Returns:
        Both ends, and a mask of the non-empty intersections.
    """
    first, last = np.full_like(low, np.inf), np.full_like(high, -np.inf)
    for side in ((middle + least, middle + most), (middle - most, middle - least)):
        for turns in (-2 * np.pi, 0.0, 2 * np.pi):
            start, end = np.maximum(low, side[0] + turns), np.minimum(high, side[1] + turns)
            common = start <= end
            first = np.where(common, np.minimum(first, start), first)
            last = np.where(common, np.maximum(last, end), last)
    held = np.asarray(first <= last)
    return np.where(held, first, low), np.where(held, last, high), held


def _hull(
    centre: Array,
    half: Array,
    w: int,
    reference: Array,
    low: Array,
    high: Array,
    eta: Array,
    possible: Mask,
) -> tuple[Array, Array, Mask]:
    """Boxes with the joints w and w + 1 narrowed to the hull of the possible cells.

    Args:
        centre: middles of the boxes, shape (b, nq) [rad].
        half: half sides, shape (b, nq) [rad].
        w: first joint of the wrist.
        reference: reference angles of q_w, shape (b, cells) [rad].
        low: lower ends of q_w relative to the reference, shape (b, cells) [rad].
        high: upper ends, shape (b, cells) [rad].
        eta: half sides of the cells, shape (b,) [rad].
        possible: mask of the possible cells, shape (b, cells).
    """
    centre, half = centre.copy(), half.copy()
    # A joint with an unbounded range gets the cells' mean direction as its middle.
    anywhere = half[:, w] >= np.pi
    middle = reference + (low + high) / 2
    mean = np.angle((np.exp(1j * middle) * possible).sum(axis=1))
    centre[:, w] = np.where(anywhere, mean, centre[:, w])
    away = wrapped(middle - centre[:, w, None])
    wide = (high - low) / 2
    # An interval that wraps around the circle has parts at both sides.
    around = np.abs(away) + wide > np.pi
    first = np.where(around, -np.pi, away - wide)
    last = np.where(around, np.pi, away + wide)
    possible = possible & (first <= half[:, w, None]) & (last >= -half[:, w, None])
    held: Mask = np.asarray(possible.any(axis=1))
    least = np.where(possible, first, np.inf).min(axis=1)
    most = np.where(possible, last, -np.inf).max(axis=1)
    steps = 2 * np.arange(SETTINGS.cells) + 1 - SETTINGS.cells
    second_least = np.where(possible, steps - 1, np.inf).min(axis=1) * eta
    second_most = np.where(possible, steps + 1, -np.inf).max(axis=1) * eta
    for joint, a, b in ((w, least, most), (w + 1, second_least, second_most)):
        a = np.where(held, np.maximum(a, -half[:, joint]), 0.0)
        b = np.where(held, np.minimum(b, half[:, joint]), 0.0)
        centre[:, joint] += (a + b) / 2
        half[:, joint] = (b - a) / 2
    return centre, half, held
