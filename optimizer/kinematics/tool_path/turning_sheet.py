"""Configurations along a tool path whose tool may turn about an axis: a sheet over the way and the
angle of turning.

From one configuration of the first pose the sheet is followed by Newton's method, along the way and
from angle to angle. A turning is a curve on the sheet from the first pose to the last one; the one
of least cost is found by dynamic programming over the points of the sheet.
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

# points along the way, unless given, and angles of the sheet
STEPS, ANGLES = 48, 49
# angles that a turning may pass from one point of the way to the next
MOST_TURN = 3
# a configuration is on the sheet if it misses its pose by less [m, rad]; a joint that turns farther
# from one point to the next [rad] does so at a singularity
REACHED, JUMP = 1e-9, 0.35
# how turnings begin and end
_AT_REST: Final = "clamped"
_NATURAL: Final = "natural"


@dataclass(frozen=True, eq=False)
class TurningSheet:
    """Configurations q (s, a, nq) [rad] at fractions `at` (s,) of a course and angles (a,) [rad],
    NaN where there is none."""

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
        steps: int = STEPS,
        most: float = np.pi,
        turned: float = 0.0,
    ) -> TurningSheet:
        """The sheet of a course, from a configuration q_start (nq,) [rad] of its first pose.

        This pose is `turned` by an angle [rad]. The sheet has angles up to `most` [rad] to either
        side.
        """
        most = max(most, abs(turned))
        at, angles = np.linspace(0.0, 1.0, steps), np.linspace(-most, most, ANGLES)
        q = np.full((steps, ANGLES, len(q_start)), np.nan)
        first, poses = int(np.abs(angles - turned).argmin()), course.poses(at)
        T_first = flange_pose(course.turned(poses[:1], angles[[first]]), arm.T_flange_tcp)
        q[0, first] = (
            q_start if angles[first] == turned else _followed(chain, q_start[None], T_first)[0]
        )
        for k in range(steps):
            checkpoint()
            T = flange_pose(
                course.turned(np.tile(poses[k], (ANGLES, 1, 1)), angles), arm.T_flange_tcp
            )
            if k:
                known = np.flatnonzero(np.isfinite(q[k - 1, :, 0]))
                q[k, known] = _followed(chain, q[k - 1, known], T[known])
            for order in (range(1, ANGLES), range(ANGLES - 2, -1, -1)):
                for j in order:
                    before = q[k, j - order.step]
                    if np.isnan(q[k, j, 0]) and np.isfinite(before[0]):
                        q[k, j] = _followed(chain, before[None], T[j][None])[0]
        return cls(q, at, angles)

    def without(self, excluded: Callable[[Array], Mask]) -> TurningSheet:
        """The sheet without the configurations that are `excluded`: of (n, nq), a mask (n,)."""
        q, known = self.q.copy(), np.isfinite(self.q[:, :, 0])
        if known.any():
            rows = q[known]
            rows[excluded(rows)] = np.nan
            q[known] = rows
        return TurningSheet(q, self.at, self.angles)

    @property
    def reached(self) -> float:
        """The fraction of the course up to which some configurations are known."""
        return float(self.at[np.isfinite(self.q[:, :, 0]).any(axis=1)].max(initial=0.0))

    def least(
        self,
        cost: Callable[[Array, Array, npt.NDArray[np.intp]], Array],
        free_end: bool = False,
        free_start: bool = False,
    ) -> npt.NDArray[np.intp] | None:
        """The numbers (s,) of the angles of the turning of least cost that begins and ends without
        a turn.

        Where the start or the end is free, it begins or ends at any angle. `cost` gives that of
        steps from q to others (n, nq) [rad] from the points (n,) of the way. None if no turning
        leads to the end.
        """
        middle, steps = ANGLES // 2, len(self.at) - 1
        reached = np.where(free_start & np.isfinite(self.q[0, :, 0]), 0.0, np.inf)
        reached[middle] = 0.0
        came = np.zeros((steps, ANGLES), dtype=np.intp)
        weights = self._weights(cost)
        for k in range(steps):
            total = np.full((2 * MOST_TURN + 1, ANGLES), np.inf)
            for row, turn in enumerate(range(-MOST_TURN, MOST_TURN + 1)):
                to = np.arange(max(turn, 0), ANGLES + min(turn, 0))
                total[row, to] = reached[to - turn] + weights[row, k, to]
            best = total.argmin(axis=0)
            came[k] = np.arange(ANGLES) - (best - MOST_TURN)
            reached = total[best, np.arange(ANGLES)]
        last = int(reached.argmin()) if free_end else middle
        if not np.isfinite(reached[last]):
            return None
        chosen = [last]
        for k in range(steps - 1, -1, -1):
            chosen.append(int(came[k, chosen[-1]]))
        return np.array(chosen[::-1])

    def _weights(self, cost: Callable[[Array, Array, npt.NDArray[np.intp]], Array]) -> Array:
        """Costs (turns, s - 1, a) of the steps to each point of the sheet, by how many angles they
        turn.
        """
        weights = np.full((2 * MOST_TURN + 1, len(self.at) - 1, ANGLES), np.inf)
        for row, turn in enumerate(range(-MOST_TURN, MOST_TURN + 1)):
            to = np.arange(max(turn, 0), ANGLES + min(turn, 0))
            first, second = self.q[:-1, to - turn], self.q[1:, to]
            possible = np.abs(second - first).max(axis=2) < JUMP
            k, j = np.nonzero(possible)
            weights[row, k, to[j]] = cost(first[k, j], second[k, j], k)
        return weights


def shortest(first: Array, second: Array, at: npt.NDArray[np.intp]) -> Array:
    """The cost (n,) of steps of a turning that is short in the joints."""
    return np.asarray(((second - first) ** 2).sum(axis=1))


def turning_through(
    at: Array, angle: Array, knots: int, free_end: bool = False, free_start: bool = False
) -> CubicSpline:
    """A smooth turning near angles (k,) [rad] at fractions (k,), by values at `knots` even
    fractions; see `turning_of`."""
    x, natural = np.linspace(0.0, 1.0, knots), free_end or free_start
    units = CubicSpline(x, np.eye(knots), bc_type=_NATURAL if natural else _AT_REST)(at)
    chosen = units[:, 0 if free_start else 1 : knots if free_end else -1]
    return turning_of(
        np.asarray(np.linalg.lstsq(chosen, angle, rcond=None)[0], dtype=float), free_end, free_start
    )


def turning_of(values: Array, free_end: bool = False, free_start: bool = False) -> CubicSpline:
    """The turning with values (k,) [rad] at even fractions between the start and the end, where it
    is zero.

    The first value is that at the start, and the last one that at the end, if this is free: then an
    even turning is one of them. Else the turning begins and ends at rest.
    """
    angles = np.concatenate([[] if free_start else [0.0], values, [] if free_end else [0.0]])
    natural = free_end or free_start
    return CubicSpline(
        np.linspace(0.0, 1.0, len(angles)), angles, bc_type=_NATURAL if natural else _AT_REST
    )


def values_of(angles: Array, free_end: bool = False, free_start: bool = False) -> Array:
    """The values (k,) [rad] of a turning, of its angles at even fractions, both ends included: see
    `turning_of`.
    """
    return angles[0 if free_start else 1 : len(angles) if free_end else -1]


def _followed(chain: Chain, q: Array, T: Array) -> Array:
    """Configurations (n, nq) of flange poses T (n, 4, 4) near others, NaN where a joint would jump
    or none is near.
    """
    found, missed = newton.solved(chain, q, T, steps=12)
    found[(missed > REACHED) | (np.abs(found - q).max(axis=1) > JUMP)] = np.nan
    return found
