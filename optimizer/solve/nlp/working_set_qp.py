"""The QP of one SQP step, over the constraints near their limits.

Speed, acceleration and jerk are limited at every point of a fine grid. Only their peaks, and the
anchors of the basis, enter the QP when they come near a limit. If its step breaks a limit at
another point, or a bound of a variable, this is added and the QP is solved again. Clearances are
hundreds, and two or three of them hold a motion: they enter likewise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.solve.nlp.active_path_constraints import (
    Index,
    NearPathConstraints,
    PathConstraintValues,
)
from joulepath.optimizer.solve.nlp.nonlinear_program import (
    FEASIBILITY,
    Linearisation,
    NonlinearProgram,
)
from joulepath.optimizer.solve.nlp.qp_rows import Places, QPRows

# a rate enters the first QP above this ratio of its limit, and a later one above the second: there,
# limits that were active in the QP before enter, too. With a fifth fewer rows, steps are as few and
# as good
NEAR, NEAR_LATER = 0.6, 0.85
# torques and path constraints enter any QP above these
NEAR_TORQUE = 0.5
NEAR_PATH = 0.5
# clearances enter above this ratio, or if they were active in the QP before; above NEAR_PATH once a
# step breaks them
NEAR_CLEARANCE = 0.9
# no coordinate of a control point moves further in one step [rad]
STEP = 1.5
# solves of a QP, each with the constraints that the step before would break: of the first QPs, and
# of all that follow. What the last solve breaks enters the QP of the next iterate: more rounds take
# more time than they save, unless the line search fails
QP_ROUNDS, MOST_ROUNDS = (3, 3, 3, 2), 10
# the same for a relaxed QP with clearance constraints: it has many rows, and none of them was
# active before
RELAXED_ROUNDS = 2
# excess over the bound of a variable [rad, or share of the duration] at which it enters the QP
BOUND_TOLERANCE = 1e-9


@dataclass(frozen=True)
class QPInputs:
    """What the QP is made of at one iterate.

    `hessian` H times a step (n,) and `gradient` (n,) are in the scaled variables. `whitening` W (n,
    k): Wᵀ H W = 1, for steps that keep what is held. `ratio` (3, r, M): rates over their limits
    `rates` (3, r) on the grid.
    """

    hessian: Callable[[Array], Array]
    whitening: Array
    gradient: Array
    free: Array
    T: float
    line: Linearisation
    path_values: PathConstraintValues
    rates: Array
    ratio: Array


@dataclass(frozen=True)
class QPStep:
    """Solution of a QP: step x (n,) in the scaled variables, and the multipliers ≥ 0 of its
    constraints.

    `relaxed`: the QP was infeasible, and x breaks its constraints as little as possible.
    `kinematic` are the multipliers at `places`, `torque` those at `nodes` (node, joint) of torques
    with `signs`, `path` those at `passed` (path point, column). `pull` (n,): sum of the
    constraints' gradients times multipliers; zero if nothing is held.
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
    pull: Array


@dataclass(frozen=True)
class _TorqueRows:
    """Torques near their limits: node and joint, sign, gradients (rows, n) and slack, as ratios of
    the limit.
    """

    nodes: tuple[Index, Index]
    signs: Array
    gradients: Array
    slack: Array


class WorkingSetQP:
    """The QPs of one run of the SQP; it keeps the constraints that were active, for the next one.

    Variables x: free control points row by row, then T / time_scale if the duration is free.
    """

    def __init__(self, program: NonlinearProgram, time_scale: float) -> None:
        self.p, self.time_scale = program, time_scale
        self.free_time = program.t_max > program.t_min
        self.count = program.free_count * program.r
        self.n = self.count + int(self.free_time)
        basis = program.basis
        self._grid_free = program.free_columns(basis.at_grid)
        self._anchors = basis.anchors
        self._orders = np.arange(1, 4)
        self._active = np.zeros((3, program.r, basis.at_grid.shape[1]), dtype=bool)
        self._bounded = np.zeros((2, self.n), dtype=bool)
        self._passed = np.zeros((len(basis.at_path[0]), len(program.path_bounds)), dtype=bool)

    def rates(self, T: float) -> Array:
        """Limits on the first to third derivative of s by τ, (3, r), for the duration T [s]."""
        return np.asarray(self.p.limits.rates * (T**self._orders)[:, None])

    def solve(self, at: QPInputs, rounds: int, enough: float = -np.inf) -> QPStep | None:
        """The step; None if even the relaxed QP has no solution.

        It ends early with a solution that promises a relative decrease of the cost below `enough`:
        with further constraints, the next one would promise less still.
        """
        torque = self._torque_rows(at)
        rows, bounds = QPRows(at.whitening, at.ratio.shape), np.array(self._bounds(at.free, at.T))
        self._add_goal(rows, at.free)
        path = self._first_path_rows(rows, at)
        limited = rows.add(torque.gradients, torque.slack)
        self._add_kinematic(rows, at)
        rows.add_bounds(bounds, self._bounded)
        gradient, relaxed, attempt, last = at.gradient @ at.whitening, False, 0, rounds
        while True:
            attempt += 1
            checkpoint()
            y, multipliers, found = rows.solve(gradient, relaxed)
            if not found:
                checkpoint()
            if not found and relaxed:
                return None
            if not found:
                # a relaxed QP without bounds may have a step of any length
                relaxed = True
                last = attempt + (RELAXED_ROUNDS if self.p.has_clearance else rounds)
                rows.add_bounds(bounds, np.ones_like(rows.bounded))
                path = self._add_path(rows, at, path, np.ones(len(path.slack), dtype=bool))
                continue
            x = at.whitening @ y
            # the Hessian is the identity in y
            if attempt >= last or -float(gradient @ y) - 0.5 * float(y @ y) < enough:
                break
            if self._adds_bounds(rows, bounds, x):
                continue
            adds_rates, (adds_path, path) = (
                self._adds_rates(rows, at, x),
                self._adds_path(rows, at, path, x),
            )
            if not (adds_rates or adds_path):
                break
        mu = np.maximum(multipliers, 0.0)
        pull = multipliers @ np.concatenate(rows.gradients) if self.p.held else np.zeros(self.n)
        (kinematic, places), (bounded, sides), (near, passed) = (
            each.joined() for each in (rows.rates, rows.bounds, rows.path)
        )
        # what was active is kept for the next QP
        for marks, at_places, numbers in (
            (self._active, places, kinematic),
            (self._bounded, sides, bounded),
            (self._passed, passed, near),
        ):
            marks[...] = False
            marks[at_places] = mu[numbers] > 0
        return QPStep(
            _shortened(x, bounds),
            relaxed,
            places,
            mu[kinematic],
            torque.nodes,
            torque.signs,
            mu[limited],
            passed,
            mu[near],
            pull,
        )

    def _first_path_rows(self, rows: QPRows, at: QPInputs) -> NearPathConstraints:
        """Adds the path constraints that the QP is first solved with, and returns the others that
        are near.
        """
        near = self.p.path_rows.near(at.path_values, NEAR_PATH)
        if not len(near.slack):
            return near
        at_once = np.ones(len(near.slack), dtype=bool)
        if self.p.has_clearance:
            at_once = (near.ratio > NEAR_CLEARANCE * (near.ratio + near.slack)) | self._passed[
                near.points, near.columns
            ]
        return self._add_path(rows, at, near, at_once)

    def _add_path(
        self, rows: QPRows, at: QPInputs, near: NearPathConstraints, wanted: Mask
    ) -> NearPathConstraints:
        """Adds those of the path constraints that are `wanted`, and returns the others."""
        added = near[np.flatnonzero(wanted)]
        passed = added.points, added.columns
        gradients = self._scaled(self.p.path_rows.gradients(at.path_values, at.T, added))
        rows.add_path(gradients, added.slack, passed, self._passed[passed])
        return near[np.flatnonzero(~wanted)]

    def _adds_path(
        self, rows: QPRows, at: QPInputs, near: NearPathConstraints, x: Array
    ) -> tuple[bool, NearPathConstraints]:
        """Whether the step x breaks any of the path constraints without a row, which it then gets;
        and the others.
        """
        if not len(near.slack):
            return False, near
        dT = float(x[-1]) * self.time_scale if self.free_time else 0.0
        ds = x[: self.count].reshape(at.free.shape)
        broken = (
            self.p.path_rows.changes(at.path_values, at.T, near, ds, dT)
            > near.slack + FEASIBILITY / 4
        )
        return bool(broken.any()), self._add_path(rows, at, near, broken)

    def _add_kinematic(self, rows: QPRows, at: QPInputs) -> None:
        """Adds the limits on rates that the QP is first solved with."""
        chosen = self._active.copy()
        near = NEAR_LATER if chosen.any() else NEAR
        chosen[self._worst(at.ratio, np.full(3, near))] = True
        d, j, grid = _places(chosen)
        places = d, j, grid
        self._add_rates(rows, at, places, at.ratio[places] >= 0, self._active[places])

    def _worst(self, ratio: Array, above: Array) -> Places:
        """The anchors and local peaks at which the size of ratios (3, r, M) exceeds the bound of
        its derivative (3,).

        Most coordinates stay below it everywhere: only the others are searched.
        """
        largest = np.maximum(ratio.max(axis=2), -ratio.min(axis=2))
        d, j = np.nonzero(largest > above[:, None])
        size = np.abs(ratio[d, j])
        k, grid = _places((size > above[d, None]) & (self._anchors[d] | _peaks(size)))
        return d[k], j[k], grid

    def _adds_bounds(self, rows: QPRows, bounds: Array, x: Array) -> bool:
        """Whether the step x breaks a bound without a row: then all get theirs.

        A step without bounds may be so long that it breaks every limit.
        """
        if (
            rows.bounded.all()
            or not ((bounds[0] - x > BOUND_TOLERANCE) | (x - bounds[1] > BOUND_TOLERANCE)).any()
        ):
            return False
        rows.add_bounds(bounds, np.ones_like(rows.bounded))
        return True

    def _adds_rates(self, rows: QPRows, at: QPInputs, x: Array) -> bool:
        """Whether the step x breaks limits on rates without a row: then their peaks get theirs."""
        change = x[: self.count].reshape(at.free.shape).T / at.rates[:, :, None]
        predicted = change @ self._grid_free.swapaxes(1, 2)
        predicted += at.ratio
        # the limits of the rates by τ after the step, as ratios of those before it
        limits = np.ones(3)
        if self.free_time:
            limits = np.maximum(1 + self._orders * x[-1] * self.time_scale / at.T, 1e-3)
        places = self._worst(predicted, limits * (1 + FEASIBILITY / 4))
        # the side is that of the value after the step, not before it
        upper = predicted[places] >= 0
        unknown = ~rows.chosen[upper.astype(int), *places]
        fresh: Places = (places[0][unknown], places[1][unknown], places[2][unknown])
        if not len(fresh[0]):
            return False
        self._add_rates(rows, at, fresh, upper[unknown])
        return True

    def _add_rates(
        self, rows: QPRows, at: QPInputs, places: Places, upper: Mask, active: Mask | bool = False
    ) -> None:
        """Adds the `upper` or lower limits on rates at the places; `active` as in `QPRows.add`."""
        signs = np.where(upper, 1.0, -1.0)
        rows.add_kinematic(
            self._kinematic_rows(at, places, signs),
            1 - signs * at.ratio[places],
            places,
            upper,
            active,
        )

    def _kinematic_rows(self, at: QPInputs, places: Places, signs: Array) -> Array:
        """Gradients (rows, n) of sign · value / limit at the places."""
        d, j, g = places
        A = np.zeros((len(d), self.n))
        block = (signs / at.rates[d, j])[:, None] * self._grid_free[d, g]
        A[:, : self.count].reshape(len(d), self.p.free_count, self.p.r)[np.arange(len(d)), :, j] = (
            block
        )
        if self.free_time:
            A[:, -1] = -(d + 1) / at.T * self.time_scale
        return A

    def _torque_rows(self, at: QPInputs) -> _TorqueRows:
        """The limited torques above NEAR_TORQUE of their limits."""
        tau_max = self.p.limits.tau_max
        ratio = at.line.tau / tau_max
        k, j = np.nonzero(np.abs(ratio) > NEAR_TORQUE)
        signs = np.sign(ratio[k, j])
        if not len(k):
            return _TorqueRows((k, j), signs, np.zeros((0, self.n)), signs)
        gradients = self.p.torque_rows(at.line, at.T, k, j) * (signs / tau_max[j])[:, None]
        return _TorqueRows((k, j), signs, self._scaled(gradients), 1 - np.abs(ratio[k, j]))

    def _scaled(self, gradients: Array) -> Array:
        """Gradients (rows, n) by the scaled variables, for gradients (rows, count + 1) by (s,
        T)."""
        scaled = gradients.copy()
        scaled[:, -1] *= self.time_scale
        return scaled[:, : self.n]

    def _bounds(self, free: Array, T: float) -> tuple[Array, Array]:
        """Least and greatest change of each variable. Within position limits, control points keep
        the curve inside.
        """
        p = self.p
        lower = np.maximum(p.limits.q_min - free, -STEP).ravel()
        upper = np.minimum(p.limits.q_max - free, STEP).ravel()
        if p.goal_constraints is not None:
            moved = free[-1] - p.coordinates.goal
            lower[-p.r :] = np.maximum(lower[-p.r :], -p.goal_constraints.radius - moved)
            upper[-p.r :] = np.minimum(upper[-p.r :], p.goal_constraints.radius - moved)
        if self.free_time:
            lower = np.append(lower, max(p.t_min - T, -0.5 * T) / self.time_scale)
            upper = np.append(upper, min(p.t_max - T, T) / self.time_scale)
        return lower, upper

    def _add_goal(self, rows: QPRows, free: Array) -> None:
        """Adds the goal constraints as bounds on the change of the goal; no rows if the goal is
        fixed.
        """
        constraints = self.p.goal_constraints
        if constraints is None:
            return
        A = np.zeros((len(constraints.rows), self.n))
        A[:, self.count - self.p.r : self.count] = constraints.rows
        moved = constraints.rows @ (free[-1] - self.p.coordinates.goal)
        rows.add(A, constraints.upper - moved, constraints.lower - moved, hard=True)


def _shortened(x: Array, bounds: Array) -> Array:
    """The step, as far as the bounds (2, n) let it go: rounds may end before every bound has its
    row.
    """
    most = np.where(x > 0, bounds[1], bounds[0])
    beyond = np.abs(x) > np.abs(most) + BOUND_TOLERANCE
    return np.asarray(x * np.min(np.abs(most[beyond] / x[beyond]), initial=1.0))


def _peaks(size: Array) -> Mask:
    """Marks the local maxima of size (k, M) ≥ 0 along the grid."""
    high = np.ones(size.shape, dtype=bool)
    rising = size[:, 1:] >= size[:, :-1]
    high[:, 1:] = rising
    high[:, :-1] &= ~rising
    return high


def _places(marks: Mask) -> tuple[Index, ...]:
    """The places of marks; a search in one dimension is several times as fast as `np.nonzero` in
    two or three.
    """
    return np.unravel_index(np.flatnonzero(marks), marks.shape)
