"""Retiming of a smooth path: the time scaling of least cost along a given curve in joint space.

The path is γ(s), s ∈ [0, 1]. The time scaling s(τ) is a spline at rest at both ends, whose control
values rise. They and the duration T are the decision variables. The motion is the spline q(τ) that
fits γ(s(τ)) best, by a linear map that the spline space fixes. Its control points P are therefore
smooth functions of the variables,

    ∂P/∂c = F diag(γ'(s)) B,

with the values B of the scaling's basis at the fitted instants and the map F of the fit. Cost,
rates and torques are those of the spline itself: no error of the fit is left to check afterwards,
except for its distance from the path.

The NLP has few variables and many constraints: SLSQP (D. Kraft, "A software package for sequential
quadratic programming", DFVLR-FB 88-28, 1988) by SciPy.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve
from scipy.optimize import Bounds, NonlinearConstraint, minimize

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import (
    Spline,
    lasting,
    least_time_scale,
    sample,
    spline_of,
)
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.methods.duration_intervals import DurationInterval
from joulepath.optimizer.solve.methods.limit_repair import (
    MARGIN,
    PATH_REPAIR,
    PATH_SAMPLES,
    REPAIR_MARGIN,
    initial_bounds,
    path_excess,
    repair_factors,
    slightly_retimed,
    tightened,
)
from joulepath.optimizer.solve.methods.method import with_excess
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus

# control values of the time scaling, and how many more control points than the path the motion has,
# up to a number
SCALING_POINTS, MORE_POINTS, MOST_POINTS = 17, 12, 72
# instants per control point at which the motion is fitted to the path, and points per knot span
# that bound the rates
FITTED, RATE_POINTS = 3, 4
# first durations tried, in multiples of the shortest one of the quintic time scaling
TIME_SCALES = (1.02, 1.2, 1.5, 2.0, 3.0, 4.5)
# SLSQP ends when a step changes the cost by less than this share; and after so many iterations
PROGRESS, MOST_ITERATIONS = 1e-5, 80
# SLSQP's effort grows with the constraints: it has those whose slack 1 - ratio² fell below this,
# and more in each round
NEAR, MOST_ROUNDS = 0.75, 6
# times that an NLP is solved with limits tightened after the solve before
REPAIRS = 6
# the largest excess of a constraint, as a ratio of the limit, that the repair between the nodes can
# still undo
FEASIBLE = 1e-3


@dataclass(frozen=True)
class RetimingState:
    """The motion at one point of the NLP: cost [J], its gradient (n,), excess (rows,) and its
    gradients (rows, n).

    A constraint is kept if its value is at least 0.
    """

    cost: float
    gradient: Array
    slack: Array
    slopes: Array


class PathRetiming:
    """Time scalings of `path`, a spline over [0, 1], in an interval of durations.

    The motion is in `space`, the time scaling in `scaling`. Unless given, both have evenly spaced
    knots, and the motion has some more control points than the path.
    """

    def __init__(
        self,
        prepared: PreparedProblem,
        path: Spline,
        interval: DurationInterval,
        space: bspline.Basis | None = None,
        scaling: bspline.Basis | None = None,
    ) -> None:
        self.prepared, self.path, self.interval = prepared, path, interval
        self.least_speed, self.floor = prepared.least_speed, 1 + REPAIR_MARGIN
        self.space = space or bspline.uniform(
            min(len(path.control_points) + MORE_POINTS, MOST_POINTS)
        )
        self.scaling = scaling or bspline.uniform(SCALING_POINTS)
        at = np.linspace(0.0, 1.0, FITTED * self.space.n)
        self._instants, self._at_path = (
            self.scaling.matrix(at),
            self.scaling.matrix(self.space.path_points),
        )
        inner, self._ends = self.space.free, np.zeros((self.space.n, 2))
        self._ends[: self.space.resting, 0], self._ends[-self.space.resting :, 1] = 1.0, 1.0
        matrix = self.space.matrix(at)
        self._fit = np.zeros((self.space.n, len(at)))
        self._fit[inner] = solve(
            matrix[:, inner].T @ matrix[:, inner], matrix[:, inner].T, assume_a="pos"
        )
        self._ends -= self._fit @ matrix @ self._ends

    def solve(self, guess: Array | None = None) -> SolveResult:
        """The time scaling of least cost. While the motion exceeds a limit between the nodes, the
        limit is tightened.

        Without a `guess` x (n,), from the quintic time scaling. The variables where it ends are
        `found`. Ends by DeadlinePassed if the watched deadline passes.
        """
        prepared = self.prepared
        limits, bounds = (
            prepared.problem.arm.active_limits.scaled(1 - MARGIN),
            initial_bounds(prepared.path),
        )
        x, none = (
            self._first(limits) if guess is None else guess,
            np.zeros(len(self.path.control_points[0])),
        )
        iterations = 0
        for solves in range(1, REPAIRS + 1):
            program = RetimingProgram(self, limits, bounds, x)
            x, spent = program.solve()
            self.found = x
            iterations += spent
            if program.excess(x) > FEASIBLE:
                return SolveResult(
                    SolveStatus.FAILED, SolveReason.NO_MOTION_ALONG_PATH, iterations, solves
                )
            spline = self.motion(x)
            factors = repair_factors(prepared, spline, (none, none))
            if factors is not None:
                spline = slightly_retimed(spline, factors, self.interval.t_max)
                factors = repair_factors(prepared, spline, (none, none))
            excess, lacking = (
                path_excess(prepared, spline, prepared.path, None),
                self._lacking(spline),
            )
            if factors is None and not excess.any() and lacking <= 0:
                return SolveResult(
                    SolveStatus.SOLVED, SolveReason.CONVERGED, iterations, solves, spline
                )
            bounds = bounds - excess
            self.floor += max(lacking, 0.0)
            if factors is not None:
                limits = tightened(limits, factors)
        return SolveResult(
            SolveStatus.FAILED, SolveReason.NO_MOTION_ALONG_PATH, iterations, REPAIRS
        )

    def _lacking(self, spline: Spline) -> float:
        """By how much the least speed that is aimed at, as a ratio, has to rise: between the points
        it is missed.
        """
        if self.least_speed is None:
            return 0.0
        q, v, _ = sample(spline, np.linspace(0.0, spline.duration, PATH_SAMPLES))
        missed = 1 + REPAIR_MARGIN / 4 - self.least_speed.reached(q, v)
        return PATH_REPAIR * missed + REPAIR_MARGIN if missed > 0 else 0.0

    def motion(self, x: Array) -> Spline:
        """The motion of the variables x (n,)."""
        # rounding must not leave the duration's bounds
        duration = float(np.clip(np.exp(x[-1]), self.interval.t_min, self.interval.t_max))
        return lasting(spline_of(self.space, self.points(x), duration), duration)

    def points(self, x: Array) -> Array:
        """Control points (n, nq) [rad] of the motion of the variables x."""
        ends = self.path.control_points[[0, -1]]
        return np.asarray(self._fit @ self.path.curve(self._fractions(x)) + self._ends @ ends)

    def slopes(self, x: Array) -> Array:
        """Derivatives (n, nq, m) of the control points by the free control values of the
        scaling."""
        tangent = self.path.curve(self._fractions(x), 1)
        inner = self._instants[:, self.scaling.free]
        return np.stack(
            [(self._fit * tangent[:, j]) @ inner for j in range(tangent.shape[1])], axis=1
        )

    def _fractions(self, x: Array) -> Array:
        """s (k,) at the fitted instants."""
        return self._at(self._instants, x)

    def _at(self, basis: Array, x: Array) -> Array:
        """s (k,) at the instants at which the scaling's basis functions are `basis` (k, n)."""
        resting = np.zeros(self.scaling.resting)
        return np.asarray(
            np.clip(basis @ np.concatenate([resting, x[:-1], resting + 1.0]), 0.0, 1.0)
        )

    def speed_slack(self, x: Array, z: Array, Z: Array) -> tuple[Array, Array]:
        """Slack (k,) of the least speed at the path points, and its derivatives (k, n) by x.

        `z` are q and v (2, k, nq) there, `Z` their derivatives (2, k, nq, n).
        """
        if self.least_speed is None:
            return np.zeros(0), np.zeros((0, len(x)))
        basis = self._at_path
        aim, slope = self.least_speed.aimed_at(self._at(basis, x))
        found = self.least_speed.linearised(*z)
        by_x = (found.by_q @ Z[0] + found.by_v @ Z[1])[:, 0]
        by_x[:, :-1] -= self.floor * slope[:, None] * basis[:, self.scaling.free]
        return found.value[:, 0] - self.floor * aim, by_x

    def _first(self, limits: Limits) -> Array:
        """The quintic time scaling, in the duration of least cost among a few within the limits on
        its rates.
        """
        t_min, t_max = self.interval.t_min, self.interval.t_max
        x = np.append(self.scaling.quintic[self.scaling.free], 0.0)
        unit = spline_of(self.space, self.points(x), 1.0)
        shortest = max(least_time_scale(unit, limits.rates), t_min)
        durations = [shortest * scale for scale in TIME_SCALES if shortest * scale < t_max] or [
            t_max
        ]
        best = np.inf
        for duration in durations:
            cost, tau = self._cost(unit, duration)
            cost = with_excess(cost, tau, limits)
            if cost >= best:
                break
            best, x[-1] = cost, np.log(duration)
        return x

    def variables(self, s: Array, t: Array) -> Array:
        """The variables of a time scaling that is near s (k,) at times t (k,) [s]."""
        x = bspline.greville(self.scaling.knots)
        control = np.linalg.solve(self.scaling.matrix(x), np.interp(x, t / t[-1], s))
        return np.append(
            np.maximum.accumulate(np.clip(control, 0.0, 1.0))[self.scaling.free], np.log(t[-1])
        )

    def _cost(self, unit: Spline, duration: float) -> tuple[float, Array]:
        """Cost [J] and limited torques (N, nq) of a motion of 1 s retimed to `duration` [s]."""
        y = (self.space.at_nodes @ unit.control_points) / np.power(duration, np.arange(3))[
            :, None, None
        ]
        cost, tau = self.prepared.kernel.value(
            y.transpose(1, 0, 2).reshape(len(self.space.nodes), -1), self.interval.p
        )
        return self.interval.constant + duration * float(self.space.weights @ cost), tau

    @cached_property
    def at_rates(self) -> Array:
        """First to third derivative (3, M, n) of the space's basis at the points that bound the
        rates.
        """
        edges = np.unique(self.space.knots)
        inside = np.linspace(0.0, 1.0, RATE_POINTS, endpoint=False)
        points = np.append((edges[:-1, None] + np.diff(edges)[:, None] * inside).ravel(), 1.0)
        return np.stack([self.space.matrix(points, d) for d in range(1, 4)])


class RetimingProgram:
    """The NLP of one solve, in variables x (n,): free control values of the scaling, and the
    duration's logarithm.
    """

    def __init__(self, retiming: PathRetiming, limits: Limits, bounds: Array, first: Array) -> None:
        self.retiming, self.limits, self.bounds, self.first = retiming, limits, bounds, first
        self._known: tuple[bytes, RetimingState] | None = None
        m = len(first) - 1
        # the control values rise from 0 to 1, so the scaling does
        self._rising = np.eye(m + 1, m) - np.eye(m + 1, m, -1)
        self._scale = 1 / max(abs(self.state(first).cost), 1e-9)
        # the constraints that the NLP has: those that a motion came near, and the order of the
        # control values
        self._rows = np.zeros(len(self.state(first).slack), dtype=bool)
        self._rows[-(m + 1) :] = True

    def solve(self) -> tuple[Array, int]:
        """The variables where SLSQP ends, and its iterations."""
        x, iterations = self.first, 0
        for _ in range(MOST_ROUNDS):
            self._rows |= self.state(x).slack < NEAR
            x, spent = self._solve(x)
            iterations += spent
            if self.excess(x) <= FEASIBLE:
                break
        return x, iterations

    def _solve(self, x: Array) -> tuple[Array, int]:
        t_min, t_max = self.retiming.interval.t_min, self.retiming.interval.t_max
        control = x[:-1]
        found = minimize(
            self._cost,
            x,
            jac=self._gradient,
            bounds=Bounds(
                np.append(0 * control, np.log(t_min)), np.append(0 * control + 1, np.log(t_max))
            ),
            constraints=NonlinearConstraint(self._slack, 0.0, np.inf, jac=self._slopes),
            method="SLSQP",
            options={"ftol": PROGRESS, "maxiter": MOST_ITERATIONS},
        )
        return np.asarray(found.x, dtype=float), int(found.nit)

    def _cost(self, x: Array) -> float:
        # in multiples of the first one
        return self._scale * self.state(x).cost

    def _gradient(self, x: Array) -> Array:
        return self._scale * self.state(x).gradient

    def _slack(self, x: Array) -> Array:
        return self.state(x).slack[self._rows]

    def _slopes(self, x: Array) -> Array:
        return self.state(x).slopes[self._rows]

    def excess(self, x: Array) -> float:
        """The largest excess of a constraint over its limit, as a ratio of the limit."""
        return float(-self.state(x).slack.min())

    def state(self, x: Array) -> RetimingState:
        """Cost and constraints at x; SLSQP asks for them one after the other."""
        key = x.tobytes()
        if self._known is None or self._known[0] != key:
            checkpoint()
            self._known = key, self._state(x)
        return self._known[1]

    def _state(self, x: Array) -> RetimingState:
        retiming, space, T = self.retiming, self.retiming.space, float(np.exp(x[-1]))
        P, slopes = retiming.points(x), retiming.slopes(x)
        count, nq, m = len(space.nodes), P.shape[1], slopes.shape[2]
        powers = np.power(T, np.arange(4))[:, None, None]
        z = (space.at_nodes @ P) / powers[:3]
        # derivatives of q, v and a at the nodes by x: (N, 3 nq, n)
        Z = self._by_variables(space.at_nodes, slopes, z, np.arange(3.0), T)
        y = z.transpose(1, 0, 2).reshape(count, 3 * nq)
        Y = Z.transpose(1, 0, 2, 3).reshape(count, 3 * nq, m + 1)
        cost, tau, gradient, jacobian, _ = retiming.prepared.kernel.node(
            y, np.zeros((count, nq)), np.zeros(count), retiming.interval.p
        )
        w = space.weights
        total = T * float(w @ cost)
        by_x = T * np.einsum("k,ki,kin->n", w, gradient, Y)
        by_x[-1] += total
        rates = retiming.at_rates @ P / powers[1:]
        R = self._by_variables(retiming.at_rates, slopes, rates, np.arange(1.0, 4.0), T)
        limits = self.limits.rates[:, None]
        torque, torque_slopes = (
            tau / self.limits.tau_max,
            (jacobian @ Y) / self.limits.tau_max[:, None],
        )
        values = [rates / limits, torque.copy()]
        slack = [1 - value.ravel() ** 2 for value in values]
        rows = [
            -2 * values[0][..., None] * R / limits[..., None],
            -2 * values[1][..., None] * torque_slopes,
        ]
        along, along_slopes = self._path(x, P, slopes, T)
        rising = np.diff(np.concatenate([[0.0], x[:-1], [1.0]]))
        return RetimingState(
            cost=retiming.interval.constant + total,
            gradient=by_x,
            slack=np.concatenate([*slack, along, rising]),
            slopes=np.concatenate(
                [
                    *(row.reshape(-1, m + 1) for row in rows),
                    along_slopes,
                    np.hstack([self._rising, np.zeros((m + 1, 1))]),
                ]
            ),
        )

    def _path(self, x: Array, P: Array, slopes: Array, T: float) -> tuple[Array, Array]:
        """Slack of the path constraints and of the least speed at the path points, and its
        derivatives by x.
        """
        path, space = self.retiming.prepared.path, self.retiming.space
        if path is None and self.retiming.least_speed is None:
            return np.zeros(0), np.zeros((0, len(x)))
        z = space.at_path @ P / np.array([1.0, T])[:, None, None]
        Z = self._by_variables(space.at_path, slopes, z, np.arange(2.0), T)
        slack, rows = self.retiming.speed_slack(x, z, Z)
        if path is None:
            return slack, rows
        found = path.linearised(*z)
        by_x = found.by_q @ Z[0] + found.by_v @ Z[1]
        return (
            np.concatenate([(self.bounds - found.value).ravel(), slack]),
            np.concatenate([-by_x.reshape(-1, by_x.shape[-1]), rows]),
        )

    @staticmethod
    def _by_variables(
        matrices: Array, slopes: Array, values: Array, orders: Array, T: float
    ) -> Array:
        """Derivatives (d, k, nq, n) by x of values (d, k, nq): matrices (d, k, n) on the control
        points, over T^d.

        By the logarithm of T, a value divided by T^d has the derivative -d times itself.
        """
        by_points = np.einsum("dkp,pjm->dkjm", matrices, slopes, optimize=True)
        by_points /= np.power(T, orders)[:, None, None, None]
        return np.concatenate([by_points, (-orders[:, None, None] * values)[..., None]], axis=3)
