"""State of the SQP: settings, result, iterate, and multipliers."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.solve.nlp.active_path_constraints import PathConstraintValues
from joulepath.optimizer.solve.nlp.nonlinear_program import FEASIBILITY, NonlinearProgram
from joulepath.optimizer.solve.nlp.passing import Passing
from joulepath.optimizer.solve.nlp.qp_data import QPStep
from joulepath.optimizer.solve.nlp.sliding_ends import Slide


@dataclass(frozen=True)
class SqpSettings:
    """Settings of the SQP."""

    progress: float = 5e-5
    """Relative decrease of the cost that a further step must promise."""

    max_iterations: int = 60
    """Largest number of iterations."""

    max_backtracks: int = 14
    """Largest number of trial points of a line search."""

    max_relaxed_steps: int = 4
    """Steps of a relaxed QP after which a solve with clearance constraints ends: the way out of an
    obstacle is short."""

    armijo: float = 1e-4
    """Share of the decrease promised by the gradient that a line search must reach."""

    merit_rounding: float = 1e-12
    """Rounding error of the scaled merit function."""

    optimism: float = 3.0
    """Multiple of the decrease promised by the gradient that a solve is trusted to reach: the solve
    ends if even this leaves the cost above its bound. With 2, one of 200 random requests missed a
    better motion, by 0.6 %; with 3, none did."""

    last_step: float = 5e-3
    """Relative decrease promised by a step up to which it may be the last step, if it keeps its
    promise. The next QP promises about as much as this one was wrong by."""

    promise_error: float = 0.02
    """Error of a kept promise, relative to the promise. With greater errors, one of 50 random
    requests ended 0.1 % too high."""

    progress_error: float = 0.1
    """Error of a kept promise, relative to `progress`; the larger of both errors counts."""

    contraction: float = 0.5
    """Ratio of successive promises up to which a step may be the last: mechanical work has flat
    valleys, along which each step promises about as much as the one before."""

    growing_share: float = 0.5
    """Share of `progress` that a step longer than the one before must promise: growing steps lead
    away from a saddle, beyond which the cost falls by more than promised. One of 100 random
    requests ended 1 % too high."""

    stalled_multiple: float = 100.0
    """Multiple of `progress` up to which a promised step whose line search fails ends a solve as
    converged."""

    first_penalty: float = 0.1
    """Penalty of a violation before any multiplier is known."""

    penalty_factor: float = 2.0
    """Least ratio of a penalty to its multipliers."""

    clearance_penalty: float = 3.0
    """First penalty of path constraints with clearances: a gain of cost behind an obstacle must not
    pay for the way through the obstacle."""


SQP = SqpSettings()


class SqpStatus(Enum):
    """Why the SQP ended."""

    SOLVED = "solved"
    """No further step promises enough."""

    INFEASIBLE = "infeasible"
    """A QP has no solution, or too many had to be relaxed among obstacles."""

    STALLED = "stalled"
    """The line search failed."""

    COSTLIER = "costlier"
    """The cost is not expected to come below its bound."""

    OUT_OF_TIME = "out of time"
    """The deadline passed."""


@dataclass(frozen=True)
class SqpResult:
    """The last iterate of the SQP."""

    status: SqpStatus

    free: Array
    """Free control points, shape (m, r)."""

    duration: float
    """Duration [s]."""

    cost: float
    """Cost [J]."""

    iterations: int
    """Number of iterations."""

    violation: float
    """Largest excess of a constraint over its limit, relative to the limit."""

    stationarity: float
    """Largest component of the Lagrangian's gradient at the last step, as a ratio of the cost per
    radian, or per initial duration."""

    multiplier: Array
    """Torque multipliers, shape (N, nq)."""

    @property
    def feasible(self) -> bool:
        """Whether no constraint exceeds its limit by more than FEASIBILITY."""
        return self.violation <= FEASIBILITY


@dataclass(frozen=True)
class Iterate:
    """An iterate of the SQP, with its constraints."""

    free: Array
    """Free control points, shape (m, r)."""

    T: float
    """Duration [s]."""

    cost: float
    """Cost [J]."""

    kinematics: Array
    """First to third derivatives of s by τ on the grid, shape (3, r, M)."""

    path_values: PathConstraintValues
    """Path constraints at the path points."""

    violation: Array
    """Largest excess relative to the limit, shape (3 r + nq + c,): per derivative and coordinate,
    joint torque, and path constraint."""

    equations: Passing | Slide | None
    """Equations of passes or sliding ends at the iterate; None without such equations."""


class Multipliers:
    """Multipliers of the Lagrangian, and the penalties of the merit function."""

    def __init__(self, torque: Array, path: Array, violations: int) -> None:
        self.torque = torque
        self.path = path
        # gradient (n,) of Σ multiplier · constraint by the scaled variables
        self.constraint_gradient: Array | float = 0.0
        # second derivative of the kinematic constraints by T, in the scale of the QP's cost
        self.curvature = 0.0
        self.penalty = np.full(violations, SQP.first_penalty)

    def update(self, step: QPStep, p: NonlinearProgram, T: float, cost_scale: float) -> None:
        """Take the multipliers of a QP's step.

        Args:
            step: solution of the QP.
            p: the NLP.
            T: duration of the iterate [s].
            cost_scale: factor of the cost in the QP [1/J].
        """
        # the multipliers weigh the curvature of torque, and of kinematic limits in T^d
        self.torque = np.zeros_like(self.torque)
        self.torque[step.nodes] = (
            step.signs * step.torque / p.limits.tau_max[step.nodes[1]] / cost_scale
        )
        self.path = np.zeros_like(self.path)
        self.path[step.passed] = step.path / cost_scale
        self.constraint_gradient = step.pull
        d = step.places[0]
        self.curvature = -float((step.kinematic * (d + 1) * d).sum()) / (T * T)
        if not step.relaxed:
            torques, paths = 3 * p.r, 3 * p.r + p.kernel.nq
            which = np.concatenate(
                [d * p.r + step.places[1], torques + step.nodes[1], paths + step.passed[1]]
            )
            multipliers = np.concatenate([step.kinematic, step.torque, step.path])
            need = np.bincount(which, multipliers, len(self.penalty))
            self.penalty = np.maximum(self.penalty, SQP.penalty_factor * need)
