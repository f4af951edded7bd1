"""`uniform_scaling`: the time-optimal motion, with time scaled by the factor of least energy.

D. Meike, M. Pellicciari, G. Berselli, "Energy efficient use of multirobot production lines in the
automotive industry: detailed system modeling and optimization", IEEE Trans. Autom. Sci. Eng. 11,
2014: one factor per motion scales the time of the controller's motion. Here the controller's motion
is the time-optimal jerk-limited motion of all joints together, or, after a collision, the
time-optimal motion along smooth planned paths.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.optimize import minimize_scalar

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.limited_torque import limited_torque
from joulepath.optimizer.motion.quadrature import grid
from joulepath.optimizer.motion.ruckig_motion import time_optimal_spline
from joulepath.optimizer.motion.spline import Spline, lasting, least_time_scale, sample
from joulepath.optimizer.result.baseline import BaselineName
from joulepath.optimizer.solve.methods.around_obstacles import around_obstacles
from joulepath.optimizer.solve.methods.duration_intervals import fastest
from joulepath.optimizer.solve.methods.limit_repair import torque_peaks
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.path_retiming import PathRetiming
from joulepath.optimizer.solve.methods.solve_result import (
    SolveReason,
    SolveResult,
    SolveStatus,
    with_effort,
)


@dataclass(frozen=True)
class UniformScalingSettings:
    """Settings of the search for the time scale of least cost."""

    ratio: float = 1.12
    """Ratio of successive factors."""

    patience: int = 8
    """Successive factors without a decrease of the cost after which the search ends."""

    tolerance: float = 1e-5
    """Relative tolerance of the best factor."""

    rates_used: float = 1 - 1e-9
    """Share of the limits on rates that is used, because of rounding."""

    torque_used: float = 1 - 1e-4
    """Share of the limits on torque and path constraints that is used."""

    bounded_above: float = 0.97
    """Ratio of torque to its limit at a sample above which torque is bounded between samples: peaks
    there are a few thousandths higher."""


UNIFORM_SCALING = UniformScalingSettings()


@dataclass(frozen=True)
class _Samples:
    """A motion on the grid of the certificate, shape (k, nq) each."""

    q: Array
    """Joint positions [rad]."""

    v: Array
    """Joint speeds [rad/s]."""

    a: Array
    """Joint accelerations [rad/s²]."""

    static: Array
    """Torques at rest [N·m]."""

    moving: Array
    """Rigid-body torques less the static torques, quadratic in speed [N·m]. A time scale k divides
    them by k²."""


class UniformScaling(Method):
    """Solves a candidate by the factor that scales the time of its time-optimal motion."""

    accepted_baselines: ClassVar[tuple[BaselineName, ...]] = ("ruckig", "ruckig_slowed")

    def solve(self) -> SolveResult:
        """Solve for the factor of least cost, along planned paths after a collision."""
        given = time_optimal_spline(
            self.prepared.problem.arm.active_limits, self.q_start, self.q_goal
        )
        collision = self.prepared.surroundings.worst_violation(given)
        if collision is not None:
            return around_obstacles(self, SolveReason.TIME_OPTIMAL_COLLIDES, collision, self._along)
        return UniformScale(self, given).solve()

    def _along(self, path: Spline) -> SolveResult:
        """The time-optimal motion along a path, scaled."""
        found = PathRetiming(self.prepared, path, fastest(self.prepared)).solve()
        if found.spline is None:
            return found
        return with_effort(scaled := UniformScale(self, found.spline).solve(), [found, scaled])


class UniformScale:
    """Search for the factor on the time of a `given` motion.

    Attributes:
        evaluations: number of costs evaluated.
    """

    def __init__(self, method: Method, given: Spline) -> None:
        self.prepared = method.prepared
        self.deadline = method.deadline
        self._cost_of = method.cost_of
        self.t_min = method.t_min
        self.t_max = method.t_max
        self._fastest = method.interval.minimum_time
        self.given, self.evaluations = given, 0
        q, v, a = sample(given, grid(given.duration))
        still = np.zeros_like(q)
        static = self.prepared.torques(q, still, still)
        self._samples = _Samples(q, v, a, static, self.prepared.torques(q, v, a) - static)

    def solve(self) -> SolveResult:
        """Solve for the factor of least cost within limits and allowed durations."""
        settings, length = UNIFORM_SCALING, self.given.duration
        needed = least_time_scale(
            self.given, self.prepared.problem.arm.active_limits.rates * settings.rates_used
        )
        least, most = max(needed, self.t_min / length), self.t_max / length
        if least > most:
            return SolveResult(
                SolveStatus.INFEASIBLE,
                SolveReason.TIME_OPTIMAL_TAKES_LONGER,
                figures=(least * length,),
            )
        factors, costs = [least], [self._cost(least)]
        while factors[-1] < most and (
            np.isinf(costs).all() or len(costs) - int(np.argmin(costs)) <= settings.patience
        ):
            if self.deadline.passed:
                return SolveResult(
                    SolveStatus.OUT_OF_TIME, SolveReason.DEADLINE_PASSED, self.evaluations
                )
            factors.append(min(factors[-1] * settings.ratio, most))
            costs.append(self._cost(factors[-1]))
        best = int(np.argmin(costs))
        if np.isinf(costs[best]):
            return SolveResult(
                SolveStatus.FAILED, SolveReason.NO_TIME_SCALE_WITHIN_LIMITS, self.evaluations
            )
        factor = factors[best]
        low = factors[max(best - 1, 0)]
        high = factors[min(best + 1, len(factors) - 1)]
        if self._fastest:
            # bisection for the smallest feasible factor
            while factor - low > settings.tolerance * factor:
                middle = (low + factor) / 2
                low, factor = (middle, factor) if np.isinf(self._cost(middle)) else (low, middle)
        elif high > low:
            found = minimize_scalar(
                self._cost,
                bounds=(low, high),
                method="bounded",
                options={"xatol": settings.tolerance * factor},
            )
            if found.fun < costs[best]:
                factor = float(found.x)
        return SolveResult(
            SolveStatus.SOLVED, SolveReason.CONVERGED, self.evaluations, 1, self._retimed(factor)
        )

    def _retimed(self, factor: float) -> Spline:
        # rounding must not leave the duration's bounds
        return lasting(self.given, min(max(self.given.duration * factor, self.t_min), self.t_max))

    def _cost(self, factor: float) -> float:
        """Cost of a factor; infinite if torque or a path constraint exceeds its limit."""
        self.evaluations += 1
        allowed = UNIFORM_SCALING.torque_used
        given, v = self._samples, self._samples.v / factor
        tau = given.static + given.moving / factor**2
        tau = limited_torque(self.prepared.arm, tau, v, given.a / factor**2)
        limit = self.prepared.problem.arm.active_limits.tau_max
        used = float((np.abs(tau) / limit).max())
        if used > allowed:
            return np.inf
        if (
            self.prepared.path is not None
            and (self.prepared.path.ratios(given.q, v) > allowed).any()
        ):
            return np.inf
        spline = self._retimed(factor)
        if used > UNIFORM_SCALING.bounded_above:
            peaks = torque_peaks(self.prepared, spline)
            if (peaks > limit * allowed).any():
                return np.inf
        return self._cost_of(spline)
