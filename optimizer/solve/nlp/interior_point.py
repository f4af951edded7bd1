"""One motion of least mechanical work, with sharp corners, within its limits: a primal-dual
interior-point method.

The work ∫ Σ |p_j| dt, p_j = tau_j v_j, has corners, and limits hold a motion at many points. The
SQP takes QPs of many rows, on a dense Hessian, at every step. Here both become smooth: |p| is
sqrt(p² + width²), and a limit |ratio| ≤ bound has slacks t ≥ 0 with prices λ: λ t = barrier. Width
and barrier fall from step to step. Every limit concerns one span: the Hessian stays banded, and a
step takes a factorisation of the band.

With narrow corners, Newton's method on the smooth cost takes short steps. So the slope u = p /
sqrt(p² + width²) is a variable of its own, as a price is: u sqrt(p² + width²) = p is linearised in
u and p (T. F. Chan, G. H. Golub, P. Mulet, "A nonlinear primal-dual method for total
variation-based image restoration", SIAM J. Sci. Comput. 20, 1999). Slacks and prices: J. Nocedal,
S. J. Wright, "Numerical Optimization", 2006, chapter 19.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.solve.nlp.convex_quadratic import Convexity
from joulepath.optimizer.solve.nlp.limited_motions import LimitedMotions

# first and last barrier, as ratios of the first cost, and the factors by which width and barrier
# fall
BARRIERS, NARROWER, LOWER = (1e-4, 3e-7), 0.6, 0.3
# least slacks at the start, and the share of the way to zero that a step may take a slack, a price
# or a slope
LEAST_SLACK, TO_BOUNDARY = 0.01, 0.995
# share of a torque limit up to which the torques' own curvature, and friction's slope, are left out
NEAR_TORQUE = 0.5
# width and barrier fall after a step of at least this length; the last step is at least as long as
# the second number
LONG_STEP, LAST_STEP = 0.3, 0.9
MAX_ITERATIONS, BACKTRACKS = 80, 8
# part of the promised decrease that a step must reach, and rounding
ARMIJO, ROUNDING = 1e-4, 1e-9
# price of a residual in the merit function, as a multiple of the price of its limit
RESIDUAL_PRICE = 2.0
# prices stay within this factor of barrier / slack
CENTRAL = 1e6
# steps within which a motion must lose the relative decrease `progress`, if it is within its limits
PATIENCE = 3
# a motion is given up if even this multiple of the decrease that its step promises leaves it above
# what it must be
MOST_DECREASE = 3.0
# excess of a ratio over its bound that is none
EXCESS = 2e-5


@dataclass(frozen=True)
class Interior:
    """An iterate: free control points (m, r), slacks and prices (2, K) [J] of the limits below and
    above their bounds, slopes (N, r) of the corners, limited torques (N, r) [N·m], barrier [J] and
    width [W].

    `work` [J] is the smooth work, `scale` [J] that of the first iterate, `excess` the greatest
    excess of a ratio over its bound. `stationarity` is as of the SQP's `Result`. `converged`: a
    further step promises too little, and the motion is within its limits. `costlier`: it was given
    up.
    """

    free: Array
    slack: Array
    price: Array
    slope: Array
    limited: Array
    barrier: float
    width: float
    work: float
    scale: float
    excess: float = np.inf
    stationarity: float = np.inf
    iterations: int = 0
    converged: bool = False
    costlier: bool = False


@dataclass(frozen=True)
class _Nodes:
    """At the nodes of an iterate: powers (N, r) [W] and their smooth absolute values, powers'
    Jacobian (N, r, 3 r), that of the limited torques (N, r, 3 r), and the Hessian (N, 3 r, 3 r) of
    Σ weight u p + pull · limited torque."""

    power: Array
    smooth: Array
    jacobian: Array
    torque_jacobian: Array
    hessian: Array
    ratio: Array


@dataclass(frozen=True)
class _Step:
    """A step: of free control points (m, r), slacks and prices (2, K), slopes (N, r), the iterate's
    residuals (2, K), the cost's slope along it [J], and the largest component of the Lagrangian's
    gradient after it [J/rad]."""

    free: Array
    slack: Array
    price: Array
    slope: Array
    residual: Array
    descent: float
    gradient: float


@dataclass(frozen=True, eq=False)
class InteriorPoint(LimitedMotions):
    """The program of motions of duration T [s] in one spline space. `parameters` are the kernel's,
    packed, of the work with corners of a width [W]; `plain` those whose limited torque is that of
    rigid bodies and rotors."""

    parameters: Callable[[float], Array]
    plain: Array

    def first(self, ends: Array, free: Array, width: float, bounds: Array) -> Interior:
        """The iterate at free control points (m, r) [rad] of a motion between `ends` (2, r), for
        `bounds` (K,).
        """
        y = self._states(self.points(ends, free))
        power = self.kernel.value(y, self.plain)[1] * self._speeds(y)
        cost, limited = self.kernel.value(y, self.parameters(width))
        work, limited = float(self._weights @ cost), limited.copy()
        scale = max(work, 1e-9)
        ratio = self._ratio(ends, free, limited)
        slack = np.maximum(bounds - np.stack([ratio, -ratio]), LEAST_SLACK)
        barrier = BARRIERS[0] * scale
        slope = power / np.hypot(power, width)
        return Interior(free, slack, barrier / slack, slope, limited, barrier, width, work, scale)

    def minimised(
        self,
        ends: Array,
        at: Interior,
        last: float,
        bounds: Array,
        progress: float,
        below: float = np.inf,
    ) -> Interior:
        """The motion of least work with corners of width `last` [W], from an iterate.

        It goes on until a step promises less than the relative decrease `progress`, and is given up
        if its smooth work is not expected to come below `below` [J].
        """
        convexity, found, lost = Convexity(), at, [np.inf]
        for made in range(1, MAX_ITERATIONS + 1):
            checkpoint()
            nodes = self._nodes(ends, found)
            residual = np.stack([nodes.ratio, -nodes.ratio]) - bounds + found.slack
            step = self._step(found, nodes, residual, convexity)
            smooth = float((self._weights[:, None] * nodes.smooth).sum())
            if found.width <= last:
                lost.append(smooth)
            lowest = found.width <= last and found.barrier <= BARRIERS[1] * found.scale
            if found.width <= last and smooth + MOST_DECREASE * min(step.descent, 0.0) > below:
                return replace(found, costlier=True)
            found, length = self._moved(ends, found, step, nodes, bounds, last)
            stationarity = step.gradient / found.scale
            found = replace(
                found, work=smooth, stationarity=stationarity, iterations=at.iterations + made
            )
            little = -step.descent < progress * found.scale and length > LAST_STEP
            little |= lost[-1 - PATIENCE :][0] - lost[-1] < progress * found.scale
            if not length or (lowest and little and found.excess <= EXCESS):
                return replace(found, converged=lowest and found.excess <= EXCESS)
        return found

    def _nodes(self, ends: Array, at: Interior) -> _Nodes:
        y, r = self._states(self.points(ends, at.free)), self._r
        v, joints, count = self._speeds(y), np.arange(r), len(y)
        pull, none, limited_J = self._weights[:, None] * at.slope, np.zeros(count), None
        if (np.abs(at.limited) > NEAR_TORQUE * self.limits.tau_max).any():
            price = self._torque_part(at.price[0] - at.price[1]) / self.limits.tau_max
            near = self.kernel.node(y, price, none, self.parameters(at.width))
            limited_J, bent = near[3].copy(), near[4].copy()
        _, tau, _, J, hessian = self.kernel.node(y, pull * v, none, self.plain)
        if limited_J is None:
            # far from the limits, what friction adds to their change matters little
            limited_J = J
        else:
            hessian = hessian + bent
        # p is a product: its Hessian has the cross terms of torque and speed, too
        cross = pull[:, :, None] * J
        hessian[:, r : 2 * r] += cross
        hessian[:, :, r : 2 * r] += cross.transpose(0, 2, 1)
        jacobian = v[:, :, None] * J
        jacobian[:, joints, r + joints] += tau
        power = tau * v
        ratio = self._ratio(ends, at.free, at.limited)
        return _Nodes(power, np.hypot(power, at.width), jacobian, limited_J, hessian, ratio)

    def _step(self, at: Interior, nodes: _Nodes, residual: Array, convexity: Convexity) -> _Step:
        """The Newton step of all conditions: what it does to slacks and prices is eliminated
        first."""
        target = (at.barrier + at.price * residual) / at.slack
        bend = (at.price / at.slack).sum(axis=0)
        unit = nodes.power / nodes.smooth
        # the curvature of the corner, if its slope keeps up
        corner = self._weights[:, None] / nodes.smooth * np.maximum(1 - at.slope * unit, 0.0)
        torque_bend = self._torque_part(bend) / self.limits.tau_max**2
        hessian = (
            nodes.hessian
            + (nodes.jacobian * corner[:, :, None]).transpose(0, 2, 1) @ nodes.jacobian
        )
        hessian += (nodes.torque_jacobian * torque_bend[:, :, None]).transpose(
            0, 2, 1
        ) @ nodes.torque_jacobian
        cost = self._D.T @ ((self._weights[:, None] * unit)[:, None] @ nodes.jacobian).reshape(
            -1, self._r
        )
        gradient = cost + self._pulled(nodes, target[0] - target[1])
        quadratic = convexity.of(self._pairs.banded(self._blocks(hessian, bend)))
        free = quadratic.least(gradient.ravel()).reshape(self._m, self._r)
        by_state = (self._D @ free).reshape(len(nodes.power), -1, 1)
        change = self._change(free, (nodes.torque_jacobian @ by_state)[:, :, 0])
        slack = -residual - np.stack([change, -change])
        price = (at.barrier - at.price * slack) / at.slack - at.price
        slope = (
            nodes.power + (nodes.jacobian @ by_state)[:, :, 0] * (1 - at.slope * unit)
        ) / nodes.smooth - at.slope
        after = at.price + price
        left = np.abs(cost + self._pulled(nodes, after[0] - after[1])).max()
        descent = float((cost * free).sum()) - at.barrier * float((slack / at.slack).sum())
        return _Step(free, slack, price, slope, residual, descent, float(left))

    def _moved(
        self, ends: Array, at: Interior, step: _Step, nodes: _Nodes, bounds: Array, last: float
    ) -> tuple[Interior, float]:
        """The next iterate, and the length of the step: as far as slacks stay positive, halved
        until the merit function falls; 0 if it does not. Prices and slopes go as far as they stay
        within their bounds.

        The merit function is the cost with the barriers of the slacks, and a price on every
        residual. Where a limit is further away than its slack says, the slack is that.
        """
        parameters = self.parameters(at.width)
        weight = RESIDUAL_PRICE * np.maximum(at.price, at.price + step.price)
        wrong = float((weight * np.abs(step.residual)).sum())
        before = (
            float((self._weights[:, None] * nodes.smooth).sum())
            - at.barrier * float(np.log(at.slack).sum())
            + wrong
        )
        descent = min(step.descent - wrong, 0.0)
        length = _most(at.slack, step.slack)
        for _ in range(BACKTRACKS):
            free, slack = at.free + length * step.free, at.slack + length * step.slack
            cost, limited = self.kernel.value(self._states(self.points(ends, free)), parameters)
            ratio = self._ratio(ends, free, limited)
            room = bounds - np.stack([ratio, -ratio])
            slack = np.maximum(slack, room)
            merit = float(self._weights @ cost) - at.barrier * float(np.log(slack).sum())
            merit += float((weight * (slack - room)).sum())
            if merit <= before + ARMIJO * length * descent + ROUNDING * abs(before):
                return self._with_prices(
                    replace(
                        at,
                        free=free,
                        slack=slack,
                        limited=limited.copy(),
                        excess=-float(room.min()),
                    ),
                    step,
                    length,
                    last,
                ), length
            length /= 2
        return self._with_prices(at, step, 0.0, last), 0.0

    def _with_prices(self, at: Interior, step: _Step, length: float, last: float) -> Interior:
        """The iterate with the prices and slopes of a step of some length, and with what falls
        after a long one.
        """
        central = at.barrier / at.slack
        price = np.maximum(at.price + _most(at.price, step.price) * step.price, 0.0)
        up = _most(1 - at.slope, -step.slope), _most(1 + at.slope, step.slope)
        falls = length > LONG_STEP
        return replace(
            at,
            price=np.clip(price, central / CENTRAL, central * CENTRAL),
            slope=np.clip(at.slope + min(up) * step.slope, -1.0, 1.0),
            width=max(last, NARROWER * at.width) if falls else at.width,
            barrier=max(BARRIERS[1] * at.scale, LOWER * at.barrier) if falls else at.barrier,
        )

    def _blocks(self, hessian: Array, bend: Array) -> Array:
        """The blocks of pairs of a Hessian at the nodes (N, 3 r, 3 r), with the curvatures (K,) of
        the barriers.
        """
        r, joints, pairs = self._r, np.arange(self._r), self._pairs
        by_three = hessian.reshape(-1, 3, r, 3, r).transpose(0, 1, 3, 2, 4).reshape(-1, r * r)
        blocks = np.asarray(self._node_products @ by_three).reshape(-1, r, r)
        blocks[:, joints, joints] += self._rate_products @ (
            self._rate_part(bend) / self._rate_limits**2
        )
        blocks[pairs.own[:, None], joints, joints] += self._place_part(bend) / self._half**2
        return blocks

    def _pulled(self, nodes: _Nodes, weight: Array) -> Array:
        """The gradient (m, r) of Σ weight · ratio, weight (K,)."""
        by_torque = self._torque_part(weight) / self.limits.tau_max
        torques = self._D.T @ (by_torque[:, None] @ nodes.torque_jacobian).reshape(-1, self._r)
        rates = self._R.T @ (self._rate_part(weight) / self._rate_limits)
        return np.asarray(torques + rates + self._place_part(weight) / self._half)

    def _change(self, free: Array, torque: Array) -> Array:
        """Changes (K,) of the ratios with those of the control points (m, r) and of the limited
        torques (N, r).
        """
        rates, places = self._R @ free / self._rate_limits, free / self._half
        return np.concatenate(
            [rates.ravel(), places.ravel(), (torque / self.limits.tau_max).ravel()]
        )

    def _ratio(self, ends: Array, free: Array, limited: Array) -> Array:
        """Rates, places and limited torques (N, r) over their limits, (K,); places from the middle
        of their range.
        """
        rates = self._at_rates @ self.points(ends, free) / self._rate_limits
        places = (free - (self.limits.q_max + self.limits.q_min) / 2) / self._half
        return np.concatenate(
            [rates.ravel(), places.ravel(), (limited / self.limits.tau_max).ravel()]
        )


def _most(value: Array, change: Array) -> float:
    """The length ≤ 1 of a change by which positive values stay positive."""
    falling = change < 0
    shares = -value[falling] / change[falling]
    return min(1.0, TO_BOUNDARY * float(np.min(shares, initial=np.inf)))
