"""NLP of the time scaling of least cost along a path, for SLSQP."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, minimize

from joulepath.models.robot import Array, Limits, Mask
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.kinematics.path_constraints import ConstraintRatios
from joulepath.optimizer.solve.methods.retimed_path import RetimedPath


@dataclass(frozen=True)
class RetimingProgramSettings:
    """Settings of SLSQP."""

    progress: float = 1e-5
    """Relative change of the cost in a step below which SLSQP ends."""

    max_iterations: int = 80
    """Largest number of iterations of SLSQP."""

    included_slack: float = 0.3
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
    """Cost and constraints of the NLP at one point, and what their derivatives need."""

    cost: float
    """Cost [J]."""

    slack: Array
    """Values of the constraints, shape (rows,); feasible if not negative: rates (3, M, nq),
    torques (N, nq), path constraints (K, c), least speed (K or 0,), and the order of the control
    values (m + 1,)."""

    z: Array
    """q, v and a at the nodes, shape (3, N, nq) [rad, rad/s, rad/s²]."""

    rates: Array
    """v, a and jerk where rates are bounded, relative to their limits, shape (3, M, nq)."""

    torque: Array
    """Torques at the nodes, relative to their limits, shape (N, nq)."""

    torque_by_y: Array
    """Derivatives of `torque` by q, v and a, shape (N, nq, 3 nq)."""

    cost_by_y: Array
    """Derivatives of the cost's integrand by q, v and a, shape (N, 3 nq) [W]."""

    integral: float
    """Integral of the cost [J]."""

    at_path: Array
    """q and v at the path points, shape (2, K, nq) [rad, rad/s]."""

    path: ConstraintRatios | None
    """Path constraints at the path points; None without any."""

    speed: ConstraintRatios | None
    """Speed relative to the least one at the path points; None without a least speed."""

    @property
    def sizes(self) -> list[int]:
        """Numbers of constraints: rates, torques, path constraints and least speed."""
        along = (0 if each is None else each.value.size for each in (self.path, self.speed))
        return [self.rates.size, self.torque.size, *along]


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
        self._rising = np.eye(m + 1) - np.eye(m + 1, m + 1, -1)
        self._rising[:, -1] = 0.0
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
        return self._scale * self.gradient(x)

    def _slack(self, x: Array) -> Array:
        return self.state(x).slack[self._rows]

    def _slopes(self, x: Array) -> Array:
        return self.slopes(x, self._rows)

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
        P = retiming.points(x)
        z = _over_powers(space.at_nodes @ P, 0, T)
        rates = _over_powers(retiming.at_rates @ P, 1, T) / self.limits.rates[:, None]
        y = z.transpose(1, 0, 2).reshape(len(space.nodes), -1)
        cost, tau, by_y, tau_by_y, _ = retiming.prepared.kernel.node(
            y, np.zeros_like(z[0]), np.zeros(len(y)), retiming.interval.p
        )
        integral = T * float(space.weights @ cost)
        torque = tau / self.limits.tau_max
        slack = [1 - rates.ravel() ** 2, 1 - torque.ravel() ** 2]
        at_path, path, speed = np.zeros((2, 0, P.shape[1])), None, None
        if retiming.prepared.path is not None or retiming.least_speed is not None:
            at_path = _over_powers(space.at_path @ P, 0, T)
        if retiming.prepared.path is not None:
            path = retiming.prepared.path.linearised(*at_path)
            slack.append((self.bounds - path.value).ravel())
        if retiming.least_speed is not None:
            speed = retiming.least_speed.linearised(*at_path)
            slack.append(speed.value[:, 0] - retiming.least_speed_at_path(x)[0])
        return RetimingState(
            cost=retiming.interval.constant + integral,
            slack=np.concatenate([*slack, np.diff(np.concatenate([[0.0], x[:-1], [1.0]]))]),
            z=z,
            rates=rates,
            torque=torque,
            # the kernel overwrites its arrays
            torque_by_y=tau_by_y / self.limits.tau_max[:, None],
            cost_by_y=by_y.copy(),
            integral=integral,
            at_path=at_path,
            path=path,
            speed=speed,
        )

    def gradient(self, x: Array) -> Array:
        """Gradient of the cost, shape (n,) [J]."""
        state, space, T = self.state(x), self.retiming.space, float(np.exp(x[-1]))
        count, nq = state.torque.shape
        by_z = T * space.weights[:, None] * state.cost_by_y.reshape(count, 3, nq).swapaxes(0, 1)
        by_points = np.tensordot(_over_powers(space.at_nodes, 0, T), by_z, axes=((0, 1), (0, 1)))
        by_duration = state.integral - np.arange(3) @ (by_z * state.z).sum(axis=(1, 2))
        return np.append(self.retiming.by_control_values(x, by_points), by_duration)

    def slopes(self, x: Array, rows: Mask) -> Array:
        """Gradients of the constraints of the mask `rows` (rows,), shape (k, n)."""
        state, T = self.state(x), float(np.exp(x[-1]))
        rates, torque, path, speed, rising = np.split(rows, np.cumsum(state.sizes))
        slopes = self.retiming.slopes(x)
        found = [
            self._rate_slopes(state, slopes, T, rates.reshape(state.rates.shape)),
            self._torque_slopes(state, slopes, T, torque.reshape(state.torque.shape)),
        ]
        if state.path is not None:
            found.append(-self._path_slopes(state, state.path, slopes, T, path))
        if state.speed is not None:
            found.append(self._path_slopes(state, state.speed, slopes, T, speed))
            found[-1][:, :-1] -= self.retiming.least_speed_at_path(x)[1][speed]
        return np.concatenate([*found, self._rising[rising]])

    def _rate_slopes(self, state: RetimingState, slopes: Array, T: float, rows: Mask) -> Array:
        order, point, joint = np.nonzero(rows)
        value = state.rates[rows]
        found = np.empty((len(value), slopes.shape[2] + 1))
        found[:, -1] = -(order + 1) * value
        for each in range(rows.shape[2]):
            own = joint == each
            scale = np.power(T, order[own] + 1) * self.limits.rates[order[own], each]
            basis = self.retiming.at_rates[order[own], point[own]] / scale[:, None]
            found[own, :-1] = basis @ slopes[:, each]
        return -2 * value[:, None] * found

    def _torque_slopes(self, state: RetimingState, slopes: Array, T: float, rows: Mask) -> Array:
        (nodes,) = np.nonzero(rows.any(axis=1))
        Z = _by_variables(self.retiming.space.at_nodes[:, nodes], slopes, state.z[:, nodes], T)
        by_x = _products(state.torque_by_y[rows], Z, rows[nodes])
        return -2 * state.torque[rows][:, None] * by_x

    def _path_slopes(
        self, state: RetimingState, ratios: ConstraintRatios, slopes: Array, T: float, rows: Mask
    ) -> Array:
        rows = rows.reshape(ratios.value.shape)
        (points,) = np.nonzero(rows.any(axis=1))
        basis = self.retiming.space.at_path[:, points]
        Z = _by_variables(basis, slopes, state.at_path[:, points], T)
        return _products(np.hstack([ratios.by_q[rows], ratios.by_v[rows]]), Z, rows[points])


def _over_powers(values: Array, first: int, T: float) -> Array:
    """Values (d, k, n), divided by T to the powers `first`, `first` + 1, ..."""
    return values / np.power(T, np.arange(first, first + len(values)))[:, None, None]


def _by_variables(basis: Array, slopes: Array, values: Array, T: float) -> Array:
    """Derivatives by x of q, v, a at some instants.

    By the logarithm of T, a value divided by T^d has the derivative -d times itself.

    Args:
        basis: maps from control points to values times T^d, shape (d, k, n).
        slopes: derivatives of the control points by the control values, shape (n, nq, m).
        values: the values, shape (d, k, nq).
        T: duration [s].

    Returns:
        The derivatives, shape (d, k, nq, m + 1).
    """
    found = np.empty((*values.shape, slopes.shape[2] + 1))
    by_points = _over_powers(basis, 0, T).reshape(-1, len(slopes)) @ slopes.reshape(len(slopes), -1)
    found[..., :-1] = by_points.reshape(*values.shape, slopes.shape[2])
    found[..., -1] = -np.arange(len(values))[:, None, None] * values
    return found


def _products(gradients: Array, Z: Array, rows: Mask) -> Array:
    """Derivatives of constraints by x, from those by q, v and a.

    Args:
        gradients: gradients of the constraints of `rows`, in their order, shape (r, d nq).
        Z: derivatives of q, v and a at k instants by x, shape (d, k, nq, n).
        rows: mask (k, c) of constraints at the instants.

    Returns:
        The derivatives, shape (r, n).
    """
    instant, _ = np.nonzero(rows)
    orders, _, nq, count = Z.shape
    by_x = Z[:, instant].swapaxes(0, 1).reshape(len(instant), orders * nq, count)
    return np.asarray((gradients[:, None] @ by_x)[:, 0])
