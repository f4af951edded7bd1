"""Sequential quadratic programming on the NLP of one candidate: iteration and line search.

A dense SQP with exact Hessians. Each step solves a QP over the constraints near their limits (see
`working_set_qp`). An L1 merit function with backtracking makes the SQP converge from any initial
guess.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg.lapack import dpotrf, dtrtri

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import NEVER, Deadline
from joulepath.optimizer.solve.nlp.convex_quadratic import CONVEXITY, definite_correction
from joulepath.optimizer.solve.nlp.nonlinear_program import FEASIBILITY, NonlinearProgram
from joulepath.optimizer.solve.nlp.passing import Passes, Passing
from joulepath.optimizer.solve.nlp.qp_data import QPInputs
from joulepath.optimizer.solve.nlp.sliding_ends import Slide, SlidingEnds
from joulepath.optimizer.solve.nlp.sqp_state import SQP, Iterate, Multipliers, SqpResult, SqpStatus
from joulepath.optimizer.solve.nlp.working_set_qp import WORKING_SET, WorkingSetQP


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
        self.equations = _equations_of(program)
        equations: Passing | Slide | None = None
        if self.equations is not None:
            put = self.equations.put(free)
            if put is None:
                raise ValueError("an end of the initial guess is not near its curve")
            free, equations = put
        self.line, kinematics = program.derivatives(free, T, multiplier), program.kinematics(free)
        self.cost_scale = 1.0 / max(abs(self.line.cost), 1e-9)
        excess = self._excess(T, kinematics, self.line.tau)
        self.at = self._point(free, T, self.line.cost, kinematics, excess, equations)
        path = np.zeros_like(self.at.path_values.ratios.value)
        self.multipliers = Multipliers(multiplier, path, len(self.at.violation))
        if program.has_clearance:
            self.multipliers.penalty[-path.shape[1] :] = SQP.clearance_penalty

    def solve(self) -> SqpResult:
        """Iterate to convergence, failure, or the deadline."""
        settings = SQP
        status, stationarity, iterations, relaxed = SqpStatus.STALLED, np.inf, 0, 0
        last = length = np.inf
        for iterations in range(1, settings.max_iterations + 1):
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
                if relaxed > settings.max_relaxed_steps and self.p.has_clearance:
                    status = SqpStatus.INFEASIBLE
                    break
            self.multipliers.update(step, self.p, self.at.T, self.cost_scale)
            Hdx, slope = qp.hessian(step.x), float(qp.gradient @ step.x)
            stationarity = float(np.abs(Hdx).max())
            promised = -slope - 0.5 * float(step.x @ Hdx)
            before, length = length, float(np.abs(step.x).max())
            enough = settings.growing_share * self.progress if length > before else self.progress
            if feasible and promised < enough:
                status = SqpStatus.SOLVED
                break
            expected = self.line.cost + settings.optimism * slope / self.cost_scale
            if feasible and expected >= self.below:
                status = SqpStatus.COSTLIER
                break
            found = self._line_search(step.x, slope)
            if found is None and rounds < WORKING_SET.max_rounds:
                found = self._exact_step(qp)
            if found is None:
                is_small = promised < settings.stalled_multiple * self.progress
                status = SqpStatus.SOLVED if feasible and is_small else SqpStatus.STALLED
                break
            at_start, self.at = self.at, found
            converging = not step.relaxed and promised <= settings.contraction * last
            if converging and self._kept(promised, at_start):
                status = SqpStatus.SOLVED
                break
            last = promised
            self.line = self.p.derivatives(found.free, found.T, self.multipliers.torque)
        at, violation = self.at, float(self.at.violation.max())
        return SqpResult(
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
        """Largest number of solves of the QP of a step, counted from 1.

        Among obstacles, steps of fewer rounds stall.
        """
        if self.p.has_clearance:
            return WORKING_SET.max_rounds
        rounds = WORKING_SET.rounds
        return rounds[min(step, len(rounds)) - 1]

    def _kept(self, promised: float, before: Iterate) -> bool:
        """Whether the last step kept its promise: then no further step promises enough.

        Through passes, the promise is unreliable.
        """
        if self.p.passes is not None or float(self.at.violation.max()) >= FEASIBILITY:
            return False
        wrong_by = abs((before.cost - self.at.cost) * self.cost_scale - promised)
        allowed = max(SQP.promise_error * abs(promised), SQP.progress_error * self.progress)
        return promised <= SQP.last_step and wrong_by < min(self.progress / 2, allowed)

    def _exact_step(self, qp: QPInputs) -> Iterate | None:
        """The next iterate from a QP with all constraints; None if its line search fails too."""
        step = self.qp.solve(qp, WORKING_SET.max_rounds)
        if step is None:
            return None
        self.multipliers.update(step, self.p, self.at.T, self.cost_scale)
        return self._line_search(step.x, float(qp.gradient @ step.x))

    def _excess(self, T: float, kinematics: Array, tau: Array) -> Array:
        """Violations (3 r + nq,) of rates and limited torques (N, nq)."""
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
        equations: Passing | Slide | None,
    ) -> Iterate:
        """The iterate, with its path constraints; `excess` are the other violations."""
        path_values = self.p.path_rows.values(self.p.points(free), T)
        beyond = np.maximum(
            path_values.ratios.value.max(axis=0, initial=0.0) - self.p.path_bounds, 0.0
        )
        return Iterate(free, T, cost, kinematics, path_values, np.append(excess, beyond), equations)

    def _qp_inputs(self) -> QPInputs:
        """The QP at the iterate, with the Lagrangian's Hessian made positive definite."""
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
        if at.equations is None:
            hessian, whitening = whitened(H)
        else:
            pull = (g + self.multipliers.constraint_gradient)[: self.qp.count].reshape(
                at.free.shape
            )
            kept = at.equations.null_space(n)
            back = kept.T
            bends, within = whitened(back @ (back @ (H + at.equations.curvature(pull, n))).T)
            whitening = kept @ within

            def hessian(x: Array) -> Array:
                return np.asarray(kept @ bends(back @ x))

        rates = self.qp.rates(at.T)
        ratio = at.kinematics / rates[:, :, None]
        return QPInputs(
            hessian, whitening, g, at.free, at.T, self.line, at.path_values, rates, ratio
        )

    def _line_search(self, dx: Array, slope: float) -> Iterate | None:
        """Halve a step until the merit function falls enough.

        The merit function is the scaled cost plus the penalties of the violations.

        Args:
            dx: the step, shape (n,).
            slope: slope of the scaled cost along the step.

        Returns:
            The next iterate; None if the merit function does not fall enough.
        """
        at, penalty = self.at, self.multipliers.penalty
        merit = self.line.cost * self.cost_scale + float(penalty @ at.violation)
        descent = min(slope - float(penalty @ at.violation), 0.0)
        alpha = 1.0
        for _ in range(SQP.max_backtracks):
            free = at.free + alpha * dx[: self.qp.count].reshape(at.free.shape)
            T = at.T + alpha * float(dx[-1]) * self.qp.time_scale if self.qp.free_time else at.T
            T = min(max(T, self.p.t_min), self.p.t_max)  # rounding must not leave the bounds
            trial = self._tried(free, T, merit + SQP.armijo * alpha * descent + SQP.merit_rounding)
            if trial is not None:
                return trial
            alpha *= 0.5
        return None

    def _tried(self, free: Array, T: float, allowed: float) -> Iterate | None:
        """The iterate at trial variables, put back on its passes or curves.

        None if the merit function exceeds `allowed`, or an end finds no place on its curve.
        """
        equations, penalty = self.at.equations, self.multipliers.penalty
        if self.equations is not None:
            put = self.equations.put(free, equations)  # type: ignore[arg-type]
            if put is None:
                return None
            free, equations = put
        (cost, tau), kinematics = self.p.value(free, T), self.p.kinematics(free)
        excess = self._excess(T, kinematics, tau)
        # path constraints take the longest, and never lower the merit function
        if cost * self.cost_scale + float(penalty[: len(excess)] @ excess) > allowed:
            return None
        trial = self._point(free, T, cost, kinematics, excess, equations)
        return (
            trial if cost * self.cost_scale + float(penalty @ trial.violation) <= allowed else None
        )


def _equations_of(program: NonlinearProgram) -> Passes | SlidingEnds | None:
    """Passes or sliding ends that every iterate is put on; None without such equations."""
    if not program.has_equations:
        return None
    return SlidingEnds(program) if program.passes is None else Passes(program, program.passes)


def solve(
    program: NonlinearProgram,
    free: Array,
    duration: float,
    multiplier: Array | None = None,
    deadline: Deadline = NEVER,
    progress: float = SQP.progress,
    below: float = np.inf,
) -> SqpResult:
    """Minimise the cost of an NLP from an initial guess.

    Args:
        program: the NLP.
        free: free control points, shape (m, r).
        duration: duration [s].
        multiplier: torque multipliers, shape (N, nq); None for zero.
        deadline: when the solve ends with its last iterate.
        progress: relative decrease of the cost that a further step must promise.
        below: cost that a feasible iterate must be expected to come below [J].

    Returns:
        The last iterate.
    """
    duration = min(max(duration, program.t_min), program.t_max)
    return _Solver(program, free, duration, multiplier, deadline, progress, below).solve()


def whitened(H: Array, full_above: int = 150) -> tuple[Callable[[Array], Array], Array]:
    """Product with a symmetric matrix H, and a matrix W with Wᵀ H W = 1.

    If H is not positive definite, its eigenvalues are replaced by their absolute values, clamped
    from below.

    Args:
        H: the matrix, shape (n, n).
        full_above: number of variables n above which all eigenvalues are found: faster there than
            the negative and small eigenvalues alone.

    Returns:
        The product with a vector (n,) as a function, and W (n, n).
    """
    # LAPACK takes columns first
    L, failed = dpotrf(H.T, lower=1)
    if failed and len(H) > full_above:
        values, vectors = np.linalg.eigh(H)
        floor = CONVEXITY.eigenvalue_floor * max(1.0, float(np.abs(values).max()))
        kept = np.maximum(np.abs(values), floor)
        return lambda x: vectors @ (kept * (vectors.T @ x)), vectors / np.sqrt(kept)
    if failed:
        # the row sums bound all eigenvalues
        H = H + definite_correction(H, float(np.abs(H).sum(axis=0).max()))
        L, _ = dpotrf(H.T, lower=1)
    return H.dot, np.ascontiguousarray(dtrtri(L, lower=1)[0].T)
