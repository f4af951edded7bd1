"""The QP of one SQP step, over the constraints near their limits.

Speed, acceleration and jerk are limited at every point of a fine grid. Only their peaks, and the anchors of the basis,
enter the QP when they come near a limit. The QP is solved by DAQP (dual active set; Arnström, Bemporad, Axehill 2022).
If its step breaks a limit at another point, that point is added and the QP is solved again.
"""

from __future__ import annotations

from dataclasses import dataclass

import daqp
import numpy as np
import numpy.typing as npt

from models.robot import Array
from optimizer.deadline import checkpoint, watched_time_left
from optimizer.nlp.active_path_constraints import ActivePathConstraints, Index, PathConstraintValues
from optimizer.nlp.nonlinear_program import FEASIBILITY, Linearisation, NonlinearProgram

# constraints enter the QP when they use more than this ratio of their limit
NEAR = 0.8
NEAR_TORQUE = 0.5
NEAR_PATH = 0.5
# no coordinate of a control point moves further in one step [rad]
STEP = 1.5
# times that the QP is solved again with the constraints that its step would break
QP_ROUNDS = 10
# least time [s] that a QP gets: most take a millisecond
LEAST_TIME = 0.05

Places = tuple[Index, Index, Index]  # derivative, grid point, coordinate
Marks = npt.NDArray[np.bool_]

_DAQP_OPTIMAL = 1
_ACTIVE, _EQUAL, _SOFT = 1, 5, 8
_INFINITE = 1e30


@dataclass(frozen=True)
class QPInputs:
    """What the QP is made of at one iterate.

    `hessian` (n, n), positive definite, and `gradient` (n,) are in the scaled variables; `ratio` (3, M, r) holds speed,
    acceleration and jerk over their limits on the grid.
    """

    hessian: Array
    gradient: Array
    free: Array
    T: float
    line: Linearisation
    path_values: PathConstraintValues
    ratio: Array


@dataclass(frozen=True)
class QPStep:
    """Solution of a QP: step x (n,) in the scaled variables, and the multipliers ≥ 0 of its constraints.

    `relaxed`: the QP was infeasible, and x breaks its constraints as little as possible. `kinematic` are the
    multipliers at `places`, `torque` those at `nodes` (node, joint) of torques with `signs`, `path` those at `passed`
    (path point, column).
    """

    x: Array
    relaxed: bool
    places: Places
    kinematic: Array
    nodes: tuple[Index, Index]
    signs: Array
    torque: Array
    passed: tuple[Index, Index]
    path: Array


@dataclass(frozen=True)
class _TorqueRows:
    """Motor torques near their limits: node and joint, sign, gradients (rows, n) and slack, as ratios of the limit."""

    nodes: tuple[Index, Index]
    signs: Array
    gradients: Array
    slack: Array


@dataclass(frozen=True)
class _GoalRows:
    """least ≤ gradients (c, n) · x ≤ most: how the goal may move."""

    gradients: Array
    least: Array
    most: Array


@dataclass
class _Rows:
    """Constraints A x ≤ b in the order goal, path, torque, kinematic. Variables and goal are never relaxed.

    `chosen` (3, M, r) marks the grid points with a kinematic row, `places` lists them in the order of the rows.
    """

    goal: _GoalRows
    lower: Array
    upper: Array
    A: Array
    b: Array
    chosen: Marks
    places: Places

    @property
    def hard(self) -> int:
        """Number of bounds and rows that may not be relaxed."""
        return len(self.lower) + len(self.goal.gradients)

    @property
    def fixed(self) -> Index:
        """The rows of the goal that are equations."""
        return np.asarray(len(self.lower) + np.flatnonzero(self.goal.least == self.goal.most))

    def solved(self, at: QPInputs, working: Marks, relax: bool) -> tuple[Array, Array, bool]:
        """DAQP's x, the multipliers of bounds and rows, and whether it found them; `working` marks a first guess."""
        sense = np.zeros(self.hard + len(self.b), dtype=np.int32)
        if relax:
            sense[self.hard :] = _SOFT
        else:
            sense[: len(working)][working] = _ACTIVE
        sense[self.fixed] = _EQUAL
        least = np.concatenate([self.lower, self.goal.least, np.full(len(self.b), -_INFINITE)])
        most = np.concatenate([self.upper, self.goal.most, self.b])
        left = watched_time_left()
        x, _, flag, info = daqp.solve(
            at.hessian,
            at.gradient,
            self.A,
            most,
            least,
            sense,
            primal_tol=1e-9,
            eps_prox=0.0,
            rho_soft=1e-6,
            # 0: no limit
            time_limit=max(left, LEAST_TIME) if np.isfinite(left) else 0.0,
        )
        return x, info["lam"], bool(flag >= _DAQP_OPTIMAL)


class WorkingSetQP:
    """The QPs of one run of the SQP; it keeps the kinematic constraints that were active, for the next one.

    Variables x: free control points row by row, then T / time_scale if the duration is free.
    """

    def __init__(self, program: NonlinearProgram, time_scale: float) -> None:
        self.p, self.time_scale = program, time_scale
        self.free_time = program.t_max > program.t_min
        self.count = program.free_count * program.r
        self.n = self.count + int(self.free_time)
        basis = program.basis
        self._grid_free = program.free_columns(basis.at_grid)
        self._anchors = basis.anchors[:, :, None]
        self._orders = np.arange(1, 4)
        self._active = np.zeros((*basis.at_grid.shape[:2], program.r), dtype=bool)

    def rates(self, T: float) -> Array:
        """Limits on the first to third derivative of s by τ, (3, r), for the duration T [s]."""
        return np.asarray(self.p.limits.rates * (T**self._orders)[:, None])

    def solve(self, at: QPInputs) -> QPStep | None:
        """The step; None if even the relaxed QP has no solution."""
        torque = self._torque_rows(at)
        path = self.p.path_rows.active(at.path_values, at.T, NEAR_PATH)
        rows = self._rows(at, torque, path)
        before = len(path.slack) + len(torque.slack)
        working = np.concatenate([np.zeros(rows.hard + before, dtype=bool), self._active[rows.places]])
        relaxed = False
        for attempt in range(QP_ROUNDS):
            checkpoint()
            x, multipliers, found = rows.solved(at, working, relaxed)
            if not found:
                checkpoint()
            if not found and relaxed:
                return None
            if not found:
                relaxed = True
                continue
            working = multipliers > 0
            if attempt == QP_ROUNDS - 1 or not self._add_broken(rows, at, x):
                break
        mu = np.maximum(multipliers[rows.hard :], 0.0)
        mu_path, mu_torque, kinematic = np.split(mu, [len(path.slack), before])
        self._active[...] = False
        held = kinematic > 0
        self._active[tuple(place[held] for place in rows.places)] = True
        passed = path.points, path.columns
        return QPStep(x, relaxed, rows.places, kinematic, torque.nodes, torque.signs, mu_torque, passed, mu_path)

    def _rows(self, at: QPInputs, torque: _TorqueRows, path: ActivePathConstraints) -> _Rows:
        """The rows that the QP is first solved with."""
        size = np.abs(at.ratio)
        chosen = (size > NEAR) & (self._anchors | _peaks(size)) | self._active
        places: Places = np.nonzero(chosen)  # type: ignore[assignment]
        goal = self._goal_rows(at.free)
        kinematic = self._kinematic_rows(places, np.sign(at.ratio[places]), at.T)
        A = np.concatenate([goal.gradients, self._scaled(path.gradients), torque.gradients, kinematic])
        b = np.concatenate([path.slack, torque.slack, 1 - size[places]])
        return _Rows(goal, *self._bounds(at.free, at.T), A, b, chosen, places)

    def _add_broken(self, rows: _Rows, at: QPInputs, x: Array) -> bool:
        """Add rows at the peaks that exceed a limit after the step x; whether there are any."""
        moved = (self._grid_free @ x[: self.count].reshape(at.free.shape)) / self.rates(at.T)[:, None, :]
        predicted = at.ratio + moved
        if self.free_time:
            growth = 1 + self._orders * x[-1] * self.time_scale / at.T
            predicted /= np.maximum(growth, 1e-3)[:, None, None]
        size = np.abs(predicted)
        broken = size > 1 + FEASIBILITY / 4
        if not broken.any():
            return False
        broken &= (self._anchors | _peaks(size)) & ~rows.chosen
        fresh: Places = np.nonzero(broken)  # type: ignore[assignment]
        if not len(fresh[0]):
            return False
        rows.chosen |= broken
        # the row's sign is that of the value after the step, not before it
        signs = np.sign(predicted[fresh])
        rows.A = np.concatenate([rows.A, self._kinematic_rows(fresh, signs, at.T)])
        rows.b = np.concatenate([rows.b, 1 - signs * at.ratio[fresh]])
        rows.places = tuple(np.concatenate(both) for both in zip(rows.places, fresh, strict=True))  # type: ignore[assignment]
        return True

    def _kinematic_rows(self, places: Places, signs: Array, T: float) -> Array:
        """Gradients (rows, n) of sign · value / limit at the places."""
        d, g, j = places
        A = np.zeros((len(d), self.n))
        block = (signs / self.rates(T)[d, j])[:, None] * self._grid_free[d, g]
        A[np.arange(len(d))[:, None], np.arange(self.p.free_count) * self.p.r + j[:, None]] = block
        if self.free_time:
            A[:, -1] = -(d + 1) / T * self.time_scale
        return A

    def _torque_rows(self, at: QPInputs) -> _TorqueRows:
        """The motor torques above NEAR_TORQUE of their limits."""
        tau_max = self.p.limits.tau_max
        ratio = at.line.tau / tau_max
        k, j = np.nonzero(np.abs(ratio) > NEAR_TORQUE)
        signs = np.sign(ratio[k, j])
        if not len(k):
            return _TorqueRows((k, j), signs, np.zeros((0, self.n)), signs)
        gradients = self.p.torque_rows(at.line, at.T, k, j) * (signs / tau_max[j])[:, None]
        return _TorqueRows((k, j), signs, self._scaled(gradients), 1 - np.abs(ratio[k, j]))

    def _scaled(self, gradients: Array) -> Array:
        """Gradients (rows, n) by the scaled variables, for gradients (rows, count + 1) by (s, T)."""
        scaled = gradients.copy()
        scaled[:, -1] *= self.time_scale
        return scaled[:, : self.n]

    def _bounds(self, free: Array, T: float) -> tuple[Array, Array]:
        """Least and greatest change of each variable. Within position limits, control points keep the curve inside."""
        p = self.p
        lower = np.maximum(np.tile(p.limits.q_min, p.free_count) - free.ravel(), -STEP)
        upper = np.minimum(np.tile(p.limits.q_max, p.free_count) - free.ravel(), STEP)
        if p.goal_constraints is not None:
            moved = free[-1] - p.coordinates.goal
            lower[-p.r :] = np.maximum(lower[-p.r :], -p.goal_constraints.radius - moved)
            upper[-p.r :] = np.minimum(upper[-p.r :], p.goal_constraints.radius - moved)
        if self.free_time:
            lower = np.append(lower, max(p.t_min - T, -0.5 * T) / self.time_scale)
            upper = np.append(upper, min(p.t_max - T, T) / self.time_scale)
        return lower, upper

    def _goal_rows(self, free: Array) -> _GoalRows:
        """The goal constraints as bounds on the change of the goal; no rows if the goal is fixed."""
        constraints = self.p.goal_constraints
        if constraints is None:
            return _GoalRows(np.zeros((0, self.n)), np.zeros(0), np.zeros(0))
        A = np.zeros((len(constraints.rows), self.n))
        A[:, self.count - self.p.r : self.count] = constraints.rows
        moved = constraints.rows @ (free[-1] - self.p.coordinates.goal)
        return _GoalRows(A, constraints.lower - moved, constraints.upper - moved)


def _peaks(size: Array) -> Marks:
    """Marks the local maxima of size (d, M, r) ≥ 0 along the grid."""
    high = np.ones(size.shape, dtype=bool)
    rising = size[:, 1:] >= size[:, :-1]
    high[:, 1:] = rising
    high[:, :-1] &= ~rising
    return high
