"""NLP of the time scaling of least cost along a path.

The decision variables x (m + 1,) are the m free control values of the scaling and the duration T
[s] of a `RetimedPath`. Limits on rates read |s^(d)(τ)| ≤ limit_d · T^d, as in `nonlinear_program`.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.sparse import vstack

from joulepath.models.robot import Array, Limits, Mask
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.kinematics.path_constraints import ConstraintRatios
from joulepath.optimizer.solve.methods.local_basis import LocalBasis
from joulepath.optimizer.solve.methods.retimed_path import RetimedPath
from joulepath.optimizer.solve.methods.retiming_state import RetimingDerivatives, RetimingValues
from joulepath.optimizer.solve.nlp.active_path_constraints import Index

_ORDERS = np.arange(3.0)[:, None, None]
"""Orders of the derivatives q, v and a."""


class RetimingProgram:
    """The NLP of one solve.

    Args:
        retiming: the path, and the map from variables to motions.
        limits: limits of the joints.
        bounds: bounds of the ratios of the path constraints, shape (c,).
    """

    def __init__(self, retiming: RetimedPath, limits: Limits, bounds: Array) -> None:
        self.retiming, self.limits, self.bounds = retiming, limits, bounds
        self._path, self._least = retiming.prepared.path, retiming.least_speed
        self._at_nodes = retiming.space.at_nodes
        self._at_path = np.zeros((2, 0, retiming.space.n))
        if self._path is not None or self._least is not None:
            self._at_path = retiming.space.at_path

    def values(self, x: Array) -> RetimingValues:
        """Cost and constraints at x (m + 1,)."""
        checkpoint()
        retiming, T = self.retiming, float(x[-1])
        P = retiming.points(x)
        z = _over_powers(self._at_nodes @ P, 0, T)
        at_path = _over_powers(self._at_path @ P, 0, T)
        rates = _over_powers(retiming.at_rates @ P, 1, T) / self.limits.rates[:, None]
        cost, tau = retiming.prepared.kernel.value(_states(z), retiming.interval.p)
        along = least = np.zeros((at_path.shape[1], 0))
        if self._path is not None:
            along = self._path.ratios(*at_path) + (1 - self.bounds)
        if self._least is not None:
            aim, _ = retiming.least_speed_at_path(x)
            least = 1 + aim[:, None] - self._least.speed.ratios(*at_path)
        return RetimingValues(
            x=x,
            cost=retiming.interval.constant + T * float(retiming.space.weights @ cost),
            z=z,
            at_path=at_path,
            ratios=(rates, tau / self.limits.tau_max, along, least),
        )

    def derivatives(self, at: RetimingValues, multipliers: Array) -> RetimingDerivatives:
        """Derivatives at a point.

        Args:
            at: values at the point.
            multipliers: multipliers (rows,) of the ratios in the Hessian, with the signs of their
                two sides [J].
        """
        retiming, space, T = self.retiming, self.retiming.space, at.T
        of_rates, of_torque, of_path, of_least = at.by_kind(multipliers)
        cost, _, by_y, tau_by_y, bends = retiming.prepared.kernel.node(
            _states(at.z), of_torque / self.limits.tau_max, T * space.weights, retiming.interval.p
        )
        torque_by_y = tau_by_y / self.limits.tau_max[:, None]
        path, speed, least_by_values = self._along(at)
        by_path = np.stack(
            [
                _weighted(of_path, path_by_z) - _weighted(of_least, speed_by_z)
                for path_by_z, speed_by_z in zip(path[1:], speed[1:], strict=True)
            ]
        )
        by_cost = _parts(T * space.weights[:, None] * by_y)
        by_nodes = by_cost + _parts(_weighted(of_torque, torque_by_y))
        slopes, z_by_T = retiming.slopes(at.x), -_ORDERS * at.z / T
        count, nq = at.z.shape[1:]

        # derivatives of the control points, and their change with the duration
        by_points = (
            _by_points(self._at_nodes, by_nodes, T)
            + _by_points(self._at_path, by_path, T)
            + _by_points(retiming.at_rates, of_rates / self.limits.rates[:, None], T, 1)
        )
        by_bends = _parts((bends @ _states(z_by_T)[..., None])[..., 0])
        mixed = retiming.by_control_values(
            at.x,
            _by_points(self._at_nodes, by_bends + (by_cost - _ORDERS * by_nodes) / T, T)
            - _by_points(self._at_path, _ORDERS[:2] * by_path / T, T),
        )
        hessian = np.empty((len(at.x), len(at.x)))
        powers = np.power(T, -_ORDERS[:, 0, 0])
        bends = bends.reshape(count, 3, nq, 3, nq)
        scaled = bends * np.outer(powers, powers)[:, None, :, None]
        hessian[:-1, :-1] = self._near_nodes.congruent(scaled, slopes)
        hessian[:-1, :-1] += retiming.curvature(at.x, by_points)
        hessian[:-1, -1] = hessian[-1, :-1] = mixed
        by_T = float((by_cost * z_by_T).sum())
        hessian[-1, -1] = float((by_bends * z_by_T).sum()) + 2 * by_T / T
        hessian[-1, -1] += _bent(by_nodes, at.z, T) + _bent(by_path, at.at_path, T)
        # limits on rates are proportional to T^d with d = 1 to 3
        hessian[-1, -1] -= _bent(np.abs(of_rates), np.ones_like(of_rates), T)
        return RetimingDerivatives(
            gradient=np.append(
                retiming.by_control_values(at.x, _by_points(self._at_nodes, by_cost, T)),
                float(space.weights @ cost) + by_T,
            ),
            hessian=(hessian + hessian.T) / 2,
            slopes=slopes,
            torque_by_y=torque_by_y,
            path=path,
            speed=speed,
            least_by_values=least_by_values,
        )

    def _along(self, at: RetimingValues) -> tuple[ConstraintRatios, ConstraintRatios, Array]:
        """Path constraints, the speed, and the slopes of the least speed at the path points."""
        count, nq = at.at_path.shape[1:]
        gradients = np.zeros((count, 0, nq))
        path = speed = ConstraintRatios(np.zeros((count, 0)), gradients, gradients)
        slopes = np.zeros((count, len(at.x) - 1))
        if self._path is not None:
            path = self._path.linearised(*at.at_path)
        if self._least is not None:
            speed = self._least.linearised(*at.at_path)
            _, slopes = self.retiming.least_speed_at_path(at.x)
        return path, speed, slopes

    def predicted(self, at: RetimingValues, line: RetimingDerivatives, dx: Array) -> Array:
        """Ratios (rows,) after a step dx (m + 1,), by the linear models.

        The magnitudes of rates are relative to their limits after the step.
        """
        T, dP, stretch = at.T, line.slopes @ dx[:-1], float(dx[-1]) / at.T
        dz = _over_powers(self._at_nodes @ dP, 0, T) - _ORDERS * at.z * stretch
        rates = at.ratios[0] + (
            _over_powers(self.retiming.at_rates @ dP, 1, T) / self.limits.rates[:, None]
        )
        dq, dv = _over_powers(self._at_path @ dP, 0, T) - _ORDERS[:2] * at.at_path * stretch
        path, speed = (
            (each.by_q @ dq[..., None] + each.by_v @ dv[..., None])[..., 0]
            for each in (line.path, line.speed)
        )
        return np.concatenate(
            [
                (rates - np.sign(rates) * (_ORDERS + 1) * stretch).ravel(),
                (at.ratios[1] + (line.torque_by_y @ _states(dz)[..., None])[..., 0]).ravel(),
                (at.ratios[2] + path).ravel(),
                (at.ratios[3] - speed + (line.least_by_values @ dx[:-1])[:, None]).ravel(),
            ]
        )

    def rows(
        self, at: RetimingValues, line: RetimingDerivatives, chosen: Mask, signs: Array
    ) -> Array:
        """Gradients (k, m + 1) of sign · ratio for a mask `chosen` (rows,), with signs (rows,).

        As in `predicted`, they are relative to the limits after a step.
        """
        rates, torque, path, speed = (np.nonzero(each) for each in at.by_kind(chosen))
        slopes = line.slopes.reshape(-1, len(at.x) - 1)
        order, point, joint = rates
        by_rates = np.zeros((len(order), 3, at.z.shape[2]))
        by_rates[np.arange(len(order)), order, joint] = 1 / (
            self.limits.rates[order, joint] * at.T ** (order + 1)
        )
        by_torques = line.torque_by_y[torque].reshape(-1, *by_rates.shape[1:])
        by_path, by_speed = (
            np.stack([each.by_q[where], each.by_v[where]], axis=1)
            for each, where in ((line.path, path), (line.speed, speed))
        )
        along, by_along = np.append(path[0], speed[0]), np.concatenate([by_path, -by_speed])
        powers = np.power(at.T, -_ORDERS[:, 0])
        by_points = vstack(
            [
                self._near_rates.rows(point, by_rates),
                self._near_nodes.rows(torque[0], by_torques * powers),
                self._near_path.rows(along, by_along * powers[:2]),
            ]
        )
        by_T = np.concatenate(
            [
                0 * order,
                self._rates_by_T(at.z, torque[0], by_torques),
                self._rates_by_T(at.at_path, along, by_along),
            ]
        )
        rows = np.hstack([by_points @ slopes, by_T[:, None] / at.T])
        rows[len(rows) - len(speed[0]) :, :-1] += line.least_by_values[speed[0]]
        rows *= signs[chosen][:, None]
        rows[: len(order), -1] = -(order + 1) / at.T
        return rows

    @staticmethod
    def _rates_by_T(z: Array, instants: Index, by_z: Array) -> Array:
        """Changes (r,) of functions by the logarithm of the duration.

        Args:
            z: derivatives of the spline, shape (d, k, nq).
            instants: instants of the functions, shape (r,).
            by_z: derivatives of the functions by z, shape (r, d, nq).
        """
        changes = -_ORDERS[: len(z)] * z
        return np.asarray((changes[:, instants].swapaxes(0, 1) * by_z).sum(axis=(1, 2)))

    @cached_property
    def _near_nodes(self) -> LocalBasis:
        return LocalBasis.of(self._at_nodes)

    @cached_property
    def _near_path(self) -> LocalBasis:
        return LocalBasis.of(self._at_path)

    @cached_property
    def _near_rates(self) -> LocalBasis:
        return LocalBasis.of(self.retiming.at_rates)


def _over_powers(values: Array, first: int, T: float) -> Array:
    """Values (d, k, n), divided by T to the powers `first`, `first` + 1, ..."""
    return values / np.power(T, np.arange(first, first + len(values)))[:, None, None]


def _states(z: Array) -> Array:
    """q, v, a (3, N, nq) node by node, shape (N, 3 nq)."""
    return np.ascontiguousarray(z.transpose(1, 0, 2)).reshape(z.shape[1], -1)


def _parts(by_y: Array) -> Array:
    """Derivatives (N, 3 nq) by q, v and a, shape (3, N, nq)."""
    return by_y.reshape(len(by_y), 3, -1).transpose(1, 0, 2)


def _weighted(multipliers: Array, gradients: Array) -> Array:
    """Σ_c multiplier · gradient, shape (k, n), for multipliers (k, c) and gradients (k, c, n)."""
    return np.asarray((multipliers[:, None] @ gradients)[:, 0])


def _bent(by_z: Array, z: Array, T: float) -> float:
    """Σ by_z · ∂²z/∂T², for derivatives z (d, k, nq) of a spline, proportional to T^-d."""
    return float((by_z * (_ORDERS * (_ORDERS + 1))[: len(z)] * z).sum()) / T**2


def _by_points(basis: Array, by_z: Array, T: float, first: int = 0) -> Array:
    """Derivatives (n, nq) by the control points.

    Args:
        basis: maps from control points to values times T^d, shape (d, k, n).
        by_z: derivatives by the values, shape (d, k, nq).
        T: duration [s].
        first: smallest power of T.
    """
    return np.tensordot(_over_powers(basis, first, T), by_z, axes=((0, 1), (0, 1)))
