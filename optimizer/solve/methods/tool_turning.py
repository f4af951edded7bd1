"""The turning of a tool about the free axis of its path: the one of least cost for a time law, and
then a better one.

First dynamic programming over the sheet of configurations, in which a step costs what the arm draws
at an even speed. Then the values of a smooth turning are optimised for the cost of the whole motion
with this time law (L-BFGS).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

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
    joint_path,
    traces,
    turned_start,
    within,
)
from joulepath.optimizer.kinematics.tool_path.turning_sheet import (
    REACHED,
    TurningSheet,
    turning_of,
    turning_through,
    values_of,
)
from joulepath.optimizer.motion.quadrature import simpson_weights
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.targets import Side

# values of a smooth turning between and at the ends, and instants at which its cost is measured (an
# odd number)
KNOTS, INSTANTS = 10, 81
# points of the sheet along the way, and more of them for each bend
FIRST_STEPS, BEND_STEPS = 17, 6
# step [rad] of a difference quotient, iterations, and the share by which the cost must fall in each
STEP, ITERATIONS, PROGRESS = 1e-5, 25, 1e-4
# value of an excess of a limit, as a multiple of the first cost: what exceeds one by a tenth costs
# a tenth more
EXCESS = 10.0
# rad: where a turning leads, and where it is to lead
SAME = 1e-6


def turned_paths(
    prepared: PreparedProblem, q_start: Array, q_goal: Array, t: Array, s: Array
) -> Iterator[tuple[Trace, Spline]]:
    """Traces and joint paths of turnings from q_start to q_goal (nq,) [rad] that should need less;
    the better one last.

    If an end of the course is free, they begin or end at any angle there. `s` (k,) are the
    fractions of the course at times t (k,) [s] of a motion.
    """
    law, known = _TimeLaw(prepared, q_start, s, t), _known(prepared, q_start)
    wanted, coarse = None if law.course.free_end else q_goal, law.coarse()
    for turning in (coarse, law.refined(coarse or known)):
        followed = None if turning is None else _followed(prepared, q_start, wanted, turning)
        if followed is not None:
            yield followed


class TurnedAtEnd:
    """Paths from q_start to q_goal (nq,) [rad] that have another angle of the tool at the `side` of
    a course that is free: the tool turns evenly from or to it, beside what it turns now."""

    def __init__(
        self, prepared: PreparedProblem, q_start: Array, q_goal: Array, side: Side
    ) -> None:
        assert prepared.course is not None
        self.prepared, self.q_start, self.known = prepared, q_start, _known(prepared, q_start)
        self.free = prepared.course.free_end, prepared.course.free_start
        self.q_goal, self.side = None if prepared.course.free_end else q_goal, side

    def by(self, angle: float) -> tuple[Trace, Spline] | None:
        """The trace and the joint path at an angle [rad] to the present one; None if the arm cannot
        follow them.
        """
        x = self.known.x
        angles = self.known(x) + angle * (x if self.side == "goal" else 1 - x)
        turning = turning_of(values_of(angles, *self.free), *self.free)
        return _followed(self.prepared, self.q_start, self.q_goal, turning)


def _known(prepared: PreparedProblem, q_start: Array) -> CubicSpline:
    """The turning with which the course is followed from q_start (nq,) [rad]."""
    assert prepared.course is not None
    free = prepared.course.free_end, prepared.course.free_start
    known = prepared.followed.known_trace(q_start)
    assert known is not None
    return known.turning or turning_of(np.zeros(KNOTS - 2 + sum(free)), *free)


def _followed(
    prepared: PreparedProblem, q_start: Array, q_goal: Array | None, turning: CubicSpline
) -> tuple[Trace, Spline] | None:
    """The trace and the joint path of a turning from q_start to q_goal (nq,) [rad]; None if it
    leads elsewhere, or the arm cannot follow it. Without q_goal it may lead anywhere. From a free
    start, it begins where the tool is turned to from q_start."""
    assert prepared.course is not None
    course, limits = replace(prepared.course, turning=turning), prepared.arm.active_limits
    first = _first_of(prepared, q_start, turning)
    if first is None:
        return None
    (trace,) = traces(prepared.arm, course, first[None])
    trace = replace(trace, turning=turning)
    leads_there = q_goal is None or np.abs(trace.q[-1] - q_goal).max() < SAME
    if (
        trace.obstacle is not None
        or not leads_there
        or not within(trace, limits.q_min, limits.q_max)
    ):
        return None
    path = joint_path(prepared.arm, course, trace)
    return None if path is None else (trace, path)


def _first_of(prepared: PreparedProblem, q_start: Array, turning: CubicSpline) -> Array | None:
    """The configuration (nq,) [rad] in which a turning begins, near q_start (nq,); None if there is
    none.
    """
    assert prepared.course is not None
    if not prepared.course.free_start:
        return q_start
    before = float(_known(prepared, q_start)(0.0))
    return turned_start(prepared.arm, prepared.course, q_start, before, float(turning(0.0)))


class _TimeLaw:
    """A course that is gone through in a time law: fractions s (k,) of it at times t (k,) [s]."""

    def __init__(self, prepared: PreparedProblem, q_start: Array, s: Array, t: Array) -> None:
        assert prepared.course is not None
        self.prepared, self.course, self.q_start = prepared, prepared.course, q_start
        self.chain = chain_of(prepared.arm.robot)
        self.s, self.t = s, t
        self.times = np.linspace(0.0, t[-1], INSTANTS)
        self.at = np.interp(self.times, t, s)
        self.weights = simpson_weights(self.times)
        self.poses = self.course.poses(self.at)

    def coarse(self) -> CubicSpline | None:
        """The turning of least cost by dynamic programming; None if there is none but the one
        without a turn.
        """
        free = self.course.free_end, self.course.free_start
        most = min(
            float(
                self.prepared.arm.active_limits.v_max.max() * self.t[-1] / (1 if any(free) else 2)
            ),
            np.pi,
        )
        steps = FIRST_STEPS + BEND_STEPS * self.course.shape.bends
        turned = float(_known(self.prepared, self.q_start)(0.0))
        sheet = TurningSheet.of(
            self.prepared.arm, self.chain, self.course, self.q_start, steps, most, turned
        )
        sheet = sheet.without(self._excluded)
        lengths = np.diff(np.interp(sheet.at, self.s, self.t))

        def cost(first: Array, second: Array, k: npt.NDArray[np.intp]) -> Array:
            v = (second - first) / np.maximum(lengths[k], 1e-9)[:, None]
            return lengths[k] * self._drawn((first + second) / 2, v, np.zeros_like(v))

        chosen = sheet.least(cost, *free)
        if chosen is None or (not self.course.free_start and (chosen == chosen[0]).all()):
            return None
        return turning_through(sheet.at, sheet.angles[chosen], KNOTS, *free)

    def refined(self, turning: CubicSpline) -> CubicSpline:
        """The turning near another one that needs the least with this time law."""
        free = self.course.free_end, self.course.free_start
        values, near = values_of(turning(turning.x), *free), self._first(turning)
        q = None if near is None else self._configurations(values[None], near)[0]
        if q is None or not np.isfinite(q).all():
            return turning
        first = max(abs(float(self._costs(q[None])[0])), 1e-9)
        best = [q]

        def cost(x: Array) -> tuple[float, Array]:
            checkpoint()
            tried = self._configurations(np.vstack([x, x + STEP * np.eye(len(x))]), best[0])
            if not np.isfinite(tried).all():
                return 1e3, np.zeros(len(x))
            values = self._costs(tried) / first
            best[0] = tried[0]
            return float(values[0]), (values[1:] - values[0]) / STEP

        found = minimize(
            cost,
            values,
            jac=True,
            method="L-BFGS-B",
            options={"maxiter": ITERATIONS, "ftol": PROGRESS},
        )
        return turning_of(np.asarray(found.x, dtype=float), *free)

    def _first(self, turning: CubicSpline) -> Array | None:
        """Configurations (INSTANTS, nq) [rad] of a turning, followed from its start; None without a
        start.
        """
        first = _first_of(self.prepared, self.q_start, turning)
        if first is None:
            return None
        (trace,) = traces(self.prepared.arm, replace(self.course, turning=turning), first[None])
        return np.stack([np.interp(self.at, trace.at, q) for q in trace.q.T], axis=1)

    def _configurations(self, values: Array, near: Array) -> Array:
        """Configurations (n, INSTANTS, nq) [rad] of turnings by their values (n, k), near others;
        NaN where none is.
        """
        count, nq = len(values), near.shape[1]
        free = self.course.free_end, self.course.free_start
        angles = np.concatenate([turning_of(each, *free)(self.at) for each in values])
        T = flange_pose(
            self.course.turned(np.tile(self.poses, (count, 1, 1)), angles),
            self.prepared.arm.T_flange_tcp,
        )
        q, missed = newton.solved(self.chain, np.tile(near, (count, 1)), T, steps=20)
        q[missed > REACHED] = np.nan
        return q.reshape(count, INSTANTS, nq)

    def _costs(self, q: Array) -> Array:
        """Cost (n,) [J] of motions q (n, INSTANTS, nq) [rad] with this time law."""
        spline = CubicSpline(self.times, q, axis=1, bc_type="clamped")
        v, a = (spline(self.times, d).reshape(-1, q.shape[2]) for d in (1, 2))
        drawn = self._drawn(q.reshape(v.shape), v, a, soft=True)
        return np.asarray(drawn.reshape(len(q), INSTANTS) @ self.weights)

    def _drawn(self, q: Array, v: Array, a: Array, soft: bool = False) -> Array:
        """Cost (n,) [W] at states (n, nq); what exceeds a limit costs more if `soft`, else
        infinitely much.
        """
        arm, limits, tau = (
            self.prepared.arm,
            self.prepared.arm.active_limits,
            self.prepared.torques(q, v, a),
        )
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
            np.asarray(cost + EXCESS * np.abs(cost) * over)
            if soft
            else np.where(over > 0, np.inf, cost)
        )

    def _excluded(self, q: Array) -> Mask:
        """Which configurations (n, nq) are outside of the joints' range, or collide."""
        limits, arm = self.prepared.arm.active_limits, self.prepared.arm
        outside = ((q < limits.q_min) | (q > limits.q_max)).any(axis=1)
        if not (arm.collisions and len(self.prepared.surroundings.model.pairs)):
            return np.asarray(outside)
        hits = [
            each.distance < 0
            for each in self.prepared.surroundings.model.closest_pairs(q, within=0.0)
        ]
        return np.asarray(outside | np.array(hits))
