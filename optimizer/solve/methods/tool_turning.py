"""Turning of a tool about the free axis of its path: the angle along the path of least cost.

First, dynamic programming over a surface of IK solutions, in which a step costs the power drawn at
constant speed. Then the values of a smooth turning are optimised for the cost of the whole motion
with a given time law (L-BFGS).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.dynamics.bus_flow import drawn_at
from joulepath.optimizer.dynamics.limited_torque import limited_torque
from joulepath.optimizer.dynamics.losses import power_flow
from joulepath.optimizer.kinematics import newton
from joulepath.optimizer.kinematics.tcp import flange_pose
from joulepath.optimizer.kinematics.tool_path.course_tracing import (
    Trace,
    chain_of,
    traces,
    turned_start,
    within,
)
from joulepath.optimizer.kinematics.tool_path.joint_path import joint_path
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.kinematics.tool_path.turning_grid import (
    TURNING_GRID,
    TurningGrid,
    turning_of,
    turning_through,
    values_of,
)
from joulepath.optimizer.motion.quadrature import simpson_weights
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.targets import Side


@dataclass(frozen=True)
class ToolTurningSettings:
    """Settings of the search for a turning."""

    knots: int = 10
    """Values of a smooth turning, including its ends."""

    instants: int = 81
    """Instants at which the cost of a turning is evaluated; odd, for Simpson's rule."""

    grid_steps: int = 17
    """Points of the dynamic programming along the path."""

    grid_steps_per_bend: int = 6
    """Further points per bend of the path."""

    difference: float = 1e-5
    """Step of the difference quotients [rad]."""

    max_iterations: int = 25
    """Largest number of iterations of L-BFGS."""

    progress: float = 1e-4
    """Relative decrease of the cost in an iteration below which L-BFGS ends."""

    excess_cost: float = 10.0
    """Relative increase of the power for a limit exceeded by 100 %."""

    same_configuration: float = 1e-6
    """Distance up to which a turning ends in the goal configuration [rad]."""

    newton_steps: int = 20
    """Largest number of Newton steps of the inverse kinematics at an instant."""

    missing_cost: float = 1e3
    """Relative cost of a turning that the arm cannot follow."""


TOOL_TURNING = ToolTurningSettings()


def turned_paths(
    prepared: PreparedProblem,
    q_start: Array,
    q_goal: Array,
    t: Array,
    s: Array,
    hold_goal: bool = False,
) -> Iterator[tuple[Trace, Spline]]:
    """Paths with turnings of the tool that are expected to cost less, the better one last.

    At a free end of the course, the turnings may have any angle.

    Args:
        prepared: the problem.
        q_start: start configuration, shape (nq,) [rad].
        q_goal: goal configuration, shape (nq,) [rad].
        t: times of a motion, shape (k,) [s].
        s: fractions of the course at these times, shape (k,).
        hold_goal: whether the turnings end in q_goal even at a free end.

    Yields:
        Trace and joint path of a turning.
    """
    assert prepared.course is not None
    free_end = prepared.course.free_end and not hold_goal
    law = _TimeLaw(prepared, replace(prepared.course, free_end=free_end), q_start, s, t)
    known = _known(prepared, q_start)
    wanted, coarse = None if law.course.free_end else q_goal, law.coarse()
    for turning in (coarse, law.refined(coarse or known)):
        followed = None if turning is None else _followed(prepared, q_start, wanted, turning)
        if followed is not None:
            yield followed


class TurnedAtEnd:
    """Paths with another angle of the tool at a free end of the course.

    The angle changes linearly along the path, in addition to the present turning.

    Args:
        prepared: the problem.
        q_start: start configuration, shape (nq,) [rad].
        q_goal: goal configuration, shape (nq,) [rad].
        side: the free end.
    """

    def __init__(
        self, prepared: PreparedProblem, q_start: Array, q_goal: Array, side: Side
    ) -> None:
        assert prepared.course is not None
        self.prepared, self.q_start, self.known = prepared, q_start, _known(prepared, q_start)
        self.free = prepared.course.free_end, prepared.course.free_start
        self.q_goal, self.side = None if prepared.course.free_end else q_goal, side

    def by(self, angle: float) -> tuple[Trace, Spline] | None:
        """Trace and joint path at an angle [rad] to the present one; None if infeasible."""
        x = self.known.x
        angles = self.known(x) + angle * (x if self.side == "goal" else 1 - x)
        turning = turning_of(values_of(angles, *self.free), *self.free)
        return _followed(self.prepared, self.q_start, self.q_goal, turning)


def _known(prepared: PreparedProblem, q_start: Array) -> CubicSpline:
    """The present turning along the course from q_start (nq,) [rad]."""
    assert prepared.course is not None
    free = prepared.course.free_end, prepared.course.free_start
    known = prepared.followed.known_trace(q_start)
    assert known is not None
    return known.turning or turning_of(np.zeros(TOOL_TURNING.knots - 2 + sum(free)), *free)


def _followed(
    prepared: PreparedProblem, q_start: Array, q_goal: Array | None, turning: CubicSpline
) -> tuple[Trace, Spline] | None:
    """Trace and joint path of a turning.

    Args:
        prepared: the problem.
        q_start: start configuration, shape (nq,) [rad]; from a free start, the tool first turns
            there.
        q_goal: goal configuration, shape (nq,) [rad]; None for any.
        turning: angle of the tool along the course.

    Returns:
        Trace and path; None if the arm cannot follow the turning, or ends elsewhere.
    """
    assert prepared.course is not None
    course, limits = replace(prepared.course, turning=turning), prepared.arm.active_limits
    first = _first_of(prepared, q_start, turning)
    if first is None:
        return None
    (trace,) = traces(prepared.arm, course, first[None])
    trace = replace(trace, turning=turning)
    leads_there = (
        q_goal is None or np.abs(trace.q[-1] - q_goal).max() < TOOL_TURNING.same_configuration
    )
    if (
        trace.obstacle is not None
        or not leads_there
        or not within(trace, limits.q_min, limits.q_max)
    ):
        return None
    path = joint_path(prepared.arm, course, trace)
    return None if path is None else (trace, path)


def _first_of(prepared: PreparedProblem, q_start: Array, turning: CubicSpline) -> Array | None:
    """First configuration (nq,) [rad] of a turning, near q_start (nq,); None if unreachable."""
    assert prepared.course is not None
    if not prepared.course.free_start:
        return q_start
    before = float(_known(prepared, q_start)(0.0))
    return turned_start(prepared.arm, prepared.course, q_start, before, float(turning(0.0)))


class _TimeLaw:
    """A course with a time law: fractions s (k,) of the course at times t (k,) [s]."""

    def __init__(
        self, prepared: PreparedProblem, course: ToolCourse, q_start: Array, s: Array, t: Array
    ) -> None:
        self.prepared, self.course, self.q_start = prepared, course, q_start
        self.chain = chain_of(prepared.arm.robot)
        self.s, self.t = s, t
        self.times = np.linspace(0.0, t[-1], TOOL_TURNING.instants)
        self.at = np.interp(self.times, t, s)
        self.weights = simpson_weights(self.times)
        self.poses = self.course.poses(self.at)

    def coarse(self) -> CubicSpline | None:
        """Turning of least cost by dynamic programming; None if no other turning is better."""
        free = self.course.free_end, self.course.free_start
        most = min(
            float(
                self.prepared.arm.active_limits.v_max.max() * self.t[-1] / (1 if any(free) else 2)
            ),
            np.pi,
        )
        settings = TOOL_TURNING
        steps = settings.grid_steps + settings.grid_steps_per_bend * self.course.shape.bends
        turned = float(_known(self.prepared, self.q_start)(0.0))
        grid = TurningGrid.of(
            self.prepared.arm, self.chain, self.course, self.q_start, steps, most, turned
        )
        grid = grid.without(self._excluded)
        lengths = np.diff(np.interp(grid.at, self.s, self.t))

        def cost(first: Array, second: Array, k: npt.NDArray[np.intp]) -> Array:
            v = (second - first) / np.maximum(lengths[k], 1e-9)[:, None]
            return lengths[k] * self._drawn((first + second) / 2, v, np.zeros_like(v))

        chosen = grid.least(cost, *free)
        if chosen is None or (not self.course.free_start and (chosen == chosen[0]).all()):
            return None
        return turning_through(grid.at, grid.angles[chosen], settings.knots, *free)

    def refined(self, turning: CubicSpline) -> CubicSpline:
        """Locally optimal turning for this time law, from another turning."""
        settings = TOOL_TURNING
        free = self.course.free_end, self.course.free_start
        values, near = values_of(turning(turning.x), *free), self._first(turning)
        q = None if near is None else self._configurations(values[None], near)[0]
        if q is None or not np.isfinite(q).all():
            return turning
        first = max(abs(float(self._costs(q[None])[0])), 1e-9)
        best = [q]

        def cost(x: Array) -> tuple[float, Array]:
            checkpoint()
            beside = x + settings.difference * np.eye(len(x))
            tried = self._configurations(np.vstack([x, beside]), best[0])
            if not np.isfinite(tried).all():
                return settings.missing_cost, np.zeros(len(x))
            values = self._costs(tried) / first
            best[0] = tried[0]
            return float(values[0]), (values[1:] - values[0]) / settings.difference

        found = minimize(
            cost,
            values,
            jac=True,
            method="L-BFGS-B",
            options={"maxiter": settings.max_iterations, "ftol": settings.progress},
        )
        return turning_of(np.asarray(found.x, dtype=float), *free)

    def _first(self, turning: CubicSpline) -> Array | None:
        """Configurations (instants, nq) [rad] of a turning; None if its start is unreachable."""
        first = _first_of(self.prepared, self.q_start, turning)
        if first is None:
            return None
        (trace,) = traces(self.prepared.arm, replace(self.course, turning=turning), first[None])
        return np.stack([np.interp(self.at, trace.at, q) for q in trace.q.T], axis=1)

    def _configurations(self, values: Array, near: Array) -> Array:
        """Configurations of turnings by inverse kinematics.

        Args:
            values: values of the turnings, shape (n, k).
            near: configurations to start from, shape (instants, nq) [rad].

        Returns:
            Configurations, shape (n, instants, nq) [rad]; NaN if unreachable.
        """
        count, nq = len(values), near.shape[1]
        free = self.course.free_end, self.course.free_start
        angles = np.concatenate([turning_of(each, *free)(self.at) for each in values])
        T = flange_pose(
            self.course.turned(np.tile(self.poses, (count, 1, 1)), angles),
            self.prepared.arm.T_flange_tcp,
        )
        guess = np.tile(near, (count, 1))
        q, missed = newton.solved(self.chain, guess, T, steps=TOOL_TURNING.newton_steps)
        q[missed > TURNING_GRID.reached] = np.nan
        return q.reshape(count, TOOL_TURNING.instants, nq)

    def _costs(self, q: Array) -> Array:
        """Costs (n,) [J] of motions q (n, instants, nq) [rad] with this time law."""
        spline = CubicSpline(self.times, q, axis=1, bc_type="clamped")
        v, a = (spline(self.times, d).reshape(-1, q.shape[2]) for d in (1, 2))
        drawn = self._drawn(q.reshape(v.shape), v, a, soft=True)
        return np.asarray(drawn.reshape(len(q), TOOL_TURNING.instants) @ self.weights)

    def _drawn(self, q: Array, v: Array, a: Array, soft: bool = False) -> Array:
        """Power (n,) [W] at states (n, nq).

        A state beyond a limit has a higher power if `soft`, else an infinite power.
        """
        arm = self.prepared.arm
        limits = self.prepared.arm.active_limits
        tau = self.prepared.torques(q, v, a)
        if self.prepared.problem.objective == "mechanical":
            cost = np.abs(tau * v).sum(axis=1)
        else:
            joints = power_flow(tau, v, a, arm.drives, arm.friction_law).joints
            cost = drawn_at(arm.bus, arm.regeneration, arm.base_power, joints, np.zeros(len(q)))
        ratios = [np.abs(v) / limits.v_max, np.abs(limited_torque(arm, tau, v, a)) / limits.tau_max]
        if soft:
            ratios += [np.abs(a) / limits.a_max]
        over = np.maximum(np.hstack(ratios).max(axis=1) - 1, 0.0)
        return (
            np.asarray(cost + TOOL_TURNING.excess_cost * np.abs(cost) * over)
            if soft
            else np.where(over > 0, np.inf, cost)
        )

    def _excluded(self, q: Array) -> Mask:
        """Mask (n,) of configurations (n, nq) beyond their position limits, or colliding."""
        limits, arm = self.prepared.arm.active_limits, self.prepared.arm
        outside = ((q < limits.q_min) | (q > limits.q_max)).any(axis=1)
        if not (arm.collisions and len(self.prepared.surroundings.model.pairs)):
            return np.asarray(outside)
        hits = [
            each.distance < 0
            for each in self.prepared.surroundings.model.closest_pairs(q, within=0.0)
        ]
        return np.asarray(outside | np.array(hits))
