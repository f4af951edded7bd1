"""Sequential quadratic programming on the NLP of one candidate: iteration, merit line search,
convergence.

A dense SQP with exact Hessians. Each step solves a QP over the constraints near their limits (see
`working_set_qp`). An L1 merit function and backtracking make it converge from any initial guess.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import NEVER, Deadline
from joulepath.optimizer.solve.nlp.active_path_constraints import PathConstraintValues
from joulepath.optimizer.solve.nlp.nonlinear_program import FEASIBILITY, NonlinearProgram
from joulepath.optimizer.solve.nlp.passing import Passes, Passing
from joulepath.optimizer.solve.nlp.sliding_ends import Slide, SlidingEnds
from joulepath.optimizer.solve.nlp.whitening import whitened
from joulepath.optimizer.solve.nlp.working_set_qp import (
    MOST_ROUNDS,
    QP_ROUNDS,
    QPInputs,
    QPStep,
    WorkingSetQP,
)

# relative decrease of the cost that a further step must promise
PROGRESS = 5e-5
MAX_ITERATIONS = 60
BACKTRACKS = 14
# steps of a relaxed QP after which a solve with clearance constraints is given up: the way out of
# an obstacle is short
MOST_RELAXED = 4
# part of the decrease promised by the gradient that a step of the line search must reach (Armijo),
# and its rounding
ARMIJO, ROUNDING = 1e-4, 1e-12
# a solve ends if even this multiple of the decrease that the gradient promises leaves the cost
# above what it must be below. With 2, one of 200 random requests missed a better motion, by 0.6 %;
# with 3, none did
MOST_DECREASE = 3.0
# a solve ends after a step that promised at most LAST_STEP and kept its promise but for ERROR of
# it, or of the progress that a further step must promise: the next QP promises about as much as
# this one was wrong by. With greater errors, one of 50 random requests ended 0.1 % too high. Steps
# that each promise about as much as the one before are no such last step: mechanical work has
# valleys that they follow
LAST_STEP, ERROR, CONVERGING = 5e-3, (0.02, 0.1), 0.5
# where a step is longer than the one before, a solve goes on if it promises more than this share of
# the progress: steps that grow lead away from a saddle, beyond which the cost falls by more than
# they promise. One of 100 random requests ended 1 % too high
GROWING = 0.5
# the penalty of a violation before any multiplier is known, and its least multiple of the
# multipliers
FIRST_PENALTY, PENALTY_FACTOR = 0.1, 2.0
# the first penalty of path constraints among which are clearances
CLEARANCE_PENALTY = 3.0


class SqpStatus(Enum):
    """Why the SQP ended."""

    SOLVED = "solved"
    INFEASIBLE = "infeasible"
    STALLED = "stalled"
    COSTLIER = "costlier"
    OUT_OF_TIME = "out of time"


@dataclass(frozen=True)
class Result:
    """The last iterate: free control points (m, r), duration [s], cost [J], torque multipliers (N,
    nq).

    `violation` is the largest excess of a constraint over its limit, as a ratio of the limit.
    `stationarity` is the largest component of the Lagrangian's gradient at the last step, as a
    ratio of the cost per radian (or per initial duration).
    """

    status: SqpStatus
    free: Array
    duration: float
    cost: float
    iterations: int
    violation: float
    stationarity: float
    multiplier: Array

    @property
    def feasible(self) -> bool:
        """Whether every constraint is within its limit, but for FEASIBILITY."""
        return self.violation <= FEASIBILITY


@dataclass(frozen=True)
class _Point:
    """An iterate: free control points, duration, cost [J], derivatives of s on the grid, path
    constraints, violations.

    `violation` (3 r + nq + c,) is the largest excess as a ratio of the limit: per derivative and
    coordinate, joint torque, and path constraint. `held` is what the program's passes, or its
    sliding ends, let a step do.
    """

    free: Array
    T: float
    cost: float
    kinematics: Array
    path_values: PathConstraintValues
    violation: Array
    held: Passing | Slide | None


class _Multipliers:
    """Multipliers of the cost's Lagrangian, and the penalties of the merit function that follow
    from them.
    """

    def __init__(self, torque: Array, path: Array, violations: int) -> None:
        self.torque = torque
        self.path = path
        # gradient (n,) of all constraints, weighed by their multipliers, by the scaled variables
        self.limits: Array | float = 0.0
        # second derivative of the kinematic constraints by T, in the scale of the QP's cost
        self.curvature = 0.0
        self.penalty = np.full(violations, FIRST_PENALTY)

    def update(self, step: QPStep, p: NonlinearProgram, T: float, cost_scale: float) -> None:
        """Take the multipliers of a QP."""
        # torque is nonlinear in the dynamics, kinematic limits in T^d: their multipliers weigh that
        # curvature
        self.torque = np.zeros_like(self.torque)
        self.torque[step.nodes] = (
            step.signs * step.torque / p.limits.tau_max[step.nodes[1]] / cost_scale
        )
        self.path = np.zeros_like(self.path)
        self.path[step.passed] = step.path / cost_scale
        self.limits = step.pull
        d = step.places[0]
        self.curvature = -float((step.kinematic * (d + 1) * d).sum()) / (T * T)
        if not step.relaxed:
            torques, paths = 3 * p.r, 3 * p.r + p.kernel.nq
            which = np.concatenate(
                [d * p.r + step.places[1], torques + step.nodes[1], paths + step.passed[1]]
            )
            multipliers = np.concatenate([step.kinematic, step.torque, step.path])
            need = np.bincount(which, multipliers, len(self.penalty))
            self.penalty = np.maximum(self.penalty, PENALTY_FACTOR * need)


class _Solver:
    """One run of the SQP."""

    def __init__(
        self,
        program: NonlinearProgram,
        free: Array,
        T: float,
        multiplier: Array | None,
        deadline: Deadline,
        progress: float,
        below: float,
    ) -> None:
        self.p, self.deadline, self.progress, self.below = program, deadline, progress, below
        self.qp = WorkingSetQP(program, time_scale=T)
        self.scale = np.ones(self.qp.n)
        if self.qp.free_time:
            self.scale[-1] = T
        if multiplier is None:
            multiplier = np.zeros((len(program.basis.nodes), program.kernel.nq))
        self.holding = _holding(program)
        held: Passing | Slide | None = None
        if self.holding is not None:
            put = self.holding.put(free)
            if put is None:
                raise ValueError(
                    "an end of the initial guess is not near the curve that it is to slide along"
                )
            free, held = put
        self.line, kinematics = program.derivatives(free, T, multiplier), program.kinematics(free)
        self.cost_scale = 1.0 / max(abs(self.line.cost), 1e-9)
        excess = self._excess(T, kinematics, self.line.tau)
        self.at = self._point(free, T, self.line.cost, kinematics, excess, held)
        path = np.zeros_like(self.at.path_values.ratios.value)
        self.multipliers = _Multipliers(multiplier, path, len(self.at.violation))
        if program.has_clearance:
            # what is gained behind an obstacle must not pay for the way through it
            self.multipliers.penalty[-path.shape[1] :] = CLEARANCE_PENALTY

    def solve(self) -> Result:
        """Iterate until no step promises a further, or enough, decrease; or none is found; or the
        deadline passes.
        """
        status, stationarity, iterations, relaxed = SqpStatus.STALLED, np.inf, 0, 0
        last = length = np.inf
        for iterations in range(1, MAX_ITERATIONS + 1):
            if self.deadline.passed:
                status = SqpStatus.OUT_OF_TIME
                break
            qp = self._qp_inputs()
            feasible = float(self.at.violation.max()) < FEASIBILITY
            rounds = self._rounds(iterations)
            step = self.qp.solve(qp, rounds, enough=self.progress if feasible else -np.inf)
            if step is None:
                status = SqpStatus.INFEASIBLE
                break
            if step.relaxed:
                relaxed += 1
                if relaxed > MOST_RELAXED and self.p.has_clearance:
                    status = SqpStatus.INFEASIBLE
                    break
            self.multipliers.update(step, self.p, self.at.T, self.cost_scale)
            Hdx, slope = qp.hessian(step.x), float(qp.gradient @ step.x)
            stationarity = float(np.abs(Hdx).max())
            promised = -slope - 0.5 * float(step.x @ Hdx)
            before, length = length, float(np.abs(step.x).max())
            enough = GROWING * self.progress if length > before else self.progress
            if feasible and promised < enough:
                status = SqpStatus.SOLVED
                break
            if feasible and self.line.cost + MOST_DECREASE * slope / self.cost_scale >= self.below:
                status = SqpStatus.COSTLIER
                break
            found = self._line_search(step.x, slope)
            if found is None and rounds < MOST_ROUNDS:
                found = self._exact_step(qp)
            if found is None:
                status = (
                    SqpStatus.SOLVED
                    if feasible and promised < 100 * self.progress
                    else SqpStatus.STALLED
                )
                break
            at_start, self.at = self.at, found
            if (
                not step.relaxed
                and promised <= CONVERGING * last
                and self._kept(promised, at_start)
            ):
                status = SqpStatus.SOLVED
                break
            last = promised
            self.line = self.p.derivatives(found.free, found.T, self.multipliers.torque)
        at, violation = self.at, float(self.at.violation.max())
        return Result(
            status,
            at.free,
            at.T,
            at.cost,
            iterations,
            violation,
            stationarity,
            self.multipliers.torque,
        )

    def _rounds(self, step: int) -> int:
        """How often the QP of a step, from 1 on, is solved at most. Among obstacles, steps of fewer
        rounds stall.
        """
        return MOST_ROUNDS if self.p.has_clearance else QP_ROUNDS[min(step, len(QP_ROUNDS)) - 1]

    def _kept(self, promised: float, before: _Point) -> bool:
        """Whether the last step decreased the cost as promised, so that no further step promises
        enough.

        Among obstacles, and where something is held, the next QP has other constraints.
        """
        if self.p.has_clearance or self.p.held or float(self.at.violation.max()) >= FEASIBILITY:
            return False
        wrong_by = abs((before.cost - self.at.cost) * self.cost_scale - promised)
        allowed = max(ERROR[0] * abs(promised), ERROR[1] * self.progress)
        return promised <= LAST_STEP and wrong_by < min(self.progress / 2, allowed)

    def _exact_step(self, qp: QPInputs) -> _Point | None:
        """The next iterate from a QP of MOST_ROUNDS, after the line search has failed; None if it
        fails again.
        """
        step = self.qp.solve(qp, MOST_ROUNDS)
        if step is None:
            return None
        self.multipliers.update(step, self.p, self.at.T, self.cost_scale)
        return self._line_search(step.x, float(qp.gradient @ step.x))

    def _excess(self, T: float, kinematics: Array, tau: Array) -> Array:
        """The violations (3 r + nq,) of the rates and of the limited torques (N, nq)."""
        largest = np.maximum(kinematics.max(axis=2), -kinematics.min(axis=2)) / self.qp.rates(T)
        torque = np.abs(tau).max(axis=0) / self.p.limits.tau_max
        return np.asarray(np.maximum(np.concatenate([largest.ravel(), torque]) - 1, 0.0))

    def _point(
        self,
        free: Array,
        T: float,
        cost: float,
        kinematics: Array,
        excess: Array,
        held: Passing | Slide | None,
    ) -> _Point:
        """The iterate, from its violations but for those of path constraints."""
        path_values = self.p.path_rows.values(self.p.points(free), T)
        beyond = np.maximum(
            path_values.ratios.value.max(axis=0, initial=0.0) - self.p.path_bounds, 0.0
        )
        return _Point(free, T, cost, kinematics, path_values, np.append(excess, beyond), held)

    def _qp_inputs(self) -> QPInputs:
        """The QP at the iterate: the Lagrangian's Hessian made positive definite, and the cost's
        gradient, scaled.
        """
        at, n = self.at, self.qp.n
        g = self.line.gradient[:n] * self.scale * self.cost_scale
        H = self.line.hessian * self.cost_scale
        if self.p.path is not None:
            H += (
                self.p.path_rows.hessian(at.path_values, at.T, self.multipliers.path)
                * self.cost_scale
            )
        H[-1, -1] += self.multipliers.curvature
        H = H[:n, :n]
        H[-1] *= self.scale[-1]
        H[:, -1] *= self.scale[-1]
        if at.held is None:
            hessian, whitening = whitened(H)
        else:
            pull = (g + self.multipliers.limits)[: self.qp.count].reshape(at.free.shape)
            kept = at.held.null_space(n)
            back = kept.T
            bends, within = whitened(back @ (back @ (H + at.held.curvature(pull, n))).T)
            whitening = kept @ within

            def hessian(x: Array) -> Array:
                return np.asarray(kept @ bends(back @ x))

        rates = self.qp.rates(at.T)
        ratio = at.kinematics / rates[:, :, None]
        return QPInputs(
            hessian, whitening, g, at.free, at.T, self.line, at.path_values, rates, ratio
        )

    def _line_search(self, dx: Array, slope: float) -> _Point | None:
        """The first point along dx (n,), halving the step, that lowers the merit function enough;
        None if none does.

        The merit function is the scaled cost plus the penalties of the violations; `slope` is the
        cost's along dx.
        """
        at, penalty = self.at, self.multipliers.penalty
        merit = self.line.cost * self.cost_scale + float(penalty @ at.violation)
        descent = min(slope - float(penalty @ at.violation), 0.0)
        alpha = 1.0
        for _ in range(BACKTRACKS):
            free = at.free + alpha * dx[: self.qp.count].reshape(at.free.shape)
            T = at.T + alpha * float(dx[-1]) * self.qp.time_scale if self.qp.free_time else at.T
            T = min(max(T, self.p.t_min), self.p.t_max)  # rounding must not leave the bounds
            trial = self._tried(free, T, merit + ARMIJO * alpha * descent + ROUNDING)
            if trial is not None:
                return trial
            alpha *= 0.5
        return None

    def _tried(self, free: Array, T: float, allowed: float) -> _Point | None:
        """The iterate at these variables, put back on what is held; None if its merit function
        exceeds `allowed`.
        """
        held, penalty = self.at.held, self.multipliers.penalty
        if self.holding is not None:
            put = self.holding.put(free, held)  # type: ignore[arg-type]
            if put is None:
                return None
            free, held = put
        (cost, tau), kinematics = self.p.value(free, T), self.p.kinematics(free)
        excess = self._excess(T, kinematics, tau)
        # path constraints take the longest, and never lower the merit function
        if cost * self.cost_scale + float(penalty[: len(excess)] @ excess) > allowed:
            return None
        trial = self._point(free, T, cost, kinematics, excess, held)
        return (
            trial if cost * self.cost_scale + float(penalty @ trial.violation) <= allowed else None
        )


def _holding(program: NonlinearProgram) -> Passes | SlidingEnds | None:
    """What every iterate of the program is put on."""
    if not program.held:
        return None
    return SlidingEnds(program) if program.passes is None else Passes(program, program.passes)


def solve(
    program: NonlinearProgram,
    free: Array,
    duration: float,
    multiplier: Array | None = None,
    deadline: Deadline = NEVER,
    progress: float = PROGRESS,
    below: float = np.inf,
) -> Result:
    """Minimise the cost of an NLP from an initial guess: free control points (m, r), duration [s],
    multipliers (N, nq).

    Without `multiplier` the torque multipliers start at zero. Once `deadline` passes, the last
    iterate is returned. The solve ends when a step promises less than the relative decrease
    `progress`, or when the iterate is feasible and the cost is not expected to come below `below`
    [J].
    """
    duration = min(max(duration, program.t_min), program.t_max)
    return _Solver(program, free, duration, multiplier, deadline, progress, below).solve()
