"""Many motions of one duration at a time, roughly: Newton steps on stacked arrays, with the limits
as penalties.

Screens, restarts and the way to sharp corners need dozens of motions that are nearly optimal and
nearly within the limits. A step of the SQP takes some ms of Python on small arrays, and of QPs.
Here all motions share the Python, and the square of what exceeds a limit costs something: no QP.
The Hessian of a B-spline is banded.

A Newton step often exceeds the limits on rates by far: then it is restrained by a price on the
squares of all rates, which bends the step. To shorten it would leave nothing of it.
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

# cost of the mean square of what exceeds a limit, as ratios of the limit and of the first cost
PENALTY = 500.0
# points per span at which the rates are limited
RATE_POINTS = 4
# no coordinate of a control point moves further in one step [rad]
STEP = 1.5
MAX_ITERATIONS, BACKTRACKS = 40, 10
# part of the decrease promised by the gradient that a step must reach
ARMIJO = 1e-4
# a motion is given up if even this multiple of the decrease that its step promises leaves it behind
MOST_DECREASE = 3.0
# restraints that are tried for one step, the least one, and the factors by which it grows, and
# falls after a full step
RESTRAINTS, LEAST_RESTRAINT, HARDER, EASIER = 10, 1e-5, 8.0, 4.0


@dataclass(frozen=True)
class Motions:
    """Free control points (B, m, nq) [rad], costs and penalties (B,) [J] of motions, and the steps
    that were made.
    """

    free: Array
    cost: Array
    penalty: Array
    iterations: int


@dataclass(frozen=True)
class _State:
    """Motions on the way: free control points (B, m, nq), costs, penalties (B,) and their scales
    [J], what of the torques' ratios is beyond ±1 (B, N, nq), and restraints (B,)."""

    free: Array
    cost: Array
    penalty: Array
    scale: Array
    beyond: Array
    restraint: Array
    convexity: list[Convexity]


@dataclass(frozen=True, eq=False)
class ManyMotions(TimedMotions):
    """The programs of motions in one spline space, of one duration T [s], with packed kernel
    parameters p.
    """

    p: Array

    def minimised(
        self, ends: Array, free: Array, progress: float, behind: float = np.inf, sure: int = 1
    ) -> Motions:
        """Motions between `ends` (B, 2, nq) [rad] from free control points (B, m, nq) [rad].

        Each goes on until a step promises less than the relative decrease `progress`, and is given
        up if it is expected to need more than `behind` times the least of all; but `sure` steps are
        made.
        """
        cost, penalty, beyond = self._value(ends, free, np.ones(len(free)))
        scale = np.maximum(cost, 1e-9)
        convexity = [Convexity() for _ in free]
        now = _State(
            free.copy(), cost, penalty * scale, scale, beyond, np.zeros(len(free)), convexity
        )
        at, iterations = np.arange(len(free)), 0
        for made in range(MAX_ITERATIONS):
            checkpoint()
            iterations += len(at)
            steps, slopes, promised = self._steps(ends, now, at)
            total = now.cost + now.penalty
            if made >= sure:
                enough = promised >= progress * total[at]
                going = enough & (total[at] - MOST_DECREASE * promised <= behind * total.min())
                at, steps, slopes = at[going], steps[going], slopes[going]
            at = at[self._moved(ends, now, at, steps, slopes)]
            if not len(at):
                break
        return Motions(now.free, now.cost, now.penalty, iterations)

    def costs(self, points: Array, p: Array) -> Array:
        """Costs (B,) [J] of motions by their control points (B, n, nq), with other kernel
        parameters.
        """
        return np.array([self._weights @ self.kernel.value(y, p)[0] for y in self._states(points)])

    def _steps(self, ends: Array, now: _State, at: Index) -> tuple[Array, Array, Array]:
        """Steps (k, m nq) of the motions `at`, the slopes along them and the decreases that they
        promise, (k,) [J].
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
        """The step (m nq,) of motion b, no longer than STEP, and the decrease [J] that it promises.

        It is restrained until its rates do not cost more than it promises.
        """
        quadratic = now.convexity[b].of(band)
        weight = PENALTY * float(now.scale[b]) / self._rate_count
        before = float((_beyond_one(ratio) ** 2).sum())
        for _ in range(RESTRAINTS):
            price = 2 * weight * float(now.restraint[b])
            first, second = self._rate_bends
            x = quadratic.least(gradient, (price * first, price * second) if price else None)
            x *= min(1.0, STEP / max(float(np.abs(x).max()), 1e-300))
            promised = -float(gradient @ x) - 0.5 * quadratic.bend(x)
            change = self._R @ x.reshape(-1, self._r) / self._rate_limits
            if weight * (float((_beyond_one(ratio + change) ** 2).sum()) - before) <= promised:
                break
            now.restraint[b] = max(HARDER * now.restraint[b], LEAST_RESTRAINT)
        return x, promised

    def _moved(self, ends: Array, now: _State, at: Index, steps: Array, slopes: Array) -> Array:
        """Make the steps of the motions `at`, halved until they lower cost and penalty; which of
        them do (k,).
        """
        todo, alpha, total = np.arange(len(at)), 1.0, now.cost + now.penalty
        for _ in range(BACKTRACKS):
            if not len(todo):
                break
            to = at[todo]
            free = now.free[to] + alpha * steps[todo].reshape(-1, self._m, self._r)
            allowed = total[to] + ARMIJO * alpha * slopes[todo]
            found = free, *self._value(ends[to], free, now.scale[to], allowed)
            good = found[1] + found[2] <= allowed
            to = to[good]
            now.free[to], now.cost[to], now.penalty[to], now.beyond[to] = (
                each[good] for each in found
            )
            if alpha == 1.0:
                now.restraint[to] /= EASIER
            todo, alpha = todo[~good], alpha / 2
        moved = np.ones(len(at), dtype=bool)
        moved[todo] = False
        return moved

    def _value(
        self, ends: Array, free: Array, scale: Array, allowed: Array | None = None
    ) -> tuple[Array, Array, Array]:
        """Costs and penalties (B,) [J], and what of the torques' ratios is beyond ±1, (B, N, nq).

        Costs and torques are left out where the penalty of the rates alone is more than `allowed`
        (B,) [J].
        """
        points = self.points(ends, free)
        rates, places = _beyond_one(self._rate_ratio(points)), self._misplaced(free)
        mean = (rates**2).sum(axis=(1, 2)) / self._rate_count + (places**2).sum(axis=(1, 2))
        cost, beyond = np.zeros(len(free)), np.zeros((len(free), len(self.basis.nodes), self._r))
        wanted = (
            np.arange(len(free))
            if allowed is None
            else np.flatnonzero(PENALTY * scale * mean <= allowed)
        )
        y = self._states(points)
        for b in wanted.tolist():
            power, tau = self.kernel.value(y[b], self.p)
            cost[b], beyond[b] = self._weights @ power, _beyond_one(tau / self.limits.tau_max)
        mean += (beyond**2).sum(axis=2) @ self.basis.weights
        return cost, PENALTY * scale * mean, beyond

    def _rate_ratio(self, points: Array) -> Array:
        """Rates over their limits, (B, 3 M, nq)."""
        return np.asarray(self._at_rates @ points / self._rate_limits)

    def _misplaced(self, free: Array) -> Array:
        """What of the control points is beyond the position limits, (B, m, nq) [rad]."""
        return np.asarray(free - np.clip(free, self.limits.q_min, self.limits.q_max))

    def _derivatives(
        self, ends: Array, free: Array, scale: Array, beyond: Array
    ) -> tuple[Array, Array]:
        """Gradients (B, m nq) of cost and penalties, and the lower bands (B, m nq, band + 1) of
        their Hessians, column by column."""
        many, r, joints = len(free), self._r, np.arange(self._r)
        count, points = len(self.basis.nodes), self.points(ends, free)
        weight = 2 * PENALTY * scale
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
        """Gradient (N, 3 nq) and Hessian (N, 3, 3, nq, nq) by q, v, a of one motion's cost and
        torque penalty.
        """
        pull, r = weight[:, None] * beyond / self.limits.tau_max, self._r
        _, _, gradient, J, hessian = self.kernel.node(y, pull, self._weights, self.p)
        gradient = self._weights[:, None] * gradient
        k = np.flatnonzero(beyond.any(axis=1))
        if len(k):
            gradient[k] += (pull[k, None, :] @ J[k])[:, 0]
            bend = weight[k, None] * (beyond[k] != 0) / self.limits.tau_max**2
            hessian = hessian.copy()
            hessian[k] += (J[k] * bend[:, :, None]).transpose(0, 2, 1) @ J[k]
        return gradient, hessian.reshape(-1, 3, r, 3, r).transpose(0, 1, 3, 2, 4)

    @cached_property
    def _rate_places(self) -> list[Array]:
        """RATE_POINTS per span, and the ends."""
        edges = np.unique(self.basis.knots)
        within = (np.arange(RATE_POINTS) + 0.5) / RATE_POINTS
        return [
            np.concatenate(
                [[0.0], (edges[:-1, None] + np.diff(edges)[:, None] * within).ravel(), [1.0]]
            )
        ] * 3

    @property
    def _rate_count(self) -> int:
        return len(self._rate_places[0])

    @cached_property
    def _rate_bends(self) -> tuple[Array, Array]:
        """Second derivatives of half the sum of the squares of all rates' ratios: lower band, and
        upper triangle.
        """
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
