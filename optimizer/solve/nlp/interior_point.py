"""Motion of least mechanical work with narrow corners: a primal-dual interior-point method.

The work ∫ Σ |p_j| dt, p_j = tau_j v_j, has corners, and limits are active at many points. The SQP
would need QPs of many rows, with a dense Hessian, in every step. Here both become smooth: |p| is
sqrt(p² + width²), and a limit |ratio| ≤ bound has slacks t ≥ 0 with prices λ: λ t = barrier. Width
and barrier fall from step to step. Every limit concerns one span: the Hessian stays banded, and a
step takes one factorisation of the band.

With narrow corners, Newton's method on the smooth cost takes short steps. Therefore the slope u =
p / sqrt(p² + width²) is a variable, as a price is: u sqrt(p² + width²) = p is linearised in u and
p (T. F. Chan, G. H. Golub, P. Mulet, "A nonlinear primal-dual method for total
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
from joulepath.optimizer.solve.nlp.interior_state import Interior, InteriorNodes, InteriorStep
from joulepath.optimizer.solve.nlp.limited_motions import LimitedMotions


@dataclass(frozen=True)
class InteriorPointSettings:
    """Settings of the interior-point method."""

    first_barrier: float = 1e-4
    """Barrier of the first iterate, relative to its cost."""

    last_barrier: float = 3e-7
    """Smallest barrier, relative to the cost of the first iterate."""

    width_decay: float = 0.6
    """Factor of the width of the corners after a long step."""

    barrier_decay: float = 0.3
    """Factor of the barrier after a long step."""

    least_slack: float = 0.01
    """Smallest slack of the first iterate."""

    to_boundary: float = 0.995
    """Share of the way to zero that a step may take a slack, a price or a slope."""

    near_torque: float = 0.5
    """Ratio to the torque limit up to which the curvature of torques and the slope of friction are
    neglected."""

    long_step: float = 0.3
    """Length of a step above which width and barrier fall."""

    last_step: float = 0.9
    """Length above which a step may be the last."""

    max_iterations: int = 80
    """Largest number of steps."""

    max_backtracks: int = 8
    """Largest number of trial points of a line search."""

    armijo: float = 1e-4
    """Share of the promised decrease that a step must reach."""

    merit_rounding: float = 1e-9
    """Relative rounding error of the merit function."""

    residual_price: float = 2.0
    """Price of a residual in the merit function, as a multiple of the price of its limit."""

    centrality: float = 1e6
    """Largest ratio, in either direction, of a price to barrier / slack."""

    patience: int = 3
    """Steps within which the work of a feasible motion must fall by the relative decrease asked
    for."""

    optimism: float = 3.0
    """Multiple of the promised decrease that a step is trusted to reach: a motion is given up if
    even this leaves it too costly."""

    feasible: float = 2e-5
    """Largest excess of a ratio over its bound in a feasible motion."""


INTERIOR_POINT = InteriorPointSettings()


@dataclass(frozen=True, eq=False)
class InteriorPoint(LimitedMotions):
    """The program of motions of duration T [s] in one spline space."""

    parameters: Callable[[float], Array]
    """Packed parameters of the kernel for corners of a width [W]."""

    plain: Array
    """Packed parameters with which the limited torque is that of rigid bodies and rotors alone."""

    def first(self, ends: Array, free: Array, width: float, bounds: Array) -> Interior:
        """The first iterate.

        Args:
            ends: start and goal, shape (2, r) [rad].
            free: free control points, shape (m, r) [rad].
            width: width of the corners [W].
            bounds: bounds of the ratios, shape (K,).
        """
        y = self._states(self.points(ends, free))
        power = self.kernel.value(y, self.plain)[1] * self._speeds(y)
        cost, limited = self.kernel.value(y, self.parameters(width))
        work, limited = float(self._weights @ cost), limited.copy()
        scale = max(work, 1e-9)
        ratio = self._ratio(ends, free, limited)
        slack = np.maximum(bounds - np.stack([ratio, -ratio]), INTERIOR_POINT.least_slack)
        barrier = INTERIOR_POINT.first_barrier * scale
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
        """Minimise the work from an iterate, with corners that narrow from step to step.

        Args:
            ends: start and goal, shape (2, r) [rad].
            at: the iterate.
            last: last width of the corners [W].
            bounds: bounds of the ratios, shape (K,).
            progress: relative decrease of the work that a further step must promise.
            below: the motion is given up if its smoothed work is not expected to come below [J].

        Returns:
            The last iterate.
        """
        settings = INTERIOR_POINT
        convexity, found, lost = Convexity(), at, [np.inf]
        for made in range(1, settings.max_iterations + 1):
            checkpoint()
            nodes = self._nodes(ends, found)
            residual = np.stack([nodes.ratio, -nodes.ratio]) - bounds + found.slack
            step = self._step(found, nodes, residual, convexity)
            smooth = float((self._weights[:, None] * nodes.smooth).sum())
            if found.width <= last:
                lost.append(smooth)
            least_barrier = settings.last_barrier * found.scale
            lowest = found.width <= last and found.barrier <= least_barrier
            expected = smooth + settings.optimism * min(step.descent, 0.0)
            if found.width <= last and expected > below:
                return replace(found, costlier=True)
            found, length = self._moved(ends, found, step, nodes, bounds, last)
            stationarity = step.gradient / found.scale
            found = replace(
                found, work=smooth, stationarity=stationarity, iterations=at.iterations + made
            )
            little = -step.descent < progress * found.scale and length > settings.last_step
            little |= lost[-1 - settings.patience :][0] - lost[-1] < progress * found.scale
            feasible = found.excess <= settings.feasible
            if not length or (lowest and little and feasible):
                return replace(found, converged=lowest and feasible)
        return found

    def _nodes(self, ends: Array, at: Interior) -> InteriorNodes:
        y, r = self._states(self.points(ends, at.free)), self._r
        v, joints, count = self._speeds(y), np.arange(r), len(y)
        pull, none, limited_J = self._weights[:, None] * at.slope, np.zeros(count), None
        if (np.abs(at.limited) > INTERIOR_POINT.near_torque * self.limits.tau_max).any():
            price = self._torque_part(at.price[0] - at.price[1]) / self.limits.tau_max
            near = self.kernel.node(y, price, none, self.parameters(at.width))
            limited_J, bent = near[3].copy(), near[4].copy()
        _, tau, _, J, hessian = self.kernel.node(y, pull * v, none, self.plain)
        if limited_J is None:
            # far from the limits, friction hardly matters for the change of torques
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
        return InteriorNodes(power, np.hypot(power, at.width), jacobian, limited_J, hessian, ratio)

    def _step(
        self, at: Interior, nodes: InteriorNodes, residual: Array, convexity: Convexity
    ) -> InteriorStep:
        """Newton step of all conditions, with slacks and prices eliminated first."""
        target = (at.barrier + at.price * residual) / at.slack
        bend = (at.price / at.slack).sum(axis=0)
        unit = nodes.power / nodes.smooth
        # curvature of the corner for the present slope
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
        return InteriorStep(free, slack, price, slope, residual, descent, float(left))

    def _moved(
        self,
        ends: Array,
        at: Interior,
        step: InteriorStep,
        nodes: InteriorNodes,
        bounds: Array,
        last: float,
    ) -> tuple[Interior, float]:
        """Make a step, halved until the merit function falls.

        The merit function is the cost with the barriers of the slacks, and a price on every
        residual. A slack grows to the distance of its limit if that is larger.

        Args:
            ends: start and goal, shape (2, r) [rad].
            at: the iterate.
            step: the Newton step.
            nodes: values at the nodes of the iterate.
            bounds: bounds of the ratios, shape (K,).
            last: last width of the corners [W].

        Returns:
            The next iterate, and the length of the step; 0 if the merit function does not fall.
        """
        settings = INTERIOR_POINT
        parameters = self.parameters(at.width)
        weight = settings.residual_price * np.maximum(at.price, at.price + step.price)
        wrong = float((weight * np.abs(step.residual)).sum())
        before = (
            float((self._weights[:, None] * nodes.smooth).sum())
            - at.barrier * float(np.log(at.slack).sum())
            + wrong
        )
        descent = min(step.descent - wrong, 0.0)
        length = _most(at.slack, step.slack)
        for _ in range(settings.max_backtracks):
            free, slack = at.free + length * step.free, at.slack + length * step.slack
            cost, limited = self.kernel.value(self._states(self.points(ends, free)), parameters)
            ratio = self._ratio(ends, free, limited)
            room = bounds - np.stack([ratio, -ratio])
            slack = np.maximum(slack, room)
            merit = float(self._weights @ cost) - at.barrier * float(np.log(slack).sum())
            merit += float((weight * (slack - room)).sum())
            allowed = before + settings.armijo * length * descent
            if merit <= allowed + settings.merit_rounding * abs(before):
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

    def _with_prices(
        self, at: Interior, step: InteriorStep, length: float, last: float
    ) -> Interior:
        """The iterate with new prices and slopes; width and barrier fall after a long step."""
        settings = INTERIOR_POINT
        central = at.barrier / at.slack
        price = np.maximum(at.price + _most(at.price, step.price) * step.price, 0.0)
        up = _most(1 - at.slope, -step.slope), _most(1 + at.slope, step.slope)
        falls = length > settings.long_step
        barrier, width = settings.barrier_decay * at.barrier, settings.width_decay * at.width
        return replace(
            at,
            price=np.clip(price, central / settings.centrality, central * settings.centrality),
            slope=np.clip(at.slope + min(up) * step.slope, -1.0, 1.0),
            width=max(last, width) if falls else at.width,
            barrier=max(settings.last_barrier * at.scale, barrier) if falls else at.barrier,
        )

    def _blocks(self, hessian: Array, bend: Array) -> Array:
        """Blocks of pairs, from a Hessian (N, 3 r, 3 r) at nodes and barrier curvatures (K,)."""
        r, joints, pairs = self._r, np.arange(self._r), self._pairs
        by_three = hessian.reshape(-1, 3, r, 3, r).transpose(0, 1, 3, 2, 4).reshape(-1, r * r)
        blocks = np.asarray(self._node_products @ by_three).reshape(-1, r, r)
        blocks[:, joints, joints] += self._rate_products @ (
            self._rate_part(bend) / self._rate_limits**2
        )
        blocks[pairs.own[:, None], joints, joints] += self._place_part(bend) / self._half**2
        return blocks

    def _pulled(self, nodes: InteriorNodes, weight: Array) -> Array:
        """The gradient (m, r) of Σ weight · ratio, weight (K,)."""
        by_torque = self._torque_part(weight) / self.limits.tau_max
        torques = self._D.T @ (by_torque[:, None] @ nodes.torque_jacobian).reshape(-1, self._r)
        rates = self._R.T @ (self._rate_part(weight) / self._rate_limits)
        return np.asarray(torques + rates + self._place_part(weight) / self._half)


def _most(value: Array, change: Array) -> float:
    """Length ≤ 1 of a change after which positive values are positive."""
    falling = change < 0
    shares = -value[falling] / change[falling]
    return min(1.0, INTERIOR_POINT.to_boundary * float(np.min(shares, initial=np.inf)))
