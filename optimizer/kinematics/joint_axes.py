"""The joint axes of a chain at its zero position, and the simplest arm nearby: axes that nearly are
parallel or meet.

Rounded angles in a description (1.5708 for a quarter turn) and the calibration of a single arm
leave axes that meet, or are parallel, but for little. A formula that needs them to is applied to
the simplest arm, and its solutions are starts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.forward import link_frames

# sine of an angle between neighbouring axes below which they count as parallel: far more than
# rounded angles make
PARALLEL = 2e-4
# distance [m] of axes below which they count as meeting: far more than a calibration moves them
MEETING = 5e-4


@dataclass(frozen=True, eq=False)
class JointAxes:
    """Directions (nq, 3) and points (nq, 3) [m] of the axes in the base frame, and the flange (4,
    4), all at q = 0.
    """

    directions: Array
    points: Array
    T_zero: Array

    @classmethod
    def of(cls, chain: Chain) -> JointAxes:
        """The axes of a chain."""
        frames = link_frames(chain.placements, np.zeros((1, chain.nq)))[0]
        return cls(
            frames[1:, :3, 2].copy(), frames[1:, :3, 3].copy(), frames[-1] @ chain.T_last_flange
        )

    def chain(self) -> Chain:
        """The chain with these axes."""
        frames = np.tile(np.eye(4), (len(self.points), 1, 1))
        # the direction of x is free
        x = np.eye(3)[np.abs(self.directions).argmin(axis=1)]
        y = np.cross(self.directions, x)
        y /= np.linalg.norm(y, axis=1)[:, None]
        frames[:, :3, 0], frames[:, :3, 1] = np.cross(y, self.directions), y
        frames[:, :3, 2], frames[:, :3, 3] = self.directions, self.points
        back = np.linalg.inv(frames)
        return Chain(np.concatenate([frames[:1], back[:-1] @ frames[1:]]), back[-1] @ self.T_zero)

    def simplified(self) -> JointAxes:
        """The arm of parallel and meeting axes nearby: this one, if nothing nearly is."""
        directions, points = self.directions.copy(), self.points.copy()
        for k in range(1, len(directions)):
            if np.linalg.norm(np.cross(self.directions[k - 1], self.directions[k])) < PARALLEL:
                directions[k] = directions[k - 1] * np.sign(directions[k - 1] @ self.directions[k])
        for first in (len(points) - 3, 0):
            three = slice(first, first + 3)
            centre, distance = meeting_point(directions[three], points[three])
            if distance < MEETING:
                points[three] = centre
                for k in range(first - 1, -1, -1):
                    _let_meet(directions, points, k, k + 1)
                for k in range(first + 3, len(points)):
                    _let_meet(directions, points, k, k - 1)
                break
        else:
            for k in range(len(points) - 1, 0, -1):
                _let_meet(directions, points, k, k - 1)
        return JointAxes(directions, points, self.T_zero)


def meeting_point(directions: Array, points: Array) -> tuple[Array, float]:
    """The point (3,) nearest to axes (n, 3), (n, 3), and the greatest distance [m] of an axis from
    it; inf if they are parallel."""
    across = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    total = across.sum(axis=0)
    if np.linalg.cond(total) > 1e6:
        return points[0], np.inf
    centre = np.linalg.solve(total, (across @ points[:, :, None]).sum(axis=0)[:, 0])
    return centre, float(
        np.linalg.norm((across @ (centre - points)[:, :, None])[..., 0], axis=1).max()
    )


def _let_meet(directions: Array, points: Array, moved: int, other: int) -> None:
    """Shift an axis, in its place, until it meets its neighbour, if it nearly does."""
    normal = np.cross(directions[moved], directions[other])
    length = float(np.linalg.norm(normal))
    if length < PARALLEL:
        return
    gap = float((points[other] - points[moved]) @ normal) / length
    if abs(gap) < MEETING:
        points[moved] = points[moved] + gap * normal / length
