"""The only place that calls a solver: sequential quadratic programming on a candidate's program.

A dense SQP with exact Hessians. Each step solves a QP (DAQP, dual active set) over the rows that come near their limit;
rows that the step would break are added and the QP is solved again. Peaks of speed, acceleration and jerk are rows
placed on a grid so fine that nothing of note happens between its points. An L1 merit function and backtracking make
it converge from anywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import daqp
import numpy as np
import numpy.typing as npt

from models.robot import Array
from optimizer.deadline import NEVER, Deadline
from optimizer.nlp.nonlinear_program import Linearisation, NonlinearProgram, PathConstraintValues

# rows enter the QP when they use more than this share of their limit
NEAR = 0.8
NEAR_TORQUE = 0.5
NEAR_PATH = 0.5
# a program counts as feasible when no row exceeds its limit by more than this share
FEASIBILITY = 1e-4
# relative decrease of cost that a further step must promise
PROGRESS = 5e-5
MAX_ITERATIONS = 60
BACKTRACKS = 14
# smallest eigenvalue that the QP's Hessian may have, relative to the largest or to 1, the scale of the cost
EIGENVALUE_FLOOR = 1e-7
# no joint's control point moves further in one step [rad]
STEP = 1.5

# times that a QP is solved again with the rows that its step would break
QP_ROUNDS = 10

Index = npt.NDArray[np.intp]
Places = tuple[Index, Index, Index]  # derivative, grid point, coordinate
Status = Literal["solved", "infeasible", "stalled", "out of time"]

_DAQP_OPTIMAL = 1
_ACTIVE, _EQUAL, _SOFT = 1, 5, 8


@dataclass(frozen=True)
class Result:
    """Where the SQP ended: free control points (m, r), duration [s], cost [J], torque multipliers (N, nq).

    `violation` is the worst share by which a row exceeds its limit, `stationarity` the largest component of the
    Lagrangian's gradient at the last step, as a share of the cost per radian (or per first duration).
    """

    status: Status
    free: Array
    duration: float
    cost: float
    iterations: int
    violation: float
    stationarity: float
    multiplier: Array


@dataclass(frozen=True)
class _Step:
    """A QP's answer: the step in scaled unknowns, multipliers of the rows and where these are."""

    x: Array
    soft: bool
    places: Places
    kinematic: Array
    nodes: tuple[Index, Index]  # node, joint
    signs: Array
    torque: Array
    passed: tuple[Index, Index]  # path point, limit along the path
    path: Array


def _peaks(size: Array) -> npt.NDArray[np.bool_]:
    """Where size (d, M, r) ≥ 0 has a local maximum along the grid."""
    high = np.ones(size.shape, dtype=bool)
    rising = size[:, 1:] >= size[:, :-1]
    high[:, 1:] = rising
    high[:, :-1] &= ~rising
    return high


class _Solver:
    """One run of the SQP. Unknowns x: free control points row by row, then, if it is free, T / time_scale."""

    def __init__(self, program: NonlinearProgram, deadline: Deadline) -> None:
        self.p = program
        self.deadline = deadline
        self.free_time = program.t_max > program.t_min
        self.count = program.free_count * program.r
        self.n = self.count + int(self.free_time)
        basis = program.basis
        self.grid_free = program.free_columns(basis.at_grid)
        self.anchors = basis.anchors[:, :, None]
        self.tau_max = program.limits.tau_max
        self.orders = np.arange(1, 4)
        self.active = np.zeros((*basis.at_grid.shape[:2], program.r), dtype=bool)

    def rates(self, T: float) -> Array:
        """Limits of the derivatives by τ, (3, r)."""
        return np.asarray(self.p.rates * (T**self.orders)[:, None])

    def violations(self, kinematics: Array, T: float, tau: Array, shares: Array) -> Array:
        """Worst excess as a share of the limit: per derivative and coordinate, joint torque, and limit along the path,
        (3 r + nq + c,)."""
        kin: Array = np.maximum(kinematics.max(axis=1), -kinematics.min(axis=1)) / self.rates(T)
        torque = np.abs(tau).max(axis=0) / self.tau_max
        path = shares.max(axis=0, initial=0.0) - self.p.room + 1
        return np.asarray(np.maximum(np.concatenate([kin.ravel(), torque, path]) - 1, 0.0))

    def solve(self, free: Array, T: float, multiplier: Array | None) -> Result:
        p, r = self.p, self.p.r
        multiplier = np.zeros((len(p.basis.nodes), p.kernel.nq)) if multiplier is None else multiplier
        time_scale = T
        scale = np.ones(self.n)
        if self.free_time:
            scale[-1] = time_scale
        line, kin = p.derivatives(free, T, multiplier), p.kinematics(free)
        cost_scale = 1.0 / max(abs(line.cost), 1e-9)
        path_values = p.path_values(free, T)
        violation = self.violations(kin, T, line.tau, path_values.ratios.value)
        penalty = np.full(len(violation), 0.1)
        path_multiplier = np.zeros_like(path_values.ratios.value)
        curvature, stationarity, iterations = 0.0, np.inf, 0
        status: Status = "stalled"
        for iterations in range(1, MAX_ITERATIONS + 1):  # noqa: B007
            if self.deadline.passed:
                status = "out of time"
                break
            g = line.gradient[: self.n] * scale * cost_scale
            H = (line.hessian + p.path_hessian(path_values, T, path_multiplier)) * cost_scale
            H[-1, -1] += curvature
            H = _convex(H[: self.n, : self.n] * np.outer(scale, scale))
            step = self._qp(H, g, line, path_values, free, T, time_scale, kin / self.rates(T)[:, None, :])
            if step is None:
                status = "infeasible"
                break
            dx = step.x
            # torque rows bend with the dynamics, kinematic rows with T^d: their multipliers weigh that curvature
            multiplier = np.zeros_like(multiplier)
            np.add.at(multiplier, step.nodes, step.signs * step.torque / self.tau_max[step.nodes[1]] / cost_scale)
            path_multiplier = np.zeros_like(path_multiplier)
            path_multiplier[step.passed] = step.path / cost_scale
            d = step.places[0]
            curvature = -float((step.kinematic * (d + 1) * d).sum()) / (T * T)
            if not step.soft:
                need = np.zeros_like(penalty)
                np.add.at(need, d * r + step.places[2], step.kinematic)
                np.add.at(need, 3 * r + step.nodes[1], step.torque)
                np.add.at(need, 3 * r + p.kernel.nq + step.passed[1], step.path)
                penalty = np.maximum(penalty, 2.0 * need)
            Hdx = H @ dx
            slope = float(g @ dx)
            promised = -slope - 0.5 * float(dx @ Hdx)
            stationarity = float(np.abs(Hdx).max())
            worst = float(violation.max())
            if worst < FEASIBILITY and promised < PROGRESS:
                status = "solved"
                break
            merit = line.cost * cost_scale + float(penalty @ violation)
            descent = min(slope - float(penalty @ violation), 0.0)
            alpha = 1.0
            for _ in range(BACKTRACKS):
                trial = free + alpha * dx[: self.count].reshape(free.shape)
                trial_T = T + alpha * float(dx[-1]) * time_scale if self.free_time else T
                trial_T = min(max(trial_T, p.t_min), p.t_max)  # rounding must not leave the bounds
                trial_cost, trial_tau = p.value(trial, trial_T)
                trial_kin = p.kinematics(trial)
                trial_path_values = p.path_values(trial, trial_T)
                trial_violation = self.violations(trial_kin, trial_T, trial_tau, trial_path_values.ratios.value)
                if trial_cost * cost_scale + float(penalty @ trial_violation) <= merit + 1e-4 * alpha * descent + 1e-12:
                    break
                alpha *= 0.5
            else:
                status = "solved" if worst < FEASIBILITY and promised < 100 * PROGRESS else "stalled"
                break
            free, T, kin, path_values, violation = trial, trial_T, trial_kin, trial_path_values, trial_violation
            line = p.derivatives(free, T, multiplier)
        return Result(status, free, T, line.cost, iterations, float(violation.max()), stationarity, multiplier)

    def _kinematic_rows(self, places: Places, sign: Array, T: float, time_scale: float) -> Array:
        """Gradients (rows, n) of sign · value / limit at the places."""
        d, g, j = places
        A = np.zeros((len(d), self.n))
        block = (sign / self.rates(T)[d, j])[:, None] * self.grid_free[d, g]
        A[np.arange(len(d))[:, None], np.arange(self.p.free_count) * self.p.r + j[:, None]] = block
        if self.free_time:
            A[:, -1] = -(d + 1) / T * time_scale
        return A

    def _torque_rows(
        self, line: Linearisation, T: float, time_scale: float
    ) -> tuple[Index, Index, Array, Array, Array]:
        """Node and joint of the rows that come near, their sign, gradients (rows, n) and room left."""
        share = line.tau / self.tau_max
        k, j = np.nonzero(np.abs(share) > NEAR_TORQUE)
        sign = np.sign(share[k, j])
        if not len(k):
            return k, j, sign, np.zeros((0, self.n)), sign
        A = self.p.torque_rows(line, T, k, j) * (sign / self.tau_max[j])[:, None]
        A[:, -1] *= time_scale
        return k, j, sign, A[:, : self.n], 1 - np.abs(share[k, j])

    def _bounds(self, free: Array, T: float, time_scale: float) -> tuple[Array, Array]:
        """Least and most that each unknown may change: position limits hold for control points, so along the curve."""
        p = self.p
        lower = np.maximum(np.tile(p.limits.q_min, p.free_count) - free.ravel(), -STEP)
        upper = np.minimum(np.tile(p.limits.q_max, p.free_count) - free.ravel(), STEP)
        if p.goal_constraints is not None:
            moved = free[-1] - p.coordinates.goal
            lower[-p.r :] = np.maximum(lower[-p.r :], -p.goal_constraints.radius - moved)
            upper[-p.r :] = np.minimum(upper[-p.r :], p.goal_constraints.radius - moved)
        if self.free_time:
            lower = np.append(lower, max(p.t_min - T, -0.5 * T) / time_scale)
            upper = np.append(upper, min(p.t_max - T, T) / time_scale)
        return lower, upper

    def _leeway_rows(self, free: Array) -> tuple[Array, Array, Array]:
        """Rows (c, n) that keep the goal within its goal_constraints, and the least and most that each may change."""
        goal_constraints = self.p.goal_constraints
        if goal_constraints is None:
            return np.zeros((0, self.n)), np.zeros(0), np.zeros(0)
        A = np.zeros((len(goal_constraints.rows), self.n))
        A[:, self.count - self.p.r : self.count] = goal_constraints.rows
        moved = goal_constraints.rows @ (free[-1] - self.p.coordinates.goal)
        return A, goal_constraints.lower - moved, goal_constraints.upper - moved

    def _qp(
        self,
        H: Array,
        g: Array,
        line: Linearisation,
        path_values: PathConstraintValues,
        free: Array,
        T: float,
        time_scale: float,
        ratio: Array,
    ) -> _Step | None:
        k, j, torque_sign, A_torque, b_torque = self._torque_rows(line, T, time_scale)
        active_path_constraints = self.p.active_path_constraints(path_values, T, NEAR_PATH)
        A_path = active_path_constraints.gradients
        A_path[:, -1] *= time_scale
        lower, upper = self._bounds(free, T, time_scale)
        size = np.abs(ratio)
        chosen = (size > NEAR) & (self.anchors | _peaks(size)) | self.active
        places: Places = np.nonzero(chosen)  # type: ignore[assignment]
        sign = np.sign(ratio[places])
        A_goal, least_goal, most_goal = self._leeway_rows(free)
        # unknowns and the goal's rows come first, and never give way
        hard = self.n + len(A_goal)
        equal = self.n + np.flatnonzero(least_goal == most_goal)
        A = np.concatenate([A_goal, A_path[:, : self.n], A_torque, self._kinematic_rows(places, sign, T, time_scale)])
        b = np.concatenate([active_path_constraints.room, b_torque, 1 - size[places]])
        before = len(active_path_constraints.room) + len(k)
        soft = False
        working = np.concatenate([np.zeros(hard + before, dtype=bool), self.active[places]])
        for attempt in range(QP_ROUNDS):
            sense = np.zeros(hard + len(b), dtype=np.int32)
            if soft:
                sense[hard:] = _SOFT
            else:
                sense[: len(working)][working] = _ACTIVE
            sense[equal] = _EQUAL
            least = np.concatenate([lower, least_goal, np.full(len(b), -1e30)])
            most = np.concatenate([upper, most_goal, b])
            x, _, flag, info = daqp.solve(H, g, A, most, least, sense, primal_tol=1e-9, eps_prox=0.0, rho_soft=1e-6)
            if flag < _DAQP_OPTIMAL and not soft:
                soft = True
                continue
            if flag < _DAQP_OPTIMAL:
                return None
            working = info["lam"] > 0
            predicted = ratio + (self.grid_free @ x[: self.count].reshape(free.shape)) / self.rates(T)[:, None, :]
            if self.free_time:
                predicted /= np.maximum(1 + self.orders * x[-1] * time_scale / T, 1e-3)[:, None, None]
            size = np.abs(predicted)
            broken = size > 1 + FEASIBILITY / 4
            if attempt == QP_ROUNDS - 1 or not broken.any():
                break
            broken &= (self.anchors | _peaks(size)) & ~chosen
            fresh: Places = np.nonzero(broken)  # type: ignore[assignment]
            if not len(fresh[0]):
                break
            chosen |= broken
            # the row's sign is that of the value it would reach, not of the value now
            fresh_sign = np.sign(predicted[fresh])
            A = np.concatenate([A, self._kinematic_rows(fresh, fresh_sign, T, time_scale)])
            b = np.concatenate([b, 1 - fresh_sign * ratio[fresh]])
            places = tuple(np.concatenate(both) for both in zip(places, fresh, strict=True))  # type: ignore[assignment]
            sign = np.concatenate([sign, fresh_sign])
        mu = np.maximum(info["lam"][hard:], 0.0)
        path, torque, kinematic = np.split(mu, [len(active_path_constraints.room), before])
        self.active[...] = False
        held = kinematic > 0
        self.active[tuple(place[held] for place in places)] = True
        return _Step(
            x,
            soft,
            places,
            kinematic,
            (k, j),
            torque_sign,
            torque,
            (active_path_constraints.points, active_path_constraints.columns),
            path,
        )


def _convex(H: Array) -> Array:
    """H if it is positive definite, else H with its eigenvalues clamped from below."""
    H = 0.5 * (H + H.T)
    try:
        np.linalg.cholesky(H)
        return H
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(H)
        floor = EIGENVALUE_FLOOR * max(1.0, np.abs(values).max())
        return np.asarray((vectors * np.maximum(np.abs(values), floor)) @ vectors.T)


def solve(
    program: NonlinearProgram,
    free: Array,
    duration: float,
    multiplier: Array | None = None,
    deadline: Deadline = NEVER,
) -> Result:
    """Minimise a program's cost from a first guess: free control points (m, r) and a duration [s]."""
    duration = min(max(duration, program.t_min), program.t_max)
    return _Solver(program, deadline).solve(free, duration, multiplier)
