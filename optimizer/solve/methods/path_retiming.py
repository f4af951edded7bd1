"""Retiming of a smooth path: the time scaling of least cost along a given curve in joint space."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.motion.spline import Spline, least_time_scale, sample, spline_of
from joulepath.optimizer.solve.methods.limit_repair import (
    LIMIT_REPAIR,
    initial_bounds,
    path_excess,
    repair_factors,
    slightly_retimed,
    tightened,
)
from joulepath.optimizer.solve.methods.method import with_excess
from joulepath.optimizer.solve.methods.retimed_path import RetimedPath
from joulepath.optimizer.solve.methods.retiming_program import RetimingProgram
from joulepath.optimizer.solve.methods.retiming_sqp import RetimingSqp
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus


@dataclass(frozen=True)
class PathRetimingSettings:
    """Settings of the retiming of a path."""

    repairs: int = 6
    """Largest number of NLPs solved, each with the limits tightened that the motion before exceeds
    between the nodes."""

    time_scales: tuple[float, ...] = (1.02, 1.2, 1.5, 2.0, 3.0, 4.5)
    """Initial durations tried, in multiples of the shortest duration of the quintic time
    scaling."""

    feasible: float = 1e-3
    """Largest excess of a constraint, relative to its limit, that the repair of limits between the
    nodes can still undo."""


PATH_RETIMING = PathRetimingSettings()


class PathRetiming(RetimedPath):
    """Time scalings of a path; arguments as of `RetimedPath`."""

    def solve(
        self, guess: Array | None = None, keeps: Callable[[Spline], bool] | None = None
    ) -> SolveResult:
        """Solve for the time scaling of least cost.

        Limits exceeded between the nodes are tightened. The variables where the solve ends are kept
        in `found`.

        Args:
            guess: variables to start from, shape (m + 1,); None for the quintic time scaling.
            keeps: whether a motion keeps the tolerance of the path: otherwise the solve fails.

        Returns:
            The result.

        Raises:
            DeadlinePassed: the watched deadline passed.
        """
        prepared = self.prepared
        limits = prepared.problem.arm.active_limits.scaled(1 - LIMIT_REPAIR.margin)
        bounds = initial_bounds(prepared.path)
        x = (self._first(limits) if guess is None else guess).copy()
        x[-1] = np.clip(x[-1], self.interval.t_min, self.interval.t_max)
        none = np.zeros(len(self.path.control_points[0]))
        iterations = 0
        for solves in range(1, PATH_RETIMING.repairs + 1):
            sqp = RetimingSqp(RetimingProgram(self, limits, bounds), x)
            sqp.solve()
            self.found = x = sqp.at.x
            iterations += sqp.iterations
            if sqp.at.violation.max() > PATH_RETIMING.feasible:
                return SolveResult(
                    SolveStatus.FAILED, SolveReason.NO_MOTION_ALONG_PATH, iterations, solves
                )
            spline = self.motion(x)
            if keeps is not None and not keeps(spline):
                return SolveResult(
                    SolveStatus.FAILED, SolveReason.TOLERANCE_NOT_KEPT, iterations, solves
                )
            factors = repair_factors(prepared, spline, (none, none))
            if factors is not None:
                spline = slightly_retimed(spline, factors, self.interval.t_max)
                factors = repair_factors(prepared, spline, (none, none))
            excess = path_excess(prepared, spline, prepared.path, None)
            lacking = self._lacking(spline)
            if factors is None and not excess.any() and lacking <= 0:
                return SolveResult(
                    SolveStatus.SOLVED, SolveReason.CONVERGED, iterations, solves, spline
                )
            bounds = bounds - excess
            self.floor += max(lacking, 0.0)
            if factors is not None:
                limits = tightened(limits, factors)
        return SolveResult(
            SolveStatus.FAILED, SolveReason.NO_MOTION_ALONG_PATH, iterations, PATH_RETIMING.repairs
        )

    def _lacking(self, spline: Spline) -> float:
        """Ratio by which the least speed of the NLP must rise, as it is missed between points."""
        if self.least_speed is None:
            return 0.0
        settings = LIMIT_REPAIR
        q, v, _ = sample(spline, np.linspace(0.0, spline.duration, settings.path_samples))
        missed = 1 + settings.tightening / 4 - self.least_speed.reached(q, v)
        return settings.path_factor * missed + settings.tightening if missed > 0 else 0.0

    def _first(self, limits: Limits) -> Array:
        """The quintic time scaling in the duration of least cost among a few feasible for rates."""
        t_min, t_max = self.interval.t_min, self.interval.t_max
        x = np.append(self.scaling.quintic[self.scaling.free], 0.0)
        unit = spline_of(self.space, self.points(x), 1.0)
        shortest = max(least_time_scale(unit, limits.rates), t_min)
        scaled = (shortest * scale for scale in PATH_RETIMING.time_scales)
        durations = [duration for duration in scaled if duration < t_max] or [t_max]
        best = np.inf
        for duration in durations:
            cost, tau = self._cost(unit, duration)
            cost = with_excess(cost, tau, limits)
            if cost >= best:
                break
            best, x[-1] = cost, duration
        return x

    def _cost(self, unit: Spline, duration: float) -> tuple[float, Array]:
        """Cost [J] and limited torques (N, nq) of a motion of 1 s retimed to `duration` [s]."""
        y = (self.space.at_nodes @ unit.control_points) / np.power(duration, np.arange(3))[
            :, None, None
        ]
        cost, tau = self.prepared.kernel.value(
            y.transpose(1, 0, 2).reshape(len(self.space.nodes), -1), self.interval.p
        )
        return self.interval.constant + duration * float(self.space.weights @ cost), tau
