"""The only place that calls a solver: sequential quadratic programming on a candidate's programme.

A dense SQP with exact Hessians. Each step solves a QP (DAQP, dual active set) over the rows that come near their limit;
rows that the step would break are added and the QP is solved again. Peaks of speed, acceleration and jerk are rows
placed on a grid so fine that nothing of note happens between its points. An L1 merit function and backtracking make
it converge from anywhere.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import daqp
import numpy as np
from scipy.linalg import cho_factor
from scipy.linalg import LinAlgError

from models.robot import Array
from optimizer.nlp import Linearisation, Programme

# rows enter the QP when they use more than this share of their limit
NEAR = 0.8
NEAR_TORQUE = 0.5
# a programme counts as feasible when no row exceeds its limit by more than this share
FEASIBILITY = 1e-4
# relative decrease of cost that a further step must promise
PROGRESS = 1e-7
MAX_ITERATIONS = 60
# smallest eigenvalue that the QP's Hessian may have, relative to the largest
EIGENVALUE_FLOOR = 1e-7
# no joint's control point moves further in one step [rad]
STEP = 1.5

# times that a QP is solved again with the rows that its step would break
QP_ROUNDS = 6

_DAQP_OPTIMAL = 1
_SOFT = 8


@dataclass(frozen=True)
class Result:
    """Where the SQP ended: free control points (m, r), duration [s], cost [J], torque multipliers (N, nq).

    `violation` is the worst share by which a row exceeds its limit, `stationarity` the norm of the Lagrangian's
    gradient over that of the cost, at the last step.
    """

    status: Literal["solved", "infeasible", "stalled", "out of time"]
    free: Array
    duration: float
    cost: float
    iterations: int
    violation: float
    stationarity: float
    multiplier: Array


@dataclass(frozen=True)
class _Rows:
    """Linear rows A x ≤ b in relative units, and where they come from."""

    kinematic: tuple[Array, Array, Array]  # derivative, grid point, coordinate
    sign: Array
    torque: tuple[Array, Array]  # node, joint
    torque_sign: Array
    A: Array
    b: Array


def _peaks(ratio: Array, near: float) -> tuple[Array, Array, Array]:
    """Indices where |ratio| (d, M, r) has a local maximum along the grid and exceeds `near`."""
    size = np.abs(ratio)
    if size.max() <= near:
        empty = np.empty(0, dtype=int)
        return empty, empty, empty
    high = size > near
    high[:, 1:] &= size[:, 1:] >= size[:, :-1]
    high[:, :-1] &= size[:, :-1] > size[:, 1:]
    return np.nonzero(high)  # type: ignore[return-value]


class _Solver:
    def __init__(self, programme: Programme, clock: Callable[[], float], deadline: float) -> None:
        self.p = programme
        self.clock, self.deadline = clock, deadline
        self.free_time = programme.t_max > programme.t_min
        self.count = programme.free_count * programme.r
        self.n = self.count + int(self.free_time)
        self.grid_free = programme.basis.at_grid[:, :, programme.basis.free]
        self.tau_max = programme.s_limits.tau_max
        self.orders = np.arange(1, 4)

    def rates(self, T: float) -> Array:
        return self.p.rates * (T ** self.orders)[:, None]

    def violations(self, kinematics: Array, T: float, tau: Array) -> Array:
        """Worst excess per derivative and coordinate, and per joint torque, as a share of the limit (flat)."""
        kin = np.abs(kinematics).max(axis=1) / self.rates(T) - 1
        torque = np.abs(tau).max(axis=0) / self.tau_max - 1
        return np.maximum(np.concatenate([kin.ravel(), torque]), 0.0)

    def kinematic_rows(self, where: tuple[Array, Array, Array], ratio: Array, T: float, time_scale: float) -> tuple[Array, Array, Array]:
        d, g, j = where
        value = ratio[d, g, j]
        sign = np.sign(value)
        m, r = self.p.free_count, self.p.r
        A = np.zeros((len(d), self.n))
        block = (sign / (self.p.rates[d, j] * T ** (d + 1)))[:, None] * self.grid_free[d, g]
        A[np.arange(len(d))[:, None], np.arange(m) * r + j[:, None]] = block
        if self.free_time:
            A[:, -1] = -(d + 1) / T * time_scale
        return A, 1 - np.abs(value), sign

    def solve(self, free: Array, T: float, multiplier: Array | None) -> Result:
        p = self.p
        nodes = len(p.basis.nodes)
        multiplier = np.zeros((nodes, p.kernel.nq)) if multiplier is None else multiplier
        time_scale = T
        line = p.derivatives(free, T, multiplier)
        cost_scale = 1.0 / max(abs(line.cost), 1e-9)
        kin = p.kinematics(free)
        penalty = np.full(3 * p.r + p.kernel.nq, 0.1)
        kinematic_curvature = 0.0
        stationarity, iteration = np.inf, 0
        status: Literal["solved", "infeasible", "stalled", "out of time"] = "stalled"
        for iteration in range(1, MAX_ITERATIONS + 1):
            if self.clock() > self.deadline:
                status = "out of time"
                break
            g = line.gradient * cost_scale
            H = line.hessian * cost_scale
            H[-1, -1] += kinematic_curvature
            if self.free_time:
                g[-1] *= time_scale
                H[-1] *= time_scale
                H[:, -1] *= time_scale
            else:
                g, H = g[:-1], H[:-1, :-1]
            H = _convex(H)
            ratio = kin / self.rates(T)[:, None, :]
            violation = self.violations(kin, T, line.tau)
            step, rows = self._qp(H, g, line, free, T, time_scale, ratio)
            if step is None:
                status = "infeasible"
                break
            dx, mu, soft = step
            # multipliers of the torque rows weigh their curvature in the next Hessian
            new_multiplier = np.zeros_like(multiplier)
            kinematic_mu = mu[: len(rows.sign)]
            torque_mu = mu[len(rows.sign) :]
            np.add.at(new_multiplier, rows.torque, rows.torque_sign * torque_mu / self.tau_max[rows.torque[1]] / cost_scale)
            d = rows.kinematic[0]
            kinematic_curvature = -float((kinematic_mu * (d + 1) * d).sum()) / (T * T)
            need = np.zeros_like(penalty)
            np.add.at(need, d * p.r + rows.kinematic[2], kinematic_mu)
            np.add.at(need, 3 * p.r + rows.torque[1], torque_mu)
            if not soft:
                penalty = np.maximum(penalty, 2.0 * need)
            residual = g + H @ dx
            promised = -float(g @ dx) - 0.5 * float(dx @ H @ dx)
            descent = float(g @ dx) - float(penalty @ violation)
            stationarity = float(np.abs(H @ dx).max() / max(np.abs(g).max(), 1e-12))
            worst = float(violation.max())
            if worst < FEASIBILITY and promised < PROGRESS:
                status = "solved"
                multiplier = new_multiplier
                break
            merit = line.cost * cost_scale + float(penalty @ violation)
            alpha, accepted = 1.0, False
            for _ in range(14):
                ds = alpha * dx[: self.count].reshape(free.shape)
                dT = alpha * dx[-1] * time_scale if self.free_time else 0.0
                trial_free, trial_T = free + ds, T + dT
                trial_cost, trial_tau = p.value(trial_free, trial_T)
                trial_kin = p.kinematics(trial_free)
                trial_violation = self.violations(trial_kin, trial_T, trial_tau)
                trial = trial_cost * cost_scale + float(penalty @ trial_violation)
                if trial <= merit + 1e-4 * alpha * min(descent, 0.0) + 1e-12:
                    accepted = True
                    break
                alpha *= 0.5
            if not accepted:
                status = "solved" if worst < FEASIBILITY and promised < 100 * PROGRESS else "stalled"
                break
            free, T, kin, multiplier = trial_free, trial_T, trial_kin, new_multiplier
            line = p.derivatives(free, T, multiplier)
        violation = self.violations(kin, T, line.tau)
        return Result(status, free, T, line.cost, iteration, float(violation.max()), stationarity, multiplier)

    def _qp(
        self, H: Array, g: Array, line: Linearisation, free: Array, T: float, time_scale: float, ratio: Array
    ) -> tuple[tuple[Array, Array, bool] | None, _Rows]:
        p = self.p
        where = _peaks(ratio, NEAR)
        A, b, sign = self.kinematic_rows(where, ratio, T, time_scale)
        share = line.tau / self.tau_max
        k, j = np.nonzero(np.abs(share) > NEAR_TORQUE)
        torque_sign = np.sign(share[k, j])
        if len(k):
            rows = p.torque_rows(line, T, k, j) * (torque_sign / self.tau_max[j])[:, None]
            rows[:, -1] *= time_scale
            A_torque = rows[:, : self.n]
        else:
            A_torque = np.zeros((0, self.n))
        b_torque = 1 - np.abs(share[k, j])

        lower = np.maximum(np.tile(p.s_limits.q_min, p.free_count) - free.ravel(), -STEP)
        upper = np.minimum(np.tile(p.s_limits.q_max, p.free_count) - free.ravel(), STEP)
        if self.free_time:
            lower = np.append(lower, max((p.t_min - T), -0.5 * T) / time_scale)
            upper = np.append(upper, min((p.t_max - T), 1.0 * T) / time_scale)
        soft = False
        for attempt in range(QP_ROUNDS):
            full = np.concatenate([A, A_torque])
            most = np.concatenate([upper, b, b_torque])
            least = np.concatenate([lower, np.full(len(full), -1e30)])
            sense = np.zeros(len(most), dtype=np.int32)
            if soft:
                sense[self.n :] = _SOFT
            dx, _, flag, info = daqp.solve(H, g, full, most, least, sense, primal_tol=1e-9, eps_prox=0.0, rho_soft=1e-6)
            if flag < _DAQP_OPTIMAL and not soft:
                soft = True
                continue
            if flag < _DAQP_OPTIMAL:
                return None, _Rows(where, sign, (k, j), torque_sign, A, b)
            ds = dx[: self.count].reshape(free.shape)
            predicted = ratio + (self.grid_free @ ds) / self.rates(T)[:, None, :]
            if self.free_time:
                limit = 1 + self.orders * dx[-1] * time_scale / T
                predicted = predicted / np.maximum(limit, 1e-3)[:, None, None]
            fresh = _peaks(predicted, 1 + 1e-6)
            known = set(zip(*(w.tolist() for w in where), strict=True))
            keep = [i for i, key in enumerate(zip(*(w.tolist() for w in fresh), strict=True)) if key not in known]
            if not keep or attempt == QP_ROUNDS - 1:
                break
            fresh = tuple(w[keep] for w in fresh)  # type: ignore[assignment]
            # the row's sign is that of the value it would reach, not of the value now
            signed = np.sign(predicted[fresh])
            A_new, _, now = self.kinematic_rows(fresh, ratio, T, time_scale)
            A_new[:, : self.count] *= (signed * np.where(now == 0, 1, now))[:, None]
            b_new = 1 - signed * ratio[fresh]
            A, b, sign = np.concatenate([A, A_new]), np.concatenate([b, b_new]), np.concatenate([sign, signed])
            where = tuple(np.concatenate(pair) for pair in zip(where, fresh, strict=True))  # type: ignore[assignment]
        mu = np.maximum(info["lam"][self.n :], 0.0)
        return (dx, mu, soft), _Rows(where, sign, (k, j), torque_sign, A, b)


def _convex(H: Array) -> Array:
    """H if it is positive definite, else H with its eigenvalues clamped from below."""
    H = 0.5 * (H + H.T)
    try:
        cho_factor(H, check_finite=False)
        return H
    except LinAlgError:
        values, vectors = np.linalg.eigh(H)
        floor = EIGENVALUE_FLOOR * np.abs(values).max()
        return (vectors * np.maximum(np.abs(values), floor)) @ vectors.T


def solve(
    programme: Programme,
    free: Array,
    duration: float,
    multiplier: Array | None = None,
    deadline: float = np.inf,
    clock: Callable[[], float] = time.perf_counter,
) -> Result:
    """Minimise a programme's cost from a first guess: free control points (m, r) and a duration [s]."""
    duration = min(max(duration, programme.t_min), programme.t_max)
    return _Solver(programme, clock, deadline).solve(free, duration, multiplier)
