"""`uniform_scaling`: a given motion retimed evenly, by the factor at which it spends least.

D. Meike, M. Pellicciari, G. Berselli, "Energy efficient use of multirobot production lines in the automotive industry:
detailed system modeling and optimization", IEEE Trans. Autom. Sci. Eng. 11, 2014: one factor per motion scales the time
of what the controller would do. The motion given here is the time-optimal jerk-limited one of all joints in step.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from models.robot import Array
from optimizer.deadline import Deadline
from optimizer.methods.duration_intervals import DurationInterval
from optimizer.methods.method import Method, SolveResult
from optimizer.prepared_problem import PreparedProblem
from optimizer.trajectories.quadrature import grid
from optimizer.trajectories.ruckig_motion import time_optimal_spline
from optimizer.trajectories.spline import Spline, peak_rates, sample, time_scale

# factors tried, each so many times the one before; the search ends when so many in a row spend more than the best
RATIO, PATIENCE = 1.12, 8
# how near the best factor is come, as a share of it
NEARNESS = 1e-5
# rates are used up to this share of their limits, so that rounding does not break them, and torque up to this, since
# its peaks lie between samples
RATES_HELD, TORQUE_HELD = 1 - 1e-9, 1 - 1e-4


class UniformScaling(Method):
    """Solves a candidate by the factor that slows its time-optimal motion."""

    def __init__(
        self,
        prepared: PreparedProblem,
        q_start: Array,
        q_goal: Array,
        deadline: Deadline,
        interval: DurationInterval | None = None,
    ) -> None:
        super().__init__(prepared, q_start, q_goal, deadline, interval)
        self.given = time_optimal_spline(prepared.problem.arm.active_limits, q_start, q_goal)
        q, self._v, a = sample(self.given, grid(self.given.duration))
        self._q = q
        still = np.zeros_like(q)
        # rigid-body torque is that of holding still plus a part quadratic in speed: a factor divides that by its square
        self._holding = prepared.torques(q, still, still)
        self._moving = prepared.torques(q, self._v, a) - self._holding
        self._evaluations = 0

    def solve(self) -> SolveResult:
        """The factor of least energy (or the least factor, in haste) at which limits, torque and duration hold."""
        limits, length = self.prepared.problem.arm.active_limits, self.given.duration
        hit = self.prepared.surroundings.worst_violation(self.given)
        if hit is not None:
            return SolveResult("infeasible", f"the given motion hits something: {hit.message}", hit=hit)
        needed = time_scale(
            peak_rates(self.given) / (np.stack([limits.v_max, limits.a_max, limits.j_max]) * RATES_HELD)
        )
        least, most = max(needed, self.t_min / length), self.t_max / length
        if least > most:
            return SolveResult("infeasible", f"retimed evenly, the motion takes at least {least * length:.4f} s")
        factors, costs = [least], [self._cost(least)]
        while factors[-1] < most and (np.isinf(costs).all() or len(costs) - int(np.argmin(costs)) <= PATIENCE):
            if self.deadline.passed:
                return SolveResult("out of time", "the deadline passed", self._evaluations)
            factors.append(min(factors[-1] * RATIO, most))
            costs.append(self._cost(factors[-1]))
        best = int(np.argmin(costs))
        if np.isinf(costs[best]):
            return SolveResult("failed", "found no factor at which torque holds its limit", self._evaluations)
        factor, low, high = factors[best], factors[max(best - 1, 0)], factors[min(best + 1, len(factors) - 1)]
        if high > low:
            found = minimize_scalar(
                self._cost, bounds=(low, high), method="bounded", options={"xatol": NEARNESS * factor}
            )
            if found.fun < costs[best]:
                factor = float(found.x)
        return SolveResult("solved", "converged", self._evaluations, 1, self._slowed(factor))

    def _slowed(self, factor: float) -> Spline:
        # rounding must not leave the duration's bounds
        duration = min(max(self.given.duration * factor, self.t_min), self.t_max)
        return replace(self.given, knots=self.given.knots / self.given.duration * duration)

    def _cost(self, factor: float) -> float:
        """What is minimised; infinite where torque, or a limit along the path, is broken."""
        self._evaluations += 1
        tau = self._holding + self._moving / factor**2 + self.prepared.friction.torque(self._v / factor)
        if (np.abs(tau) > self.prepared.problem.arm.active_limits.tau_max * TORQUE_HELD).any():
            return np.inf
        if (
            self.prepared.path is not None
            and (self.prepared.path.ratios(self._q, self._v / factor) > TORQUE_HELD).any()
        ):
            return np.inf
        spline = self._slowed(factor)
        return (
            spline.duration if self.interval.minimum_time else self.prepared.objective_of(self.prepared.energy(spline))
        )
