"""Motions along a given curve in joint space, as functions of a time scaling.

The path is γ(s), s ∈ [0, 1]. The time scaling s(τ) is a spline at rest at both ends, whose control
values rise. They and the duration T are the decision variables. The motion is the spline q(τ) that
fits γ(s(τ)) best, by a linear map that the spline space fixes. Its control points P are therefore
smooth functions of the variables,

    ∂P/∂c = F diag(γ'(s)) B,

with the values B of the scaling's basis at the fitted instants and the map F of the fit. Cost,
rates and torques are those of the spline itself: the fit leaves no error to check afterwards,
except for the distance from the path.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve
from scipy.sparse import csr_matrix

from joulepath.models.robot import Array
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import Spline, lasting, spline_of
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.methods.duration_intervals import DurationInterval
from joulepath.optimizer.solve.methods.limit_repair import LIMIT_REPAIR


@dataclass(frozen=True)
class RetimedPathSettings:
    """Settings of the spline spaces of a retimed path."""

    scaling_points: int = 17
    """Control values of the time scaling."""

    further_points: int = 12
    """Control points that the motion has more than its path."""

    most_points: int = 72
    """Largest number of control points of the motion."""

    fitted_per_span: int = 3
    """Instants per knot span at which the motion is fitted to the path."""

    law_per_span: int = 16
    """Instants per knot span at which the law of a motion is told."""

    rate_points: int = 4
    """Points per knot span that bound the rates."""


RETIMED_PATH = RetimedPathSettings()


class RetimedPath:
    """The motion along a path as a function of the variables x of its time scaling.

    The variables, shape (m + 1,), are the m free control values of the scaling and the duration.

    Args:
        prepared: the problem.
        path: the path, a spline over [0, 1].
        interval: allowed durations and the cost.
        space: space of the motion; None for evenly spaced knots, with more control points than the
            path.
        scaling: space of the time scaling; None for evenly spaced knots.
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
        self.least_speed, self.floor = prepared.least_speed, 1 + LIMIT_REPAIR.tightening
        settings = RETIMED_PATH
        count = min(len(path.control_points) + settings.further_points, settings.most_points)
        self.space = space or bspline.uniform(count)
        self.scaling = scaling or bspline.uniform(settings.scaling_points)
        at = instants_in_spans(np.unique(self.space.knots), settings.fitted_per_span)
        self._instants = self.scaling.matrix(at)
        # a control value changes the scaling at few instants
        self._free_instants = csr_matrix(self._instants[:, self.scaling.free])
        self._at_path = self.scaling.matrix(self.space.path_points)
        inner, self._ends = self.space.free, np.zeros((self.space.n, 2))
        self._ends[: self.space.resting, 0], self._ends[-self.space.resting :, 1] = 1.0, 1.0
        matrix = self.space.matrix(at)
        self._fit = np.zeros((self.space.n, len(at)))
        self._fit[inner] = solve(
            matrix[:, inner].T @ matrix[:, inner], matrix[:, inner].T, assume_a="pos"
        )
        self._ends -= self._fit @ matrix @ self._ends

    def motion(self, x: Array) -> Spline:
        """The motion of the variables x (m + 1,)."""
        # rounding must not leave the duration's bounds
        duration = float(np.clip(x[-1], self.interval.t_min, self.interval.t_max))
        return lasting(spline_of(self.space, self.points(x), duration), duration)

    def points(self, x: Array) -> Array:
        """Control points (n, nq) [rad] of the motion of the variables x."""
        ends = self.path.control_points[[0, -1]]
        return np.asarray(self._fit @ self.path.curve(self._fractions(x)) + self._ends @ ends)

    def slopes(self, x: Array) -> Array:
        """Derivatives (n, nq, m) of the control points by the scaling's free control values."""
        tangent = self.path.curve(self._fractions(x), 1)
        by_instants = self._fit.T[:, :, None] * tangent[:, None]
        by_values = self._free_instants.T @ by_instants.reshape(len(tangent), -1)
        shape = (self.space.n, tangent.shape[1], -1)
        return np.ascontiguousarray(by_values.T).reshape(shape)

    def law(self, x: Array) -> tuple[Array, Array]:
        """Times (k,) [s] and fractions (k,) of the path of the variables x."""
        breaks = np.unique(self.scaling.knots)
        at = instants_in_spans(breaks, RETIMED_PATH.law_per_span)
        return at * x[-1], np.maximum.accumulate(self._at(self.scaling.matrix(at), x))

    def _fractions(self, x: Array) -> Array:
        """s (k,) at the fitted instants."""
        return self._at(self._instants, x)

    def _at(self, basis: Array, x: Array) -> Array:
        """s (k,) at the instants of a basis matrix (k, n) of the scaling."""
        resting = np.zeros(self.scaling.resting)
        return np.asarray(
            np.clip(basis @ np.concatenate([resting, x[:-1], resting + 1.0]), 0.0, 1.0)
        )

    def by_control_values(self, x: Array, by_points: Array) -> Array:
        """Derivatives (m,) by the scaling's free control values.

        Args:
            x: the variables, shape (m + 1,).
            by_points: derivatives by the control points, shape (n, nq).
        """
        tangent = self.path.curve(self._fractions(x), 1)
        by_fraction = ((self._fit.T @ by_points) * tangent).sum(axis=1)
        return np.asarray(by_fraction @ self._instants[:, self.scaling.free])

    def curvature(self, x: Array, by_points: Array) -> Array:
        """Second derivatives (m, m) by the control values, due to the curvature of the path.

        Args:
            x: the variables, shape (m + 1,).
            by_points: derivatives by the control points, shape (n, nq).
        """
        bend = self.path.curve(self._fractions(x), 2)
        by_fraction = ((self._fit.T @ by_points) * bend).sum(axis=1)
        inner = self._free_instants
        return np.asarray((inner.T @ inner.multiply(by_fraction[:, None])).toarray())

    def least_speed_at_path(self, x: Array) -> tuple[Array, Array]:
        """The least ratio of speeds at the path points, and its derivatives.

        Args:
            x: the variables, shape (m + 1,).

        Returns:
            The ratios, shape (k,), and their derivatives by the scaling's free control values,
            shape (k, m).
        """
        assert self.least_speed is not None
        aim, slope = self.least_speed.aimed_at(self._at(self._at_path, x))
        return self.floor * aim, self.floor * slope[:, None] * self._at_path[:, self.scaling.free]

    def variables(self, s: Array, t: Array) -> Array:
        """Variables (m + 1,) of a time scaling near the fractions s (k,) at times t (k,) [s]."""
        x = bspline.greville(self.scaling.knots)
        control = np.linalg.solve(self.scaling.matrix(x), np.interp(x, t / t[-1], s))
        return np.append(
            np.maximum.accumulate(np.clip(control, 0.0, 1.0))[self.scaling.free], t[-1]
        )

    @cached_property
    def at_rates(self) -> Array:
        """Derivatives (3, M, n) of orders 1 to 3 of the space's basis where rates are bounded."""
        points = instants_in_spans(np.unique(self.space.knots), RETIMED_PATH.rate_points)
        return np.stack([self.space.matrix(points, d) for d in range(1, 4)])


def instants_in_spans(breaks: Array, count: int) -> Array:
    """A number of instants in every span between `breaks` (k,), and the last break."""
    inside = np.linspace(0.0, 1.0, count, endpoint=False)
    return np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * inside).ravel(), breaks[-1])
