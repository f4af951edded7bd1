"""Joint axes of a chain at its zero position, and the nearest arm with parallel and meeting axes.

Rounded angles of a description (1.5708 for a quarter turn) and the calibration of a single arm
leave axes that meet, or are parallel, only approximately. A closed form that needs exact geometry
is applied to the nearest simple arm, and its solutions seed Newton's method on the exact arm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.forward import link_frames


@dataclass(frozen=True)
class JointAxesSettings:
    """Tolerances of parallel and meeting axes."""

    parallel: float = 2e-4
    """Sine of the angle between neighbouring axes below which they count as parallel; far above the
    error of rounded angles.
    """
    most_condition: float = 1e6
    """Condition number of the normal equations above which axes have no meeting point."""
    meeting: float = 5e-4
    """Distance of axes below which they count as meeting [m]; far above the shifts of a
    calibration.
    """
    steep: float = 0.5
    """Vertical component above which an axis is not nearly level."""


AXES = JointAxesSettings()


@dataclass(frozen=True, eq=False)
class JointAxes:
    """Axes of the joints at q = 0, in the base frame.

    `directions` (nq, 3) are unit vectors, `points` (nq, 3) [m] lie on the axes, `T_zero` (4, 4) is
    the flange pose.
    """

    directions: Array
    points: Array
    T_zero: Array

    @classmethod
    def of(cls, chain: Chain) -> JointAxes:
        """Axes of a chain."""
        frames = link_frames(chain.placements, np.zeros((1, chain.nq)))[0]
        return cls(
            frames[1:, :3, 2].copy(), frames[1:, :3, 3].copy(), frames[-1] @ chain.T_last_flange
        )

    def chain(self) -> Chain:
        """Chain with these axes."""
        frames = np.tile(np.eye(4), (len(self.points), 1, 1))
        # The direction of x is arbitrary.
        x = np.eye(3)[np.abs(self.directions).argmin(axis=1)]
        y = np.cross(self.directions, x)
        y /= np.linalg.norm(y, axis=1)[:, None]
        frames[:, :3, 0], frames[:, :3, 1] = np.cross(y, self.directions), y
        frames[:, :3, 2], frames[:, :3, 3] = self.directions, self.points
        back = np.linalg.inv(frames)
        return Chain(np.concatenate([frames[:1], back[:-1] @ frames[1:]]), back[-1] @ self.T_zero)

    def in_one_sense(self) -> tuple[JointAxes, Array]:
        """The same axes, with neighbouring parallel axes in the same sense.

        Returns:
            The axes, and factors (nq,), 1 or -1, by which their joint positions are those of the
            given axes.
        """
        directions, senses = self.directions.copy(), np.ones(len(self.directions))
        for k in range(1, len(directions)):
            if (
                np.linalg.norm(np.cross(directions[k - 1], directions[k])) < AXES.parallel
                and directions[k - 1] @ directions[k] < 0
            ):
                directions[k], senses[k] = -directions[k], -1.0
        return JointAxes(directions, self.points, self.T_zero), senses

    def simplified(self) -> JointAxes:
        """Nearest arm with exactly parallel and meeting axes; equal to this one if no axes nearly
        are.
        """
        directions, points = self.directions.copy(), self.points.copy()
        for k in range(1, len(directions)):
            if np.linalg.norm(np.cross(self.directions[k - 1], self.directions[k])) < AXES.parallel:
                directions[k] = directions[k - 1] * np.sign(directions[k - 1] @ self.directions[k])
        for first in (len(points) - 3, 0):
            three = slice(first, first + 3)
            centre, distance = meeting_point(directions[three], points[three])
            if distance < AXES.meeting:
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


def upward(direction: Array) -> Array:
    """The direction (3,) or its opposite: the one away from the ground, or for a nearly level axis
    the one along the positive x or y axis.
    """
    steep = abs(direction[2]) > AXES.steep
    k = 2 if steep else int(np.abs(direction[:2]).argmax())
    return -direction if direction[k] < 0 else direction


def meeting_point(directions: Array, points: Array) -> tuple[Array, float]:
    """Point (3,) nearest to all axes, and the largest distance of an axis from it.

    Args:
        directions: unit vectors of the axes, shape (n, 3).
        points: points on the axes, shape (n, 3) [m].

    Returns:
        The point (3,) [m] and the distance [m]; the distance is infinite for parallel axes.
    """
    across = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    total = across.sum(axis=0)
    if np.linalg.cond(total) > AXES.most_condition:
        return points[0], np.inf
    centre = np.linalg.solve(total, (across @ points[:, :, None]).sum(axis=0)[:, 0])
    return centre, float(
        np.linalg.norm((across @ (centre - points)[:, :, None])[..., 0], axis=1).max()
    )


def _let_meet(directions: Array, points: Array, moved: int, other: int) -> None:
    """Shifts the axis `moved`, in place, until it meets the axis `other`, if it nearly does."""
    normal = np.cross(directions[moved], directions[other])
    length = float(np.linalg.norm(normal))
    if length < AXES.parallel:
        return
    gap = float((points[other] - points[moved]) @ normal) / length
    if abs(gap) < AXES.meeting:
        points[moved] = points[moved] + gap * normal / length
