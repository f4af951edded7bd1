"""Coarse solves of a batch of motions of one duration: Newton steps on stacked arrays.

Screening, random restarts and continuation to narrow corners need dozens of motions that are nearly
optimal and nearly within the limits. A step of the SQP takes some milliseconds for Python on small
arrays, and for QPs. Here all motions of a batch share the Python, and the squared excess over a
limit is a penalty of the cost instead of a QP. The Hessian of a B-spline is banded.

A Newton step often exceeds the limits on rates by far. Shortening it would leave almost nothing of
it. Instead the step is damped: a price on the squares of all rates changes its direction, as in the
method of Levenberg and Marquardt.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.solve.nlp.active_path_constraints import Index
from joulepath.optimizer.solve.nlp.convex_quadratic import Convexity
from joulepath.optimizer.solve.nlp.timed_motions import TimedMotions


@dataclass(frozen=True)
class BatchedMotionSettings:
    """Settings of coarse solves of a batch of motions."""

    penalty: float = 500.0
    """Cost of the mean squared excess over the limits, as ratios of the limit and of the first
    cost."""

    largest_step: float = 1.5
    """Largest change of a coordinate of a control point in one step [rad]."""

    max_iterations: int = 40
    """Largest number of iterations."""

    max_backtracks: int = 10
    """Largest number of trial points of a line search."""

    armijo: float = 1e-4
    """Share of the decrease promised by the gradient that a step must reach."""

    optimism: float = 3.0
    """Multiple of the promised decrease that a step is trusted to reach: a motion is given up if
    even this leaves it behind."""

    max_dampings: int = 10
    """Largest number of prices on rates tried for one step."""

    least_damping: float = 1e-5
    """Smallest price on rates that is not zero, relative to the penalty."""

    damping_growth: float = 8.0
    """Factor of the price after a step whose rates cost more than it promises."""

    damping_decay: float = 4.0
    """Divisor of the price after a full step."""


BATCHED_MOTIONS = BatchedMotionSettings()


@dataclass(frozen=True)
class Motions:
    """Motions of a batch."""

    free: Array
    """Free control points, shape (B, m, nq) [rad]."""

    cost: Array
    """Costs, shape (B,) [J]."""

    penalty: Array
    """Penalties of the excess over the limits, shape (B,) [J]."""

    iterations: int
    """Number of steps made, over all motions."""


@dataclass(frozen=True)
class _State:
    """Iterates of the motions of a batch, overwritten in place."""

    free: Array
    """Free control points, shape (B, m, nq) [rad]."""

    cost: Array
    """Costs, shape (B,) [J]."""

    penalty: Array
    """Penalties, shape (B,) [J]."""

    scale: Array
    """First costs, shape (B,) [J]."""

    beyond: Array
    """Excess of the torques' ratios over ±1, shape (B, N, nq)."""

    damping: Array
    """Prices on rates, relative to the penalty, shape (B,)."""

    convexity: list[Convexity]
    """Corrections of the Hessians."""


@dataclass(frozen=True, eq=False)
class BatchedMotions(TimedMotions):
    """Programs of motions of one duration T [s] in one spline space."""

    p: Array
    """Packed parameters of the kernel."""

    def minimised(
        self, ends: Array, free: Array, progress: float, behind: float = np.inf, sure: int = 1
    ) -> Motions:
        """Minimise costs and penalties of a batch of motions.

        Args:
            ends: starts and goals, shape (B, 2, nq) [rad].
            free: free control points, shape (B, m, nq) [rad].
            progress: relative decrease of the cost that a further step must promise.
            behind: a motion is given up if it is expected to cost more than this multiple of the
                least cost of the batch.
            sure: steps made whatever they promise.

        Returns:
            The motions reached.
        """
        settings = BATCHED_MOTIONS
        cost, penalty, beyond = self._value(ends, free, np.ones(len(free)))
        scale = np.maximum(cost, 1e-9)
        convexity = [Convexity() for _ in free]
        now = _State(
            free.copy(), cost, penalty * scale, scale, beyond, np.zeros(len(free)), convexity
        )
        at, iterations = np.arange(len(free)), 0
        for made in range(settings.max_iterations):
            checkpoint()
            iterations += len(at)
            steps, slopes, promised = self._steps(ends, now, at)
            total = now.cost + now.penalty
            if made >= sure:
                enough = promised >= progress * total[at]
                going = enough & (total[at] - settings.optimism * promised <= behind * total.min())
                at, steps, slopes = at[going], steps[going], slopes[going]
            at = at[self._moved(ends, now, at, steps, slopes)]
            if not len(at):
                break
        return Motions(now.free, now.cost, now.penalty, iterations)

    def costs(self, points: Array, p: Array) -> Array:
        """Costs (B,) [J] for all control points (B, n, nq) and other kernel parameters p."""
        return np.array([self._weights @ self.kernel.value(y, p)[0] for y in self._states(points)])

    def _steps(self, ends: Array, now: _State, at: Index) -> tuple[Array, Array, Array]:
        """Newton steps of some motions.

        Args:
            ends: starts and goals of all motions, shape (B, 2, nq) [rad].
            now: iterates of all motions.
            at: indices of the motions, shape (k,).

        Returns:
            Steps (k, m nq), the slopes along them and the decreases they promise, (k,) [J].
        """
        gradient, band = self._derivatives(ends[at], now.free[at], now.scale[at], now.beyond[at])
        ratio = self._rate_ratio(self.points(ends[at], now.free[at]))
        steps, promised = np.zeros_like(gradient), np.zeros(len(at))
        for k, b in enumerate(at.tolist()):
            steps[k], promised[k] = self._step(gradient[k], band[k], ratio[k], now, b)
        return steps, (gradient * steps).sum(axis=1), promised

    def _step(
        self, gradient: Array, band: Array, ratio: Array, now: _State, b: int
    ) -> tuple[Array, float]:
        """Step (m nq,) of motion b, and the decrease it promises [J].

        The step is damped until its rates do not cost more than it promises.
        """
        settings = BATCHED_MOTIONS
        quadratic = now.convexity[b].of(band)
        weight = settings.penalty * float(now.scale[b]) / self._rate_count
        before = float((_beyond_one(ratio) ** 2).sum())
        for _ in range(settings.max_dampings):
            price = 2 * weight * float(now.damping[b])
            band_part, triangle = self._rate_curvature
            x = quadratic.least(gradient, (price * band_part, price * triangle) if price else None)
            x *= min(1.0, settings.largest_step / max(float(np.abs(x).max()), 1e-300))
            promised = -float(gradient @ x) - 0.5 * quadratic.curvature(x)
            change = self._R @ x.reshape(-1, self._r) / self._rate_limits
            if weight * (float((_beyond_one(ratio + change) ** 2).sum()) - before) <= promised:
                break
            now.damping[b] = max(settings.damping_growth * now.damping[b], settings.least_damping)
        return x, promised

    def _moved(self, ends: Array, now: _State, at: Index, steps: Array, slopes: Array) -> Array:
        """Make steps of motions `at`, halved until cost and penalty fall; mask (k,) of success."""
        settings = BATCHED_MOTIONS
        todo, alpha, total = np.arange(len(at)), 1.0, now.cost + now.penalty
        for _ in range(settings.max_backtracks):
            if not len(todo):
                break
            to = at[todo]
            free = now.free[to] + alpha * steps[todo].reshape(-1, self._m, self._r)
            allowed = total[to] + settings.armijo * alpha * slopes[todo]
            found = free, *self._value(ends[to], free, now.scale[to], allowed)
            good = found[1] + found[2] <= allowed
            to = to[good]
            now.free[to], now.cost[to], now.penalty[to], now.beyond[to] = (
                each[good] for each in found
            )
            if alpha == 1.0:
                now.damping[to] /= settings.damping_decay
            todo, alpha = todo[~good], alpha / 2
        moved = np.ones(len(at), dtype=bool)
        moved[todo] = False
        return moved

    def _value(
        self, ends: Array, free: Array, scale: Array, allowed: Array | None = None
    ) -> tuple[Array, Array, Array]:
        """Costs and penalties of motions.

        Args:
            ends: starts and goals, shape (B, 2, nq) [rad].
            free: free control points, shape (B, m, nq) [rad].
            scale: first costs, shape (B,) [J].
            allowed: penalties of rates alone above which costs and torques are left out, shape
                (B,) [J].

        Returns:
            Costs and penalties (B,) [J], and the excess of the torques' ratios over ±1, (B, N, nq).
        """
        penalty = BATCHED_MOTIONS.penalty
        points = self.points(ends, free)
        rates, places = _beyond_one(self._rate_ratio(points)), self._misplaced(free)
        mean = (rates**2).sum(axis=(1, 2)) / self._rate_count + (places**2).sum(axis=(1, 2))
        cost, beyond = np.zeros(len(free)), np.zeros((len(free), len(self.basis.nodes), self._r))
        wanted = (
            np.arange(len(free))
            if allowed is None
            else np.flatnonzero(penalty * scale * mean <= allowed)
        )
        y = self._states(points)
        for b in wanted.tolist():
            power, tau = self.kernel.value(y[b], self.p)
            cost[b], beyond[b] = self._weights @ power, _beyond_one(tau / self.limits.tau_max)
        mean += (beyond**2).sum(axis=2) @ self.basis.weights
        return cost, penalty * scale * mean, beyond

    def _rate_ratio(self, points: Array) -> Array:
        """Rates over their limits, (B, 3 M, nq)."""
        return np.asarray(self._at_rates @ points / self._rate_limits)

    def _misplaced(self, free: Array) -> Array:
        """Excess of control points over the position limits, (B, m, nq) [rad]."""
        return np.asarray(free - np.clip(free, self.limits.q_min, self.limits.q_max))

    def _derivatives(
        self, ends: Array, free: Array, scale: Array, beyond: Array
    ) -> tuple[Array, Array]:
        """Gradients (B, m nq) of cost and penalty, and lower bands of the Hessians.

        The bands (B, m nq, band + 1) have the columns of the Hessians as rows.
        """
        many, r, joints = len(free), self._r, np.arange(self._r)
        count, points = len(self.basis.nodes), self.points(ends, free)
        weight = 2 * BATCHED_MOTIONS.penalty * scale
        G, H = np.empty((many, count, 3 * r)), np.empty((many, count, 3, 3, r, r))
        for b, y in enumerate(self._states(points)):
            G[b], H[b] = self._node(y, weight[b] * self.basis.weights, beyond[b])
        gradient = self._D.T @ G.reshape(many, -1, r)
        blocks = (self._node_products @ H.reshape(many, -1, r * r)).reshape(many, -1, r, r)
        rates, places = _beyond_one(self._rate_ratio(points)), self._misplaced(free)
        weight = weight[:, None, None]
        if rates.any():
            by_limit = weight / self._rate_count / self._rate_limits
            gradient += self._R.T @ (by_limit * rates)
            blocks[:, :, joints, joints] += self._rate_products @ (
                by_limit * (rates != 0) / self._rate_limits
            )
        if places.any():
            gradient += weight * places
            blocks[:, self._pairs.own[:, None], joints, joints] += weight * (places != 0)
        return gradient.reshape(many, -1), self._pairs.banded(blocks)

    def _node(self, y: Array, weight: Array, beyond: Array) -> tuple[Array, Array]:
        """Gradient (N, 3 nq) and Hessian (N, 3, 3, nq, nq) of cost and torque penalty."""
        pull, r = weight[:, None] * beyond / self.limits.tau_max, self._r
        _, _, gradient, J, hessian = self.kernel.node(y, pull, self._weights, self.p)
        gradient = self._weights[:, None] * gradient
        k = np.flatnonzero(beyond.any(axis=1))
        if len(k):
            gradient[k] += (pull[k, None, :] @ J[k])[:, 0]
            curvature = weight[k, None] * (beyond[k] != 0) / self.limits.tau_max**2
            hessian = hessian.copy()
            hessian[k] += (J[k] * curvature[:, :, None]).transpose(0, 2, 1) @ J[k]
        return gradient, hessian.reshape(-1, 3, r, 3, r).transpose(0, 1, 3, 2, 4)

    @property
    def _rate_count(self) -> int:
        return len(self._rate_places)

    @cached_property
    def _rate_curvature(self) -> tuple[Array, Array]:
        """Hessian of half the sum of all squared ratios of rates: lower band, upper triangle."""
        (i, j), joints, n = self._pairs.pairs, np.arange(self._r), self._m * self._r
        row, column = (each[:, None] * self._r + joints for each in (i, j))
        band, upper = np.zeros((n, self._pairs.band + 1)), np.zeros((n, n))
        band[row, column - row] = upper[row, column] = self._rate_products @ (
            1 / self._rate_limits**2
        )
        return band, upper


def _beyond_one(ratio: Array) -> Array:
    # `np.clip` takes twice as long
    return np.asarray(ratio - np.minimum(np.maximum(ratio, -1.0), 1.0))
