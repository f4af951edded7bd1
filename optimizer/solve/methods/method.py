"""Method: solves one candidate in one parametrisation of its motion."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.motion.bspline import Basis
from joulepath.optimizer.motion.spline import Spline, sampled
from joulepath.optimizer.result.baseline import BaselineName
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from joulepath.optimizer.solve.nlp.sqp_state import SQP


def with_excess(cost: float, tau: Array, limits: Limits) -> float:
    """Cost, raised by the largest relative excess of torque over its limit.

    The absolute value of the cost is multiplied by the excess, because the cost may be negative
    where less waiting counts as a gain.

    Args:
        cost: cost of a motion [J].
        tau: torques, shape (N, nq) [N·m].
        limits: limits of the joints.

    Returns:
        The raised cost [J].
    """
    return cost + abs(cost) * float(np.maximum(np.abs(tau) / limits.tau_max - 1, 0).max())


def above(cost: float, multiple: float) -> float:
    """Cost raised by (multiple - 1) times its absolute value, for a multiple ≥ 1.

    This is the multiple of a positive cost, and lies above a negative cost too.
    """
    return cost if np.isinf(cost) else cost + (multiple - 1) * abs(cost)


class Method(ABC):
    """Solves one candidate in one parametrisation of its motion.

    The class variables declare the capabilities of a method; a search decides by them alone.
    """

    guess_baselines: ClassVar[tuple[BaselineName, ...]] = ()
    """Baselines used as initial guesses."""

    accepted_baselines: ClassVar[tuple[BaselineName, ...]] = ()
    """Baselines that the parametrisation represents exactly, and that may therefore be answers."""

    most_solved: ClassVar[int | None] = None
    """Greatest number of candidates that are solved; None for no limit."""

    evenly_spaced: ClassVar[bool] = False
    """Whether `solve_evenly` is available."""

    takes_guesses: ClassVar[bool] = False
    """Whether `solve_from` is available."""

    free_control_points: ClassVar[bool] = False
    """Whether every control point of every joint is free. Then `solve_control_points` is available,
    and the ends may slide along self-motions."""

    converges: ClassVar[bool] = True
    """Whether a solve ends in a local optimum."""

    def __init__(self, context: SolveContext) -> None:
        self.context, self.prepared, self.deadline = context, context.prepared, context.deadline
        self.q_start = context.q_start
        self.q_goal = context.q_goal
        self.interval = context.interval
        self.t_min, self.t_max = self.interval.t_min, self.interval.t_max
        # falls during the solve as motions are found
        self.incumbent_cost = context.incumbent_cost

    @abstractmethod
    def solve(self) -> SolveResult:
        """Solve without an initial guess from elsewhere (cold start)."""

    def cost_of(self, spline: Spline | None) -> float:
        """Cost of a motion in the interval; infinite without a motion.

        Duration [s] for minimum time, else the objective and the price of time [J].
        """
        if spline is None or self.interval.minimum_time:
            return np.inf if spline is None else spline.duration
        return self.prepared.cost_of(spline) + self.interval.price * spline.duration

    @staticmethod
    def may_refine(found: Spline) -> bool:
        """Whether `refined` may improve a motion found by `solve`."""
        return False

    @staticmethod
    def may_grade(found: Spline) -> bool:
        """Whether `solve_from` in its finer space may improve a motion found by `refined`."""
        return False

    def refined(self, spline: Spline, fine: bool) -> SolveResult:
        """Solve from a motion that `may_refine`, in a finer space; `fine` as of `solve_from`."""
        return self.solve_from(*sampled(spline), fine)

    def solve_from(self, q: Array, t: Array, fine: bool) -> SolveResult:
        """Solve from samples of a motion (warm start).

        Args:
            q: configurations, shape (k, nq) [rad].
            t: times of the samples, shape (k,) [s].
            fine: whether to take a finer space, after a first attempt cost more than the samples.
        """
        return SolveResult(SolveStatus.FAILED, SolveReason.NO_INITIAL_GUESS)

    def solve_from_fastest(self, duration: float) -> SolveResult:
        """Solve from the time-optimal motion under limits on rates, slowed down to a duration [s].

        Args:
            duration: duration of the slowed motion [s]; 0 for the time-optimal motion itself.
        """
        return SolveResult(SolveStatus.FAILED, SolveReason.NO_INITIAL_GUESS)

    def solve_evenly(self, q: Array, t: Array, count: int, progress: float) -> SolveResult:
        """Solve from samples of a motion, with control points evenly spaced in time.

        A slow motion has more control points at its ramps.

        Args:
            q: configurations, shape (k, nq) [rad].
            t: times of the samples, shape (k,) [s].
            count: number of control points.
            progress: relative decrease of the cost below which the solve ends.
        """
        return SolveResult(SolveStatus.FAILED, SolveReason.NO_EVEN_CONTROL_POINTS)

    def solve_control_points(
        self,
        space: Basis,
        points: Array,
        duration: float,
        progress: float = SQP.progress,
        unchecked: bool = False,
    ) -> SolveResult:
        """Solve from the control points of a motion, in their own spline space.

        Args:
            space: spline space of the motion.
            points: control points, shape (n, nq) [rad].
            duration: duration of the motion [s].
            progress: relative decrease of the cost below which the solve ends.
            unchecked: as in `Guess`.
        """
        return SolveResult(SolveStatus.FAILED, SolveReason.NO_FREE_CONTROL_POINTS)

    def along_path(self, q: Array, t: Array) -> SolveResult:
        """Solve from a collision-free path.

        Args:
            q: samples of the path, shape (k, nq) [rad].
            t: times of the samples, shape (k,), from 0 to 1.
        """
        return SolveResult(SolveStatus.FAILED, SolveReason.NO_INITIAL_GUESS)
