"""The QP of one SQP step, over the constraints near their limits.

Speed, acceleration and jerk are limited at every point of a fine grid. Only their peaks, and the
anchors of the basis, enter the QP when they come near a limit. If the step of the QP violates a
limit at another point, or the bound of a variable, this is added and the QP is solved again. There
are hundreds of clearances, of which two or three are active: they enter likewise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.solve.nlp.active_path_constraints import Index, NearPathConstraints
from joulepath.optimizer.solve.nlp.nonlinear_program import FEASIBILITY, NonlinearProgram
from joulepath.optimizer.solve.nlp.qp_data import (
    QPInputs,
    QPStep,
    TorqueRows,
    peaks,
    places_of,
    shortened,
)
from joulepath.optimizer.solve.nlp.qp_rows import Places, ProgramRows


@dataclass(frozen=True)
class WorkingSetSettings:
    """Which constraints the QP of a step has, and how often it is solved."""

    near_rate: float = 0.6
    """Ratio to its limit above which a rate enters the first QP."""

    near_rate_later: float = 0.85
    """The same for later QPs, in which the limits active before enter too. With a fifth fewer rows,
    steps are as few and as good."""

    near_torque: float = 0.5
    """Ratio to its limit above which a torque enters a QP."""

    near_path: float = 0.5
    """Ratio to its bound above which a path constraint enters a QP; a clearance enters once a step
    violates it."""

    near_clearance: float = 0.9
    """Ratio to its bound above which a clearance enters at once, as do clearances active before."""

    largest_step: float = 1.5
    """Largest change of a coordinate of a control point in one step [rad]."""

    rounds: tuple[int, ...] = (3, 3, 3, 2)
    """Solves of the first QPs, each with the constraints that the step before violates; the last
    number is that of all further QPs. Constraints violated in the last solve enter the QP of the
    next iterate: more rounds take more time than they save, unless the line search fails."""

    max_rounds: int = 10
    """The same after a failed line search, and among obstacles."""

    relaxed_rounds: int = 2
    """The same for a relaxed QP with clearance constraints: it has many rows, none of which was
    active before."""

    bound_tolerance: float = 1e-9
    """Excess over the bound of a variable at which the bound enters the QP [rad, or share of the
    duration]."""


WORKING_SET = WorkingSetSettings()


class WorkingSetQP:
    """The QPs of one run of the SQP; the active constraints of one QP enter the next.

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
        """Solve the QP, adding constraints that its step violates.

        Args:
            at: the QP at an iterate.
            rounds: largest number of solves.
            enough: relative decrease of the cost below which the step is returned at once: with
                further constraints, it would promise even less.

        Returns:
            The step; None if even the relaxed QP has no solution.
        """
        torque = self._torque_rows(at)
        bounds = np.array(self._bounds(at.free, at.T))
        rows = ProgramRows(at.whitening, at.ratio.shape)
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
                # without bounds, the step of a relaxed QP may have any length
                relaxed = True
                last = attempt + (WORKING_SET.relaxed_rounds if self.p.has_clearance else rounds)
                rows.add_bounds(bounds, np.ones_like(rows.bounded))
                path = self._add_path(rows, at, path, np.ones(len(path.slack), dtype=bool))
                continue
            x = at.whitening @ y
            # the Hessian is the identity in y
            if attempt >= last or -float(gradient @ y) - 0.5 * float(y @ y) < enough:
                break
            if self._adds_bounds(rows, bounds, x):
                continue
            adds_rates = self._adds_rates(rows, at, x)
            (adds_path, path) = self._adds_path(rows, at, path, x)
            if not (adds_rates or adds_path):
                break
        x = shortened(x, bounds, WORKING_SET.bound_tolerance)
        return self._solution(rows, torque, limited, x, multipliers, relaxed)

    def _solution(
        self,
        rows: ProgramRows,
        torque: TorqueRows,
        limited: Index,
        x: Array,
        multipliers: Array,
        relaxed: bool,
    ) -> QPStep:
        """The step with its multipliers; active constraints are kept for the next QP."""
        mu = np.maximum(multipliers, 0.0)
        pull = (
            multipliers @ np.concatenate(rows.gradients)
            if self.p.has_equations
            else np.zeros(self.n)
        )
        (kinematic, places), (bounded, sides), (near, passed) = (
            each.joined() for each in (rows.rates, rows.bounds, rows.path)
        )
        for marks, at_places, numbers in (
            (self._active, places, kinematic),
            (self._bounded, sides, bounded),
            (self._passed, passed, near),
        ):
            marks[...] = False
            marks[at_places] = mu[numbers] > 0
        return QPStep(
            x,
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

    def _first_path_rows(self, rows: ProgramRows, at: QPInputs) -> NearPathConstraints:
        """Add the path constraints of the first solve; returns the others near their bounds."""
        near = self.p.path_rows.near(at.path_values, WORKING_SET.near_path)
        if not len(near.slack):
            return near
        at_once = np.ones(len(near.slack), dtype=bool)
        if self.p.has_clearance:
            at_once = near.ratio > WORKING_SET.near_clearance * (near.ratio + near.slack)
            at_once |= self._passed[near.points, near.columns]
        return self._add_path(rows, at, near, at_once)

    def _add_path(
        self, rows: ProgramRows, at: QPInputs, near: NearPathConstraints, wanted: Mask
    ) -> NearPathConstraints:
        """Add the `wanted` path constraints, and return the others."""
        added = near[np.flatnonzero(wanted)]
        passed = added.points, added.columns
        gradients = self._scaled(self.p.path_rows.gradients(at.path_values, at.T, added))
        rows.add_path(gradients, added.slack, passed, self._passed[passed])
        return near[np.flatnonzero(~wanted)]

    def _adds_path(
        self, rows: ProgramRows, at: QPInputs, near: NearPathConstraints, x: Array
    ) -> tuple[bool, NearPathConstraints]:
        """Add the path constraints without a row that the step x violates.

        Returns:
            Whether there are any, and the path constraints still without a row.
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

    def _add_kinematic(self, rows: ProgramRows, at: QPInputs) -> None:
        """Add the limits on rates of the first solve."""
        chosen = self._active.copy()
        near = WORKING_SET.near_rate_later if chosen.any() else WORKING_SET.near_rate
        chosen[self._worst(at.ratio, np.full(3, near))] = True
        d, j, grid = places_of(chosen)
        places = d, j, grid
        self._add_rates(rows, at, places, at.ratio[places] >= 0, self._active[places])

    def _worst(self, ratio: Array, above: Array) -> Places:
        """Anchors and local peaks of ratios above a bound; few coordinates exceed it anywhere.

        Args:
            ratio: ratios on the grid, shape (3, r, M).
            above: bound of each derivative, shape (3,).
        """
        largest = np.maximum(ratio.max(axis=2), -ratio.min(axis=2))
        d, j = np.nonzero(largest > above[:, None])
        size = np.abs(ratio[d, j])
        k, grid = places_of((size > above[d, None]) & (self._anchors[d] | peaks(size)))
        return d[k], j[k], grid

    def _adds_bounds(self, rows: ProgramRows, bounds: Array, x: Array) -> bool:
        """Add all bounds if the step x violates one without a row; whether it does.

        A step without bounds may be so long that it violates every limit.
        """
        tolerance = WORKING_SET.bound_tolerance
        violated = (bounds[0] - x > tolerance) | (x - bounds[1] > tolerance)
        if rows.bounded.all() or not violated.any():
            return False
        rows.add_bounds(bounds, np.ones_like(rows.bounded))
        return True

    def _adds_rates(self, rows: ProgramRows, at: QPInputs, x: Array) -> bool:
        """Add the peaks of limits on rates without a row that the step x violates; whether any."""
        change = x[: self.count].reshape(at.free.shape).T / at.rates[:, :, None]
        predicted = change @ self._grid_free.swapaxes(1, 2)
        predicted += at.ratio
        # ratios of the limits by τ after the step to the limits before the step
        limits = np.ones(3)
        if self.free_time:
            limits = np.maximum(1 + self._orders * x[-1] * self.time_scale / at.T, 1e-3)
        places = self._worst(predicted, limits * (1 + FEASIBILITY / 4))
        # the value after the step has this side, not the value before
        upper = predicted[places] >= 0
        unknown = ~rows.chosen[upper.astype(int), *places]
        fresh: Places = (places[0][unknown], places[1][unknown], places[2][unknown])
        if not len(fresh[0]):
            return False
        self._add_rates(rows, at, fresh, upper[unknown])
        return True

    def _add_rates(
        self,
        rows: ProgramRows,
        at: QPInputs,
        places: Places,
        upper: Mask,
        active: Mask | bool = False,
    ) -> None:
        """Add the `upper` or lower limits on rates at places; `active` as of `ProgramRows.add`."""
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

    def _torque_rows(self, at: QPInputs) -> TorqueRows:
        """The limited torques near their limits."""
        tau_max = self.p.limits.tau_max
        ratio = at.line.tau / tau_max
        k, j = np.nonzero(np.abs(ratio) > WORKING_SET.near_torque)
        signs = np.sign(ratio[k, j])
        if not len(k):
            return TorqueRows((k, j), signs, np.zeros((0, self.n)), signs)
        gradients = self.p.torque_rows(at.line, at.T, k, j) * (signs / tau_max[j])[:, None]
        return TorqueRows((k, j), signs, self._scaled(gradients), 1 - np.abs(ratio[k, j]))

    def _scaled(self, gradients: Array) -> Array:
        """Gradients (rows, n) by the scaled variables, for gradients (rows, count + 1) by (s,
        T)."""
        scaled = gradients.copy()
        scaled[:, -1] *= self.time_scale
        return scaled[:, : self.n]

    def _bounds(self, free: Array, T: float) -> tuple[Array, Array]:
        """Smallest and largest change (n,) of every variable.

        Control points within the position limits keep the whole curve inside.
        """
        p, largest = self.p, WORKING_SET.largest_step
        lower = np.maximum(p.limits.q_min - free, -largest).ravel()
        upper = np.minimum(p.limits.q_max - free, largest).ravel()
        if p.goal_constraints is not None:
            moved = free[-1] - p.coordinates.goal
            lower[-p.r :] = np.maximum(lower[-p.r :], -p.goal_constraints.radius - moved)
            upper[-p.r :] = np.minimum(upper[-p.r :], p.goal_constraints.radius - moved)
        if self.free_time:
            lower = np.append(lower, max(p.t_min - T, -0.5 * T) / self.time_scale)
            upper = np.append(upper, min(p.t_max - T, T) / self.time_scale)
        return lower, upper

    def _add_goal(self, rows: ProgramRows, free: Array) -> None:
        """Add the goal constraints as bounds on the change of the goal, unless it is fixed."""
        constraints = self.p.goal_constraints
        if constraints is None:
            return
        A = np.zeros((len(constraints.rows), self.n))
        A[:, self.count - self.p.r : self.count] = constraints.rows
        moved = constraints.rows @ (free[-1] - self.p.coordinates.goal)
        rows.add(A, constraints.upper - moved, constraints.lower - moved, hard=True)
