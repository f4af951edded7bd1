"""The nonlinear program of one candidate: a B-spline between two configurations, its cost, limits and derivatives.

Unknowns are the free control points s (m, r) and the duration T. The spline runs in coordinates s ∈ R^r with
q = origin + directions · s: the joints themselves (r = nq) for a B-spline motion, or the fraction of the straight line
(r = 1) for a time-scaled one. At a node τ of [0, 1]

    q = s(τ),  v = s'(τ) / T,  a = s''(τ) / T²,       cost = T Σ_k w_k ℓ(q_k, v_k, a_k).

Limits on speed, acceleration and jerk are written |s^(d)(τ)| ≤ limit_d · T^d: linear in s, and since T^d is convex, a
linear model of such a row is never looser than the row, so a step that holds the model holds the limit.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from models.robot import Array, Limits
from optimizer.energy.kernel import Kernel
from optimizer.kinematics.path_constraints import ConstraintRatios, PathConstraints
from optimizer.nlp.coordinates import Coordinates, GoalConstraints
from optimizer.trajectories.bspline import Basis

Index = npt.NDArray[np.intp]
# step of q [rad] and v [rad/s] by which gradients of limits along the path are differenced
DIFFERENCE = 1e-6


@dataclass(frozen=True)
class Linearisation:
    """Value and derivatives of a program at one point; x = (free control points row by row, T).

    `cost` [J], `gradient` (n,), `hessian` (n, n) of cost + multiplier · tau_motor, `tau` (N, nq), and the means to
    differentiate single torques: `jacobian` (N, nq, 3, r), `rate` (N, 3, r) = ∂(s, v, a)/∂T.
    """

    cost: float
    gradient: Array
    hessian: Array
    tau: Array
    jacobian: Array
    rate: Array


@dataclass(frozen=True)
class PathConstraintValues:
    """The basis' path points: q and v (M, nq), and the shares of the limits along the path there, with gradients."""

    q: Array
    v: Array
    ratios: ConstraintRatios


@dataclass(frozen=True)
class ActivePathConstraints:
    """Limits along the path that come near: path point and column (rows,), room left, gradients (rows, n) by x."""

    points: Index
    columns: Index
    room: Array
    gradients: Array


@dataclass(frozen=True)
class NonlinearProgram:
    """One candidate's program.

    `p` is the packed parameter vector of the kernel; the duration lies in [t_min, t_max], equal ends fix it. `constant`
    [J] is a part of the cost that nothing changes: it keeps relative changes of the cost in proportion. With
    `goal_constraints` the goal is an unknown too: the last row of the free control points, at which the motion comes
    to rest. Every share c of `path` stays within room (c,), 1 or a little less.
    """

    kernel: Kernel
    basis: Basis
    p: Array
    coordinates: Coordinates
    t_min: float
    t_max: float
    constant: float = 0.0
    goal_constraints: GoalConstraints | None = None
    path: PathConstraints | None = None
    room: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def r(self) -> int:
        """Number of the spline's coordinates."""
        return self.coordinates.r

    @property
    def limits(self) -> Limits:
        """Limits of the spline's coordinates."""
        return self.coordinates.limits

    @property
    def free_count(self) -> int:
        """Number of free control points, the goal among them where it may move."""
        return self.basis.n - 2 * self.basis.resting + (self.goal_constraints is not None)

    @cached_property
    def rates(self) -> Array:
        """Limits of the first to third derivative of s, (3, r)."""
        return np.stack([self.limits.v_max, self.limits.a_max, self.limits.j_max])

    @cached_property
    def _full_space(self) -> bool:
        return self.r == self.kernel.nq

    def points(self, free: Array) -> Array:
        """All control points (n, r) for the free ones (m, r)."""
        ends = np.ones((self.basis.resting, 1))
        inner, goal = (free, self.coordinates.goal) if self.goal_constraints is None else (free[:-1], free[-1])
        return np.concatenate([ends * self.coordinates.start, inner, ends * goal])

    def free_columns(self, matrix: Array) -> Array:
        """Of a basis matrix (…, n), what multiplies the free control points (…, m)."""
        inner = matrix[..., self.basis.free]
        if self.goal_constraints is None:
            return np.ascontiguousarray(inner)
        return np.concatenate([inner, matrix[..., -self.basis.resting :].sum(axis=-1, keepdims=True)], axis=-1)

    def joint_points(self, free: Array) -> Array:
        """The points of q, (n, nq), in the spline's space."""
        return self.coordinates.to_joints(self.points(free))

    def _states(self, free: Array, T: float) -> tuple[Array, Array]:
        """s, v, a in the spline's coordinates (N, 3, r), and the kernel's nodes y (N, 3 nq)."""
        z = self.basis.at_nodes @ self.points(free)
        z[1] /= T
        z[2] /= T * T
        z = z.transpose(1, 0, 2)
        if self._full_space:
            return z, z.reshape(len(z), -1)
        y = z @ self.coordinates.directions.T
        y[:, 0] += self.coordinates.origin
        return z, y.reshape(len(y), -1)

    def value(self, free: Array, T: float) -> tuple[float, Array]:
        """Cost [J] and motor torques (N, nq)."""
        _, y = self._states(free, T)
        cost, tau = self.kernel.value(y, self.p)
        return self.constant + T * float(self.basis.weights @ cost), tau

    def derivatives(self, free: Array, T: float, multiplier: Array) -> Linearisation:
        """Everything of first and second order; `multiplier` (N, nq) weighs the torques in the Hessian."""
        z, y = self._states(free, T)
        count, nq, r, m = len(y), self.kernel.nq, self.r, self.free_count
        w = self.basis.weights
        cost, tau, gradient, jacobian, hessian = self.kernel.node(y, multiplier, T * w, self.p)
        G = gradient.reshape(count, 3, nq)
        J = jacobian.reshape(count, nq, 3, nq)
        H = hessian.reshape(count, 3, nq, 3, nq)
        if not self._full_space:
            P = self.coordinates.directions
            G, J = G @ P, J @ P
            H = np.moveaxis(np.moveaxis(H @ P, 2, -1) @ P, -1, 2)

        total = float(w @ cost)
        scale = np.array([1.0, 1.0 / T, 1.0 / (T * T)])
        D = self._nodes_free * scale[:, None]
        rate = z * np.array([0.0, -1.0 / T, -2.0 / T])[:, None]
        slope = (w[:, None, None] * G * rate).sum()
        flat = D.reshape(count * 3, m)
        wG = (w[:, None, None] * G).reshape(count * 3, r)
        gradient_s = T * (flat.T @ wG)
        gradient_T = total + T * slope

        # Σ_k D_kᵀ H_k D_k as two dense products
        left = D.transpose(0, 2, 1) @ H.reshape(count, 3, r * 3 * r)
        left = left.reshape(count, m, r, 3, r).transpose(1, 2, 4, 0, 3).reshape(m * r * r, count * 3)
        H_ss = (left @ flat).reshape(m, r, r, m).transpose(0, 1, 3, 2).reshape(m * r, m * r)
        H_rate = (H.reshape(count, 3 * r, 3 * r) @ rate.reshape(count, 3 * r, 1)).reshape(count, 3, r)
        weighted_torque = (multiplier[:, None, :] @ J.reshape(count, nq, 3 * r)).reshape(count, 3, r)
        lagrangian = T * w[:, None, None] * G + weighted_torque
        D_rate = D * np.array([0.0, -1.0 / T, -2.0 / T])[:, None]
        H_sT = (
            flat.T @ H_rate.reshape(count * 3, r)
            + D_rate.reshape(count * 3, m).T @ lagrangian.reshape(count * 3, r)
            + gradient_s / T
        )
        curvature = z * np.array([0.0, 2.0 / (T * T), 6.0 / (T * T)])[:, None]
        H_TT = 2 * slope + (rate * H_rate).sum() + (lagrangian * curvature).sum()
        hessian_x = np.empty((m * r + 1, m * r + 1))
        hessian_x[:-1, :-1] = H_ss
        hessian_x[:-1, -1] = hessian_x[-1, :-1] = H_sT.ravel()
        hessian_x[-1, -1] = H_TT
        return Linearisation(
            cost=self.constant + T * total,
            gradient=np.append(gradient_s.ravel(), gradient_T),
            hessian=hessian_x,
            tau=tau,
            jacobian=J,
            rate=rate,
        )

    @cached_property
    def _nodes_free(self) -> Array:
        """Basis and derivatives of the free control points at the nodes, (N, 3, m)."""
        return np.ascontiguousarray(self.free_columns(self.basis.at_nodes).transpose(1, 0, 2))

    def torque_rows(self, line: Linearisation, T: float, k: Index, j: Index) -> Array:
        """Gradients (rows, n) of the torques of joints j at nodes k with respect to x."""
        J = line.jacobian[k, j]
        scale = np.array([1.0, 1.0 / T, 1.0 / (T * T)])
        by_points = np.einsum("kdm,kdr->kmr", self._nodes_free[k] * scale[:, None], J)
        by_time = np.einsum("kdr,kdr->k", J, line.rate[k])
        return np.hstack([by_points.reshape(len(k), self.free_count * self.r), by_time[:, None]])

    def kinematics(self, free: Array) -> Array:
        """First to third derivative of s by τ on the fine grid, (3, M, r)."""
        return self.basis.at_grid @ self.points(free)

    def path_values(self, free: Array, T: float) -> PathConstraintValues:
        """The limits along the path at the basis' path points; nothing at all where there are none."""
        if self.path is None:
            none = np.zeros((0, self.kernel.nq))
            return PathConstraintValues(none, none, ConstraintRatios(none[:, :0], none[:, None], none[:, None]))
        s, rising = self.basis.at_path @ self.points(free)
        q, v = self.coordinates.to_joints(s), rising @ self.coordinates.directions.T / T
        return PathConstraintValues(q, v, self.path.linearised(q, v))

    def active_path_constraints(
        self, path_values: PathConstraintValues, T: float, near: float
    ) -> ActivePathConstraints:
        """The shares that use more than `near` of their room."""
        if self.path is None:
            none = np.zeros(0, dtype=np.intp)
            return ActivePathConstraints(none, none, np.zeros(0), np.zeros((0, self.free_count * self.r + 1)))
        shares = path_values.ratios
        k, c = np.nonzero(shares.value > near * self.room)
        by_q, by_v = shares.by_q[k, c], shares.by_v[k, c]
        at, rising = self._path_free[:, k, :, None]
        P = self.coordinates.directions
        by_points = at * (by_q @ P)[:, None] + rising * (by_v @ P / T)[:, None]
        by_time = -np.einsum("rj,rj->r", by_v, path_values.v[k]) / T
        gradients = np.hstack([by_points.reshape(len(k), self.free_count * self.r), by_time[:, None]])
        return ActivePathConstraints(k, c, self.room[c] - shares.value[k, c], gradients)

    def path_hessian(self, path_values: PathConstraintValues, T: float, weights: Array) -> Array:
        """Hessian (n, n) of Σ weights · shares, weights (M, c), by finite differences of the shares' gradients."""
        k = np.flatnonzero(weights.any(axis=1))
        n = self.free_count * self.r + 1
        if self.path is None or not len(k):
            return np.zeros((n, n))
        nq = self.kernel.nq
        v = path_values.v[k]
        y = np.hstack([path_values.q[k], v])
        stepped = np.concatenate([y[None], y + DIFFERENCE * np.eye(2 * nq)[:, None]]).reshape(-1, 2 * nq)
        shares = self.path.linearised(stepped[:, :nq], stepped[:, nq:])
        w = np.tile(weights[k], (2 * nq + 1, 1))[..., None]
        slopes = np.hstack([(w * shares.by_q).sum(axis=1), (w * shares.by_v).sum(axis=1)]).reshape(-1, len(k), 2 * nq)
        bent = (slopes[1:] - slopes[0]).transpose(1, 0, 2) / DIFFERENCE
        Y = np.concatenate(self._state_rows(v, T, k), axis=1)
        hessian: Array = Y.reshape(-1, n).T @ (bent @ Y).reshape(-1, n)
        # v = s' / T bends by itself
        by_v, V = slopes[0][:, nq:], Y[:, nq:]
        mixed = -np.einsum("kj,kjn->n", by_v, V)[:-1] / T
        hessian[:-1, -1] += mixed
        hessian[-1, :-1] += mixed
        hessian[-1, -1] += 2 * float((by_v * v).sum()) / (T * T)
        return hessian

    def _state_rows(self, v: Array, T: float, k: Index) -> tuple[Array, Array]:
        """Gradients of q and v (rows, nq, n) at the path points k, where the speeds are v (rows, nq)."""
        at, rising = self._path_free[:, k]
        P, rows = self.coordinates.directions, (len(k), self.kernel.nq, self.free_count * self.r)
        Q = np.einsum("km,jr->kjmr", at, P).reshape(rows)
        V = np.einsum("km,jr->kjmr", rising / T, P).reshape(rows)
        none = np.zeros((len(k), self.kernel.nq, 1))
        return np.concatenate([Q, none], axis=2), np.concatenate([V, -v[..., None] / T], axis=2)

    @cached_property
    def _path_free(self) -> Array:
        """Basis and first derivative of the free control points at the path points, (2, M, m)."""
        return np.ascontiguousarray(self.free_columns(self.basis.at_path))
