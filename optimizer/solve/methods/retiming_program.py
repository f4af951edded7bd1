"""NLP of the time scaling of least cost along a path, for SLSQP."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, minimize

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.solve.methods.retimed_path import RetimedPath


@dataclass(frozen=True)
class RetimingProgramSettings:
    """Settings of SLSQP."""

    progress: float = 1e-5
    """Relative change of the cost in a step below which SLSQP ends."""

    max_iterations: int = 80
    """Largest number of iterations of SLSQP."""

    included_slack: float = 0.75
    """Slack 1 - ratio² below which a constraint becomes part of the NLP: the effort of SLSQP grows
    with the number of constraints."""

    max_rounds: int = 6
    """Largest number of NLPs, each with the constraints that the motion before came near."""

    feasible: float = 1e-3
    """Largest excess of a constraint, relative to its limit, that the repair of limits between the
    nodes can still undo."""


RETIMING_PROGRAM = RetimingProgramSettings()


@dataclass(frozen=True)
class RetimingState:
    """Cost and constraints of the NLP at one point."""

    cost: float
    """Cost [J]."""

    gradient: Array
    """Gradient of the cost, shape (n,)."""

    slack: Array
    """Values of the constraints, shape (rows,); feasible if not negative."""

    slopes: Array
    """Gradients of the constraints, shape (rows, n)."""


class RetimingProgram:
    """The NLP of one solve, in the variables x (n,) of a `RetimedPath`.

    Args:
        retiming: the path, and the map from variables to motions.
        limits: limits of the joints.
        bounds: bounds of the ratios of the path constraints, shape (c,).
        first: variables to start from, shape (n,).
    """

    def __init__(self, retiming: RetimedPath, limits: Limits, bounds: Array, first: Array) -> None:
        self.retiming, self.limits, self.bounds, self.first = retiming, limits, bounds, first
        self._known: tuple[bytes, RetimingState] | None = None
        m = len(first) - 1
        # the control values rise from 0 to 1, so the scaling does
        self._rising = np.eye(m + 1, m) - np.eye(m + 1, m, -1)
        self._scale = 1 / max(abs(self.state(first).cost), 1e-9)
        # the NLP has the constraints that a motion came near, and the order of the control values
        self._rows = np.zeros(len(self.state(first).slack), dtype=bool)
        self._rows[-(m + 1) :] = True

    def solve(self) -> tuple[Array, int]:
        """The variables where SLSQP ends, and its iterations."""
        x, iterations = self.first, 0
        settings = RETIMING_PROGRAM
        for _ in range(settings.max_rounds):
            self._rows |= self.state(x).slack < settings.included_slack
            x, spent = self._solve(x)
            iterations += spent
            if self.excess(x) <= settings.feasible:
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
            options={
                "ftol": RETIMING_PROGRAM.progress,
                "maxiter": RETIMING_PROGRAM.max_iterations,
            },
        )
        return np.asarray(found.x, dtype=float), int(found.nit)

    def _cost(self, x: Array) -> float:
        # in multiples of the first cost
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
        """Cost and constraints at x, evaluated once for successive calls of SLSQP."""
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
        torque = tau / self.limits.tau_max
        torque_slopes = (jacobian @ Y) / self.limits.tau_max[:, None]
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
        """Slack of path constraints and least speed at the path points; its derivatives by x."""
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
        """Derivatives by x of values that are linear in the control points, over powers of T.

        By the logarithm of T, a value divided by T^d has the derivative -d times itself.

        Args:
            matrices: maps from control points to values times T^d, shape (d, k, n).
            slopes: derivatives of the control points by the control values, shape (n, nq, m).
            values: the values, shape (d, k, nq).
            orders: powers of T, shape (d,).
            T: duration [s].

        Returns:
            The derivatives, shape (d, k, nq, n).
        """
        by_points = np.einsum("dkp,pjm->dkjm", matrices, slopes, optimize=True)
        by_points /= np.power(T, orders)[:, None, None, None]
        return np.concatenate([by_points, (-orders[:, None, None] * values)[..., None]], axis=3)
