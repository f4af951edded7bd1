"""Configurations along a tool path with a free axis: a grid over the fraction of the path and the
turning angle.

From one configuration of the first pose, the grid is filled by Newton's method, along the path and
from angle to angle. A turning is a curve on this grid from the first pose to the last; the one of
least cost is found by dynamic programming.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.kinematics import newton
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.tcp import flange_pose
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class TurningSettings:
    """Settings of the grid of turning angles."""

    steps: int = 48
    """Default number of points along the path."""
    angles: int = 49
    """Number of turning angles."""
    most_turn: int = 3
    """Largest number of angles that a turning passes from one point of the path to the next."""
    newton_steps: int = 12
    """Newton steps from a configuration to an adjacent point."""
    reached: float = 1e-9
    """Largest pose error of a configuration on the grid [m, rad]."""
    jump: float = 0.35
    """Joint distance between adjacent points above which the arm passes a singularity [rad]."""


TURNING_GRID = TurningSettings()
# Boundary conditions of turnings.
_AT_REST: Final = "clamped"
_NATURAL: Final = "natural"


@dataclass(frozen=True, eq=False)
class TurningGrid:
    """Configurations q (s, a, nq) [rad] at fractions `at` (s,) of a course and turning angles (a,)
    [rad].

    Entries without a configuration are NaN.
    """

    q: Array
    at: Array
    angles: Array

    @classmethod
    def of(
        cls,
        arm: Arm,
        chain: Chain,
        course: ToolCourse,
        q_start: Array,
        steps: int = TURNING_GRID.steps,
        most: float = np.pi,
        turned: float = 0.0,
    ) -> TurningGrid:
        """Grid of a course, from one configuration of its first pose.

        Args:
            arm: arm with its TCP.
            chain: chain of the arm.
            course: course of the tool path.
            q_start: configuration of the first pose, shape (nq,) [rad].
            steps: number of points along the path.
            most: largest turning angle to either side [rad].
            turned: turning angle of `q_start` [rad].
        """
        most = max(most, abs(turned))
        at, angles = np.linspace(0.0, 1.0, steps), np.linspace(-most, most, TURNING_GRID.angles)
        q = np.full((steps, TURNING_GRID.angles, len(q_start)), np.nan)
        first, poses = int(np.abs(angles - turned).argmin()), course.poses(at)
        T_first = flange_pose(course.turned(poses[:1], angles[[first]]), arm.T_flange_tcp)
        q[0, first] = (
            q_start if angles[first] == turned else _continued(chain, q_start[None], T_first)[0]
        )
        for k in range(steps):
            checkpoint()
            T = flange_pose(
                course.turned(np.tile(poses[k], (TURNING_GRID.angles, 1, 1)), angles),
                arm.T_flange_tcp,
            )
            if k:
                known = np.flatnonzero(np.isfinite(q[k - 1, :, 0]))
                q[k, known] = _continued(chain, q[k - 1, known], T[known])
            for order in (range(1, TURNING_GRID.angles), range(TURNING_GRID.angles - 2, -1, -1)):
                for j in order:
                    before = q[k, j - order.step]
                    if np.isnan(q[k, j, 0]) and np.isfinite(before[0]):
                        q[k, j] = _continued(chain, before[None], T[j][None])[0]
        return cls(q, at, angles)

    def without(self, excluded: Callable[[Array], Mask]) -> TurningGrid:
        """Grid without the configurations excluded by a function from configurations (n, nq) to a
        mask (n,).
        """
        q, known = self.q.copy(), np.isfinite(self.q[:, :, 0])
        if known.any():
            rows = q[known]
            rows[excluded(rows)] = np.nan
            q[known] = rows
        return TurningGrid(q, self.at, self.angles)

    @property
    def reached(self) -> float:
        """Fraction of the course up to which some configuration is known."""
        return float(self.at[np.isfinite(self.q[:, :, 0]).any(axis=1)].max(initial=0.0))

    def least(
        self,
        cost: Callable[[Array, Array, npt.NDArray[np.intp]], Array],
        free_end: bool = False,
        free_start: bool = False,
    ) -> npt.NDArray[np.intp] | None:
        """Turning of least cost that begins and ends without a turn.

        Args:
            cost: function from steps between configurations (n, nq) [rad], at points (n,) of the
                path, to costs (n,).
            free_end: whether the turning may end at any angle.
            free_start: whether the turning may begin at any angle.

        Returns:
            The indices (s,) of its angles; None if no turning leads to the end.
        """
        middle, steps = TURNING_GRID.angles // 2, len(self.at) - 1
        reached = np.where(free_start & np.isfinite(self.q[0, :, 0]), 0.0, np.inf)
        reached[middle] = 0.0
        came = np.zeros((steps, TURNING_GRID.angles), dtype=np.intp)
        weights = self._weights(cost)
        for k in range(steps):
            total = np.full((2 * TURNING_GRID.most_turn + 1, TURNING_GRID.angles), np.inf)
            for row, turn in enumerate(range(-TURNING_GRID.most_turn, TURNING_GRID.most_turn + 1)):
                to = np.arange(max(turn, 0), TURNING_GRID.angles + min(turn, 0))
                total[row, to] = reached[to - turn] + weights[row, k, to]
            best = total.argmin(axis=0)
            came[k] = np.arange(TURNING_GRID.angles) - (best - TURNING_GRID.most_turn)
            reached = total[best, np.arange(TURNING_GRID.angles)]
        last = int(reached.argmin()) if free_end else middle
        if not np.isfinite(reached[last]):
            return None
        chosen = [last]
        for k in range(steps - 1, -1, -1):
            chosen.append(int(came[k, chosen[-1]]))
        return np.array(chosen[::-1])

    def _weights(self, cost: Callable[[Array, Array, npt.NDArray[np.intp]], Array]) -> Array:
        """Costs (turns, s - 1, a) of the steps to each grid point, by the number of angles
        turned.
        """
        weights = np.full(
            (2 * TURNING_GRID.most_turn + 1, len(self.at) - 1, TURNING_GRID.angles), np.inf
        )
        for row, turn in enumerate(range(-TURNING_GRID.most_turn, TURNING_GRID.most_turn + 1)):
            to = np.arange(max(turn, 0), TURNING_GRID.angles + min(turn, 0))
            first, second = self.q[:-1, to - turn], self.q[1:, to]
            possible = np.abs(second - first).max(axis=2) < TURNING_GRID.jump
            k, j = np.nonzero(possible)
            weights[row, k, to[j]] = cost(first[k, j], second[k, j], k)
        return weights


def shortest(first: Array, second: Array, at: npt.NDArray[np.intp]) -> Array:
    """Cost (n,) of steps for a turning of short joint movements."""
    return np.asarray(((second - first) ** 2).sum(axis=1))


def turning_through(
    at: Array, angle: Array, knots: int, free_end: bool = False, free_start: bool = False
) -> CubicSpline:
    """Smooth turning near angles (k,) [rad] at fractions (k,), by values at `knots` evenly spaced
    fractions.

    See `turning_of` for its ends.
    """
    x, natural = np.linspace(0.0, 1.0, knots), free_end or free_start
    units = CubicSpline(x, np.eye(knots), bc_type=_NATURAL if natural else _AT_REST)(at)
    chosen = units[:, 0 if free_start else 1 : knots if free_end else -1]
    return turning_of(
        np.asarray(np.linalg.lstsq(chosen, angle, rcond=None)[0], dtype=float), free_end, free_start
    )


def turning_of(values: Array, free_end: bool = False, free_start: bool = False) -> CubicSpline:
    """Turning with values (k,) [rad] at evenly spaced fractions between start and end, where it is
    zero.

    At a free start or end, the first or the last value is the one there, and a uniform turning is
    possible. Otherwise the turning begins and ends at rest.
    """
    angles = np.concatenate([[] if free_start else [0.0], values, [] if free_end else [0.0]])
    natural = free_end or free_start
    return CubicSpline(
        np.linspace(0.0, 1.0, len(angles)), angles, bc_type=_NATURAL if natural else _AT_REST
    )


def values_of(angles: Array, free_end: bool = False, free_start: bool = False) -> Array:
    """Values (k,) [rad] of a turning from its angles at evenly spaced fractions including both
    ends, see `turning_of`.
    """
    return angles[0 if free_start else 1 : len(angles) if free_end else -1]


def _continued(chain: Chain, q: Array, T: Array) -> Array:
    """Configurations (n, nq) of flange poses T (n, 4, 4) near q; NaN where none is found or a joint
    would jump.
    """
    found, residual = newton.solved(chain, q, T, steps=TURNING_GRID.newton_steps)
    found[
        (residual > TURNING_GRID.reached) | (np.abs(found - q).max(axis=1) > TURNING_GRID.jump)
    ] = np.nan
    return found
