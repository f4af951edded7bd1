"""The NLP of one candidate: a B-spline between two configurations, its cost and its limits.

Decision variables are the free control points s (m, r) and the duration T. The spline runs in
coordinates s ∈ R^r with q = origin + directions · s: the joints themselves (r = nq) for a B-spline
motion, or the fraction of the straight line (r = 1) for a time-scaled one. At a node τ of [0, 1]

    q = s(τ),  v = s'(τ) / T,  a = s''(τ) / T²,       cost = T Σ_k w_k ℓ(q_k, v_k, a_k).

Limits on speed, acceleration and jerk read |s^(d)(τ)| ≤ limit_d · T^d. They are linear in s, and
T^d is convex: the linear model of such a constraint is never looser than the constraint, so a step
within the model is within the limit.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.collision.clearance_constraint import CLEARANCE
from joulepath.optimizer.dynamics.kernel import Kernel
from joulepath.optimizer.kinematics.held_pose import HeldPose
from joulepath.optimizer.kinematics.path_constraints import PathConstraints
from joulepath.optimizer.motion.bspline import Basis
from joulepath.optimizer.solve.nlp.active_path_constraints import Index, PathConstraintRows
from joulepath.optimizer.solve.nlp.coordinates import Coordinates, GoalConstraints
from joulepath.optimizer.solve.nlp.goal_holding import GoalHolding
from joulepath.optimizer.solve.nlp.node_hessian import NodeStates, Overlaps

# an NLP counts as feasible if no constraint exceeds its limit by more than this ratio
FEASIBILITY = 1e-4


@dataclass(frozen=True)
class Linearisation:
    """Value and derivatives of an NLP at one point x = (free control points row by row, T)."""

    cost: float
    """Cost [J]."""

    gradient: Array
    """Gradient of the cost, shape (n,)."""

    hessian: Array
    """Hessian of cost + multiplier · tau, shape (n, n)."""

    tau: Array
    """Limited torques, shape (N, nq) [N·m]."""

    jacobian: Array
    """∂tau/∂(s, v, a), shape (N, nq, 3, r)."""

    rate: Array
    """∂(s, v, a)/∂T, shape (N, 3, r)."""


@dataclass(frozen=True)
class NonlinearProgram:
    """The NLP of one candidate."""

    kernel: Kernel
    """Dynamics and cost at a node."""

    basis: Basis
    """Spline space."""

    p: Array
    """Packed parameters of the kernel."""

    coordinates: Coordinates
    """Coordinates of the spline."""

    t_min: float
    """Smallest duration [s]."""

    t_max: float
    """Largest duration [s]; equal to `t_min` for a fixed duration."""

    constant: float = 0.0
    """Constant part of the cost, which keeps its relative changes in proportion [J]."""

    goal_constraints: GoalConstraints | None = None
    """Constraints of a free goal, which is the last row of the free control points."""

    start_curve: HeldPose | None = None
    """Curve along which the start slides: the first row of the free control points."""

    goal_curve: HeldPose | None = None
    """Curve along which the goal slides: the last row of the free control points."""

    goal_holding: GoalHolding | None = None
    """Energy of waiting at a goal that is a decision variable."""

    path: PathConstraints | None = None
    """Path constraints, as ratios."""

    path_bounds: Array = field(default_factory=lambda: np.zeros(0))
    """Bounds of these ratios, 1 or slightly less, shape (c,)."""

    passes: Array | None = None
    """Configurations that the spline passes through in order, at free times, shape (k, r)."""

    @cached_property
    def r(self) -> int:
        """Number of the spline's coordinates."""
        return self.coordinates.r

    @property
    def limits(self) -> Limits:
        """Limits of the spline's coordinates."""
        return self.coordinates.limits

    @cached_property
    def free_count(self) -> int:
        """Number of free control points, including ends that are decision variables."""
        return self.basis.n - 2 * self.basis.resting + self.free_start + self.free_goal

    @property
    def free_start(self) -> bool:
        """Whether the start is a decision variable."""
        return self.start_curve is not None

    @property
    def free_goal(self) -> bool:
        """Whether the goal is a decision variable."""
        return self.goal_constraints is not None or self.goal_curve is not None

    @property
    def has_equations(self) -> bool:
        """Whether every iterate meets equations of passes or of sliding ends."""
        return not (self.passes is None and self.start_curve is None and self.goal_curve is None)

    @cached_property
    def _full_space(self) -> bool:
        return self.r == self.kernel.nq

    @cached_property
    def has_clearance(self) -> bool:
        """Whether some of the path constraints are clearances."""
        return self.path is not None and CLEARANCE in self.path.names

    def points(self, free: Array) -> Array:
        """All control points (n, r), from the free ones (m, r)."""
        start, goal = self._ends
        resting = self.basis.resting
        if self.free_start:
            start, free = np.tile(free[0], (resting, 1)), free[1:]
        if self.free_goal:
            goal, free = np.tile(free[-1], (resting, 1)), free[:-1]
        return np.concatenate([start, free, goal])

    @cached_property
    def _ends(self) -> tuple[Array, Array]:
        """Resting control points at the start and at the goal of the coordinates."""
        ends = np.ones((self.basis.resting, 1))
        return ends * self.coordinates.start, ends * self.coordinates.goal

    def free_columns(self, matrix: Array) -> Array:
        """Columns (…, m) of a basis matrix (…, n) of the free control points."""
        inner = matrix[..., self.basis.free]
        parts, resting = [inner], self.basis.resting
        if self.free_start:
            parts.insert(0, matrix[..., :resting].sum(axis=-1, keepdims=True))
        if self.free_goal:
            parts.append(matrix[..., -resting:].sum(axis=-1, keepdims=True))
        return np.ascontiguousarray(np.concatenate(parts, axis=-1))

    def free_points(self, points: Array) -> Array:
        """Free control points (m, r), from all control points (n, r)."""
        first = self.basis.resting - self.free_start
        return points[first : len(points) - self.basis.resting + self.free_goal]

    def joint_points(self, free: Array) -> Array:
        """Control points (n, nq) [rad] of q, from the free control points (m, r)."""
        return self.coordinates.to_joints(self.points(free))

    def _states(self, free: Array, T: float) -> tuple[Array, Array]:
        """s, v, a in the spline's coordinates (N, 3, r), and q, v, a of the joints (N, 3 nq)."""
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
        """Cost [J] and limited torques (N, nq)."""
        _, y = self._states(free, T)
        cost, tau = self.kernel.value(y, self.p)
        total = self.constant + T * float(self.basis.weights @ cost)
        if self.goal_holding is not None and self.free_goal:
            total += self.goal_holding.value(free[-1], T)
        return total, tau

    def derivatives(self, free: Array, T: float, multiplier: Array) -> Linearisation:
        """Cost and torques with derivatives; the Hessian has torques times multipliers (N, nq)."""
        z, y = self._states(free, T)
        count, nq, r = len(y), self.kernel.nq, self.r
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
        wG = (w[:, None, None] * G).reshape(count * 3, r)
        gradient_s = T * (D.reshape(count * 3, -1).T @ wG)
        weighted_torque = (multiplier[:, None, :] @ J.reshape(count, nq, 3 * r)).reshape(
            count, 3, r
        )
        lagrangian = T * w[:, None, None] * G + weighted_torque
        line = Linearisation(
            cost=self.constant + T * total,
            gradient=np.append(gradient_s.ravel(), total + T * slope),
            hessian=NodeStates(T, z, D, rate, lagrangian, H, scale).hessian(
                self._overlaps, gradient_s, slope
            ),
            tau=tau,
            jacobian=J,
            rate=rate,
        )
        return (
            line
            if self.goal_holding is None or not self.free_goal
            else self._held(line, free[-1], T)
        )

    def _held(self, line: Linearisation, goal: Array, T: float) -> Linearisation:
        """The linearisation, with the energy of holding the arm at the goal (r,)."""
        assert self.goal_holding is not None
        cost, first, second = self.goal_holding.derivatives(goal, T)
        gradient, hessian, own = line.gradient.copy(), line.hessian.copy(), slice(-len(first), None)
        gradient[own] += first
        hessian[own, own] += second
        return replace(line, cost=line.cost + cost, gradient=gradient, hessian=hessian)

    @cached_property
    def _nodes_free(self) -> Array:
        """Basis functions of the free control points and derivatives at the nodes, (N, 3, m)."""
        return np.ascontiguousarray(self.free_columns(self.basis.at_nodes).transpose(1, 0, 2))

    @cached_property
    def _overlaps(self) -> Overlaps:
        return Overlaps.of(self._nodes_free)

    def torque_rows(self, line: Linearisation, T: float, k: Index, j: Index) -> Array:
        """Gradients (rows, n) of the torques of joints j at nodes k with respect to x."""
        J = line.jacobian[k, j]
        scale = np.array([1.0, 1.0 / T, 1.0 / (T * T)])
        by_points = np.einsum("kdm,kdr->kmr", self._nodes_free[k] * scale[:, None], J)
        by_time = np.einsum("kdr,kdr->k", J, line.rate[k])
        return np.hstack([by_points.reshape(len(k), self.free_count * self.r), by_time[:, None]])

    def kinematics(self, free: Array) -> Array:
        """First to third derivative of s by τ on the fine grid, (3, r, M)."""
        return np.asarray(self.points(free).T @ self.basis.at_grid.swapaxes(1, 2))

    @cached_property
    def path_rows(self) -> PathConstraintRows:
        """The path constraints at the path points of the basis."""
        # without constraints the basis need not be evaluated there
        at_path = np.zeros((2, 0, self.basis.n)) if self.path is None else self.basis.at_path
        at_path_free = np.ascontiguousarray(self.free_columns(at_path))
        return PathConstraintRows(
            self.path, self.path_bounds, self.coordinates, at_path, at_path_free
        )
