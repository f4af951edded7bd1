"""SQP on the NLP of a retiming, with exact Hessians and an L1 merit function."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.solve.methods.retiming_program import RetimingProgram
from joulepath.optimizer.solve.methods.retiming_state import RetimingDerivatives, RetimingValues
from joulepath.optimizer.solve.nlp.active_path_constraints import Index
from joulepath.optimizer.solve.nlp.nonlinear_program import FEASIBILITY
from joulepath.optimizer.solve.nlp.qp_rows import QPRows
from joulepath.optimizer.solve.nlp.sqp import whitened
from joulepath.optimizer.solve.nlp.sqp_state import SQP


@dataclass(frozen=True)
class RetimingSqpSettings:
    """Settings of the SQP on retimings; those of its line search are in `SQP`."""

    progress: float = 1e-5
    """Relative decrease of the cost that a further step must promise."""

    max_iterations: int = 100
    """Largest number of iterations."""

    near: float = 0.7
    """Ratio above which a constraint enters the first QP of a step."""

    rounds: int = 4
    """Solves of the QP of a step, each with the constraints that the step before violates."""

    short_step: float = 0.05
    """Share of the step of a QP below which an iteration counts as stalled."""

    stalled: int = 3
    """Successive stalled iterations after which the SQP ends."""

    shortest: float = 0.5
    """Smallest ratio of the durations after and before a step."""

    longest: float = 2.0
    """Largest ratio of the durations after and before a step."""


RETIMING_SQP = RetimingSqpSettings()


@dataclass(frozen=True, eq=False)
class _Step:
    """Solution of the QP of a step."""

    x: Array
    """Step in the scaled variables, shape (m + 1,)."""

    multipliers: Array
    """Multipliers (rows,) of the ratios, with the signs of their two sides."""

    relaxed: bool
    """Whether the QP was infeasible: then the step violates its constraints as little as
    possible."""

    qp: _QP
    """The QP."""


@dataclass(frozen=True, eq=False)
class _QP:
    """Minimise ½ xᵀ H x + gradientᵀ x within linear rows, in the scaled variables."""

    rows: QPRows
    """The rows."""

    gradient: Array
    """Gradient of the scaled cost, shape (m + 1,)."""

    of_ratios: Index
    """Numbers of the rows of ratios, shape (k,)."""

    ratios: Index
    """Numbers of their ratios, shape (k,)."""

    signs: Array
    """Signs of these ratios, shape (k,)."""

    def corrected(self, x: Array, trial: RetimingValues) -> Array | None:
        """The step corrected for the curvature of its constraints.

        Args:
            x: the step, shape (m + 1,).
            trial: values after the step.

        Returns:
            The corrected step; None if the QP has no solution.
        """
        reached = np.concatenate(self.rows.gradients)[self.of_ratios] @ x
        self.rows.replace_bounds(
            self.of_ratios, 1 - self.signs * trial.ratio[self.ratios] + reached
        )
        W = self.rows.whitening
        y, _, found = self.rows.solve(self.gradient @ W, relax=False)
        return W @ y if found else None


class RetimingSqp:
    """One run of the SQP.

    Args:
        program: the NLP.
        x: variables to start from, shape (m + 1,).

    Attributes:
        at: the last iterate.
        iterations: number of iterations.
    """

    def __init__(self, program: RetimingProgram, x: Array) -> None:
        self.at, self.iterations = program.values(x), 0
        self._program, self._interval = program, program.retiming.interval
        self._scale = np.append(np.ones(len(x) - 1), x[-1])
        self._cost_scale = 1.0 / max(abs(self.at.cost), 1e-9)
        self._penalty = np.full(len(self.at.violation), SQP.first_penalty)
        self._multipliers = np.zeros(len(self.at.ratio))

    def solve(self) -> None:
        """Iterate until no step promises enough, or the line search stalls.

        Where the duration may be longer, a longer one then undoes the violations of rates.
        """
        self._iterate()
        rates, T = self.at.ratios[0], self.at.T
        powers = 1 / np.arange(1.0, 4.0)
        needed = float((np.abs(rates).max(axis=(1, 2)) ** powers).max())
        if needed > 1 + FEASIBILITY and T * needed <= self._interval.t_max:
            slower = self._program.values(np.append(self.at.x[:-1], T * needed))
            if slower.violation.max() < self.at.violation.max():
                self.at = slower

    def _iterate(self) -> None:
        stalled = 0
        for self.iterations in range(1, RETIMING_SQP.max_iterations + 1):
            line = self._program.derivatives(self.at, self._multipliers / self._cost_scale)
            gradient = line.gradient * self._scale * self._cost_scale
            scales = np.outer(self._scale, self._scale) * self._cost_scale
            bends, whitening = whitened(line.hessian * scales)
            step = self._step(line, gradient, whitening)
            if step is None:
                return
            self._multipliers = step.multipliers
            if not step.relaxed:
                need = np.bincount(self.at.group, np.abs(step.multipliers), len(self._penalty))
                self._penalty = np.maximum(self._penalty, SQP.penalty_factor * need)
            slope = float(gradient @ step.x)
            promised = -slope - 0.5 * float(step.x @ bends(step.x))
            if promised < RETIMING_SQP.progress and self.at.violation.max() < FEASIBILITY:
                return
            found = self._line_search(step, slope)
            if found is None:
                return
            moved = np.abs(found.x - self.at.x).max()
            short = moved < RETIMING_SQP.short_step * np.abs(step.x * self._scale).max()
            stalled = stalled + 1 if short else 0
            self.at = found
            if stalled == RETIMING_SQP.stalled:
                return

    def _step(self, line: RetimingDerivatives, gradient: Array, whitening: Array) -> _Step | None:
        """Solve the QP, adding constraints that its step violates.

        Returns:
            The step; None if even the relaxed QP has no solution.
        """
        at, rows = self.at, QPRows(whitening)
        self._add_bounds(rows)
        first, was_active = rows.count, self._multipliers != 0
        signs = np.where(at.two_sided, np.sign(at.ratio), 1.0)
        chosen = (signs * at.ratio > RETIMING_SQP.near) | was_active
        numbers, fresh, relaxed = np.zeros(0, dtype=int), chosen, False
        for _ in range(RETIMING_SQP.rounds):
            rows.add(
                self._program.rows(at, line, fresh, signs) * self._scale,
                1 - signs[fresh] * at.ratio[fresh],
                active=was_active[fresh],
            )
            numbers = np.append(numbers, np.flatnonzero(fresh))
            y, multipliers, found = rows.solve(gradient @ whitening, relaxed)
            if not found and not relaxed:
                relaxed = True
                y, multipliers, found = rows.solve(gradient @ whitening, relaxed)
            if not found:
                return None
            x = whitening @ y
            after = self._program.predicted(at, line, x * self._scale)
            sides = np.where(at.two_sided, np.sign(after), 1.0)
            fresh = (sides * after > 1 + FEASIBILITY / 4) & ~chosen
            if not fresh.any():
                break
            chosen, signs = chosen | fresh, np.where(fresh, sides, signs)
        of_ratios = np.zeros(len(at.ratio))
        of_ratios[numbers] = np.maximum(multipliers[first:], 0.0) * signs[numbers]
        qp = _QP(rows, gradient, first + np.arange(len(numbers)), numbers, signs[numbers])
        return _Step(x, of_ratios, relaxed, qp)

    def _add_bounds(self, rows: QPRows) -> None:
        """Add the order of the control values, which rise from 0 to 1, and the durations."""
        x, T, interval = self.at.x, self.at.T, self._interval
        gaps = np.diff(np.concatenate([[0.0], x[:-1], [1.0]]))
        rising = np.eye(len(gaps), len(x)) - np.eye(len(gaps), len(x), -1)
        rising[:, -1] = 0.0
        rows.add(-rising, gaps, hard=True)
        by_T = np.zeros((1, len(x)))
        by_T[0, -1] = self._scale[-1]
        shortest = max(interval.t_min, RETIMING_SQP.shortest * T)
        longest = min(interval.t_max, RETIMING_SQP.longest * T)
        rows.add(by_T, np.array([longest - T]), np.array([shortest - T]), hard=True)

    def _line_search(self, step: _Step, slope: float) -> RetimingValues | None:
        """Correct the step, or halve it until the merit function falls enough.

        Args:
            step: the step.
            slope: slope of the scaled cost along the step.

        Returns:
            The next iterate; None if the merit function does not fall enough.
        """
        at, alpha = self.at, 1.0
        descent = min(slope - float(self._penalty @ at.violation), 0.0)
        for _ in range(SQP.max_backtracks):
            allowed = self._merit(at) + SQP.armijo * alpha * descent + SQP.merit_rounding
            trial = self._trial(alpha * step.x)
            if self._merit(trial) <= allowed:
                return trial
            if alpha == 1.0 and not step.relaxed:
                corrected = step.qp.corrected(step.x, trial)
                if corrected is not None:
                    trial = self._trial(corrected)
                    if self._merit(trial) <= allowed:
                        return trial
            alpha *= 0.5
        return None

    def _trial(self, dx: Array) -> RetimingValues:
        """Values after a step in the scaled variables (m + 1,)."""
        x = self.at.x + dx * self._scale
        # rounding must not leave the bounds
        x[:-1] = np.maximum.accumulate(np.clip(x[:-1], 0.0, 1.0))
        x[-1] = np.clip(x[-1], self._interval.t_min, self._interval.t_max)
        return self._program.values(x)

    def _merit(self, at: RetimingValues) -> float:
        """The scaled cost, plus the penalties of the violations."""
        return at.cost * self._cost_scale + float(self._penalty @ at.violation)
