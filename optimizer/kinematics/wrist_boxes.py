"""Boxes of joint positions, narrowed in the first two joints of the wrist, which may be wide open.

The wrist is the last three joints, q_w its first. In the frame of joint w before its rotation, the TCP is within
`across` of Rz(q_w) v(q_{w+1}), v the point on the last axis nearest to the TCP. The goal is at the point x in this
frame. If the joints before the wrist are within h of the middles of their ranges, x is within β of its place for the
middles, with β_0 = 0 and β_j = β_{j-1} + h_j (r_j + β_{j-1}), r_j the goal's distance from axis j: a rotation by δ
moves a point at radius r by at most δ r, and earlier rotations have moved it by β_{j-1} at most.

q_{w+1} is cut into cells. In a cell, v is within η of its middle's. The distance from axis w and the height along it
differ by no more than two points do. So |(ρ, z)(x) - (ρ, z)(v)| ≤ e = β + across + η, or the cell holds no solution. If
it may, the azimuths of x and Rz(q_w) v differ by at most asin(e / max(ρ_x, ρ_v)). The same holds for the tool's axis
and the direction of its cone, with lengths of 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from models.robot import Array
from optimizer.kinematics.angles import wrapped
from optimizer.kinematics.forward import link_frames
from optimizer.kinematics.tcp import T_last_tcp
from optimizer.kinematics.wrist_geometry import WristGeometry
from optimizer.problem.cone_oriented_pose import ConeOrientedPose

CELLS = 16
# what lengths [m, 1] are widened by, for rounding
ROUNDING = 1e-9


@dataclass(frozen=True)
class _Vector:
    """A vector of the tool that the goal fixes: `base` (3,) in the base frame. In the wrist, v = offset + Rz(q) arm
    before the rotation of the second joint's frame; `slack` is how far the tool's is from v or from `base` at most."""

    base: Array
    offset: Array
    arm: Array
    slack: float
    is_point: bool


@dataclass(frozen=True)
class WristBoxes:
    """What the first two joints of the wrist can be in boxes of joint positions if the TCP is at a pose."""

    geometry: WristGeometry
    pose: ConeOrientedPose

    @cached_property
    def _vectors(self) -> list[_Vector]:
        second, third = self.geometry.placements[self.geometry.inner + 1 :]
        T = T_last_tcp(self.geometry.arm)
        point = third[:3, 3] + third[:3, 2] * T[2, 3]
        vectors = [_Vector(self.pose.position, second[:3, 3], point, float(np.hypot(*T[:2, 3])), True)]
        axis = T[:3, :3] @ self.pose.axis
        sign = 1.0 if axis[2] >= 0 else -1.0
        tilt = float(np.linalg.norm(axis - [0.0, 0.0, sign]))
        slack = tilt + 2 * float(np.sin(self.pose.half_angle / 2))
        if slack < 1:  # a wider one says nothing
            vectors.append(_Vector(self.pose.direction, np.zeros(3), sign * third[:3, 2], slack, False))
        return vectors

    def narrowed(self, centre: Array, half: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Middles and half sides (b, nq) [rad] of boxes that hold all that can reach the pose; which (b,) may hold
        any."""
        w, second = self.geometry.inner, self.geometry.placements[self.geometry.inner + 1][:3, :3]
        frames = link_frames(self.geometry.placements[:w], centre[:, :w])
        wrist = frames[:, -1] @ self.geometry.placements[w]
        # cells (b, CELLS) of the second joint
        eta = half[:, w + 1] / CELLS
        cell = centre[:, w + 1, None] + eta[:, None] * (2 * np.arange(CELLS) + 1 - CELLS)
        c, s = np.cos(cell)[..., None], np.sin(cell)[..., None]
        possible = np.ones(cell.shape, dtype=bool)
        low = high = np.zeros(cell.shape)
        reference: Array | None = None
        for vector in self._vectors:
            x = vector.base - wrist[:, :3, 3] if vector.is_point else np.tile(vector.base, (len(centre), 1))
            x = np.einsum("bxy,bx->by", wrist[:, :3, :3], x)
            a = vector.arm
            turned = np.concatenate([c * a[0] - s * a[1], s * a[0] + c * a[1], np.full_like(c, a[2])], axis=-1)
            v = vector.offset + turned @ second.T
            reach = self._moved(vector, frames, half) + vector.slack + ROUNDING
            e = reach[:, None] + eta[:, None] * float(np.hypot(*a[:2]))
            rho_x, rho_v = np.hypot(x[:, 0], x[:, 1])[:, None], np.hypot(v[..., 0], v[..., 1])
            possible &= np.hypot(rho_x - rho_v, x[:, 2, None] - v[..., 2]) <= e
            azimuth = np.arctan2(x[:, 1], x[:, 0])[:, None] - np.arctan2(v[..., 1], v[..., 0])
            spread = np.arcsin(np.minimum(e / np.maximum(np.maximum(rho_x, rho_v), ROUNDING), 1.0))
            spread = np.where(spread < np.pi / 2, spread + ROUNDING, np.pi)
            if reference is None:
                reference, low, high = azimuth, -spread, spread
                continue
            apart = wrapped(azimuth - reference)
            possible &= np.abs(apart) <= high + spread
            # one that reaches around the circle may meet the first on both sides
            around = np.abs(apart) + spread > np.pi
            low = np.where(around, low, np.maximum(low, apart - spread))
            high = np.where(around, high, np.minimum(high, apart + spread))
        assert reference is not None
        return _hull(centre, half, w, reference, low, high, eta, possible)

    def _moved(self, vector: _Vector, frames: Array, half: Array) -> Array:
        """How far (b,) a vector of the goal can move in the wrist's frame as the joints before it move in their
        boxes."""
        moved = np.zeros(len(half))
        for j in range(self.geometry.inner):
            axis = frames[:, j + 1, :3, 2]
            r = vector.base - frames[:, j + 1, :3, 3] if vector.is_point else np.tile(vector.base, (len(half), 1))
            radius = np.linalg.norm(np.cross(axis, r), axis=1)
            moved = moved + half[:, j] * (radius + moved)
        return moved


def _hull(
    centre: Array, half: Array, w: int, reference: Array, low: Array, high: Array, eta: Array,
    possible: NDArray[np.bool_],
) -> tuple[Array, Array, NDArray[np.bool_]]:  # fmt: skip
    """The boxes with joints w and w + 1 narrowed to the hull of the possible cells, whose q_w are within low ... high
    (b, CELLS) of `reference`."""
    centre, half = centre.copy(), half.copy()
    # a joint that may be anywhere gets the cells' mean direction as its middle
    anywhere = half[:, w] >= np.pi
    middle = reference + (low + high) / 2
    mean = np.angle((np.exp(1j * middle) * possible).sum(axis=1))
    centre[:, w] = np.where(anywhere, mean, centre[:, w])
    away = wrapped(middle - centre[:, w, None])
    wide = (high - low) / 2
    # an interval that reaches around the circle has parts at both sides
    around = np.abs(away) + wide > np.pi
    first = np.where(around, -np.pi, away - wide)
    last = np.where(around, np.pi, away + wide)
    possible = possible & (first <= half[:, w, None]) & (last >= -half[:, w, None])
    held: NDArray[np.bool_] = np.asarray(possible.any(axis=1))
    least = np.where(possible, first, np.inf).min(axis=1)
    most = np.where(possible, last, -np.inf).max(axis=1)
    steps = 2 * np.arange(CELLS) + 1 - CELLS
    second_least = np.where(possible, steps - 1, np.inf).min(axis=1) * eta
    second_most = np.where(possible, steps + 1, -np.inf).max(axis=1) * eta
    for joint, a, b in ((w, least, most), (w + 1, second_least, second_most)):
        a, b = np.where(held, np.maximum(a, -half[:, joint]), 0.0), np.where(held, np.minimum(b, half[:, joint]), 0.0)
        centre[:, joint] += (a + b) / 2
        half[:, joint] = (b - a) / 2
    return centre, half, held
