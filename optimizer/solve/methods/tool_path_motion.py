"""The motion of least cost along a tool path: the joints follow it from the candidate's start, its
timing is chosen.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from operator import itemgetter

import numpy as np
from scipy.integrate import cumulative_trapezoid

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.kinematics.tool_path.course_tracing import Trace, path_ratios
from joulepath.optimizer.motion import quintic, ramped
from joulepath.optimizer.motion.bspline import DEGREE, Basis, clamped
from joulepath.optimizer.motion.spline import Spline, sample, sampled
from joulepath.optimizer.problem.problem import LONGEST_DURATION
from joulepath.optimizer.problem.tool_path import ToolPath
from joulepath.optimizer.solve.methods.duration_intervals import DurationInterval, fastest
from joulepath.optimizer.solve.methods.end_angle import try_angles
from joulepath.optimizer.solve.methods.even_speed import EvenSpeed
from joulepath.optimizer.solve.methods.method import (
    DEADLINE_PASSED,
    Method,
    SolveResult,
    SolveStatus,
)
from joulepath.optimizer.solve.methods.path_retiming import PathRetiming
from joulepath.optimizer.solve.methods.sqp_method import with_effort
from joulepath.optimizer.solve.methods.tool_turning import TurnedAtEnd, turned_paths

# spans of the first time scaling, and more of them for each bend; how much finer the second one is,
# and its spans at most
SPANS, BEND_SPANS, FINER_SCALING, MOST_SPANS = 12, 6, 2, 72
# spans that the motion has more than its path, and at most at first; it has so many times as many
# until it keeps to the path
MORE_SPANS, FIRST_SPANS, FINER = 12, 67, (1, 2, 4, 8)
# shares of the time that each ramp of a first guess takes, at least and at most
RAMPS = (0.1, 0.5)
# share of the way of a ramp on which a first guess comes to speed, where there is a least one
ON_RAMP = 0.8
# instants at which the path's tolerances are checked; samples of the path per control point, to
# measure along it
CHECKED, SAMPLED = 2000, 16
# a finer time scaling makes no motion faster by so much
NEARLY = 1.1
NOT_FINER = "there is no other space of time scalings"
TOO_SLOW = (
    "found no motion within the limits that keeps path.speed.min between its ramps: give a smaller "
    "one, a longer "
    "path.speed.ramp, or a larger path.blend"
)
OUT_OF_REACH = (
    "at {0:.1%} of the path the joints' speed limits allow the TCP {1:.3g} m/s, less than "
    "path.speed.min: give a "
    "smaller one"
)
NOT_KEPT = "found no motion within the path's tolerance: give a larger one, or a larger path.blend"
TOO_SHARP = "the path turns too sharply for its tolerance: give a larger path.blend"


class ToolPathMotion(Method):
    """Solves a candidate along the problem's tool path, from its start configuration to where the
    path leads.
    """

    # every candidate follows a curve of its own, which no other candidate's solution tells anything
    # of
    most_solved = 64
    takes_guesses = True

    def solve(self) -> SolveResult:
        """The time scaling of least cost."""
        try:
            with watch(self.deadline):
                return self._solve()
        except DeadlinePassed:
            return SolveResult(SolveStatus.OUT_OF_TIME, DEADLINE_PASSED)

    def _solve(self) -> SolveResult:
        path = self.prepared.followed.joint_path(self.q_start)
        if path is None:
            return SolveResult(SolveStatus.INFEASIBLE, TOO_SHARP)
        if self.prepared.least_speed is not None:
            s = np.linspace(0.0, 1.0, SAMPLED * len(path.control_points))
            v_max = self.prepared.arm.active_limits.v_max
            slow = self.prepared.least_speed.out_of_reach(path.curve(s), path.curve(s, 1), v_max)
            if slow is not None:
                return SolveResult(SolveStatus.INFEASIBLE, OUT_OF_REACH.format(*slow))
        results = [self._kept(path, interval, self._scaling(1)) for interval in self._intervals()]
        if all(result.spline is None for result in results) and not self._holds_speed:
            results += self._nearly_fastest(path)
        found = self._clear(min(results, key=lambda result: self.cost_of(result.spline)))
        if found.spline is None and self._may_turn():
            self._turn(self._paced(path), self._scaling(1), np.inf, results)
            found = min([found, *results], key=lambda result: self.cost_of(result.spline))
        return with_effort(found, results)

    def _nearly_fastest(self, path: Spline) -> list[SolveResult]:
        """Attempts where the first space has no motion: what it cannot express, a finer one may, a
        motion that is nearly the fastest one.

        In a limited time they begin from the fastest motion of the first space; if that takes far
        longer, none is made.
        """
        law, results = None, list[SolveResult]()
        if self.t_max < LONGEST_DURATION:
            fast = self._kept(path, fastest(self.prepared), self._scaling(1))
            results.append(replace(fast, status=SolveStatus.FAILED, spline=None))
            if fast.spline is not None and fast.spline.duration > NEARLY * self.t_max:
                reason = (
                    f"along the path, the fastest motion found takes {fast.spline.duration:.4f} s"
                )
                return [*results, SolveResult(SolveStatus.INFEASIBLE, reason)]
            law = None if fast.spline is None else _on_path(path, *sampled(fast.spline))
        return [*results, self._kept(path, self.interval, self._scaling(FINER_SCALING), law)]

    def _clear(self, found: SolveResult) -> SolveResult:
        """The result; without a motion if that collides."""
        hit = (
            None
            if found.spline is None
            else self.prepared.surroundings.worst_violation(found.spline)
        )
        if hit is None:
            return found
        return SolveResult(SolveStatus.FAILED, f"along the path, {hit.message}", collision=hit)

    @property
    def _tool_path(self) -> ToolPath:
        assert self.prepared.problem.tool_path is not None
        return self.prepared.problem.tool_path

    @property
    def _holds_speed(self) -> bool:
        """Whether the speed of the TCP is fixed."""
        return self._tool_path.fixed_speed is not None

    def _may_turn(self) -> bool:
        """Whether the tool may turn about an axis, and its turning has not been looked for
        before."""
        followed = self.prepared.followed
        return self._tool_path.about is not None and not followed.are_turnings_searched(
            self.q_start
        )

    def _turn(
        self, law: tuple[Array, Array], scaling: Basis, least: float, results: list[SolveResult]
    ) -> None:
        """Append to `results` motions with other turnings of the tool, looked for with a law of
        times [s] and fractions (k,).

        The path of the best one is kept if it needs less than `least` [J]; and no other is looked
        for again.
        """
        prepared, best, q_start = self.prepared, least, self.q_start
        assert prepared.course is not None
        prepared.followed.mark_turnings_searched(q_start)

        def is_best(trace: Trace, path: Spline, result: SolveResult) -> bool:
            nonlocal best
            results.append(result)
            cost = self.cost_of(result.spline)
            if result.spline is None or cost >= best:
                return False
            best = cost
            # a motion of its control points begins there
            for first in (trace.q[0], result.spline.control_points[0]):
                prepared.followed.select_turning(first, trace, path)
            return True

        for side in prepared.course.free_sides:
            found = self._at_best_angle(TurnedAtEnd(prepared, q_start, self.q_goal, side), results)
            if found is not None:
                trace, path, coarse = found
                assert coarse.spline is not None
                own = _on_path(path, *sampled(coarse.spline))
                fine = self._clear(self._kept(path, self.interval, scaling, own))
                if any([is_best(trace, path, coarse), is_best(trace, path, fine)]):
                    q_start, law = trace.q[0], own
        for trace, path in turned_paths(prepared, q_start, self.q_goal, *law):
            is_best(trace, path, self._clear(self._kept(path, self.interval, scaling, law)))

    def _at_best_angle(
        self, turned: TurnedAtEnd, results: list[SolveResult]
    ) -> tuple[Trace, Spline, SolveResult] | None:
        """The trace, the joints' path and a motion at the best angle of the tool at an end; None if
        there is none.

        All angles, the present one included, are compared by motions of the first time scaling. The
        effort for them goes into `results`.
        """
        found = list[tuple[float, Trace, Spline, SolveResult]]()

        def cost(angle: float) -> float:
            followed = turned.by(angle)
            if followed is None:
                return np.inf
            result = self._clear(self._kept(followed[1], self.interval, self._scaling(1)))
            results.append(replace(result, status=SolveStatus.FAILED, spline=None))
            found.append(
                (self.cost_of(result.spline), *followed, replace(result, iterations=0, solves=0))
            )
            return found[-1][0]

        try_angles(cost, cost(0.0))
        best = min(found, key=itemgetter(0), default=None)
        return None if best is None or best[3].spline is None else best[1:]

    @staticmethod
    def may_refine(found: Spline) -> bool:
        """A finer time scaling may always save some: near a corner, the speed changes within a
        small share of it.
        """
        return True

    def solve_from(self, q: Array, t: Array, fine: bool) -> SolveResult:
        """The time scaling of least cost in a finer space, from samples q (k, nq) [rad] at t (k,)
        [s] of a motion along the path; and with other turnings of the tool, if it may turn."""
        path, scaling = (
            self.prepared.followed.joint_path(self.q_start),
            self._scaling(FINER_SCALING),
        )
        if fine or path is None:
            return SolveResult(SolveStatus.FAILED, NOT_FINER)
        results, law = [SolveResult(SolveStatus.FAILED, NOT_FINER)], _on_path(path, q, t)
        try:
            with watch(self.deadline):
                if self._holds_speed:
                    results.append(self._clear(self._kept(path, self.interval, scaling)))
                elif scaling.n > MOST_SPANS + DEGREE:
                    scaling = self._scaling(1)
                else:
                    results.append(self._kept(path, self.interval, scaling, law))
                if self._may_turn():
                    least = min(self.cost_of(result.spline) for result in results)
                    self._turn(law, scaling, least, results)
        except DeadlinePassed:
            results.append(SolveResult(SolveStatus.OUT_OF_TIME, DEADLINE_PASSED))
        return with_effort(min(results, key=lambda result: self.cost_of(result.spline)), results)

    def _scaling(self, finer: int) -> Basis:
        """The space of the time scaling, so many times finer than the first one."""
        assert self.prepared.course is not None
        return self._space((SPANS + BEND_SPANS * self.prepared.course.shape.bends) * finer)

    def _space(self, spans: int) -> Basis:
        """A space with so many even spans, and with knots where the ramps of a least speed end."""
        breaks = np.linspace(0.0, 1.0, spans + 1)
        if self.prepared.least_speed is not None:
            breaks = np.unique(np.append(breaks, [self._ramp, 1 - self._ramp]).round(9))
        return Basis.of(clamped(breaks), grid_points=0)

    @cached_property
    def _ramp(self) -> float:
        """The share of the time that each ramp takes, at an even speed between them, where there is
        a least speed.
        """
        least = self.prepared.least_speed
        assert least is not None
        way = ON_RAMP * least.ramp / float(least.gone[-1])
        return 2 * way / (1 + 2 * way)

    def _intervals(self) -> list[DurationInterval]:
        """The durations that are tried. Work without friction falls with the duration, its smoothed
        corners do not.
        """
        longest = replace(self.interval, t_min=self.t_max)
        may_be_slower = self.prepared.problem.objective == "mechanical" and self.t_min < self.t_max
        return [self.interval, longest] if may_be_slower else [self.interval]

    def _kept(
        self,
        path: Spline,
        interval: DurationInterval,
        scaling: Basis,
        law: tuple[Array, Array] | None = None,
    ) -> SolveResult:
        """The time scaling of least cost, in a space of motions that is fine enough for the
        tolerance.

        `law` is a guess: times (k,) [s], and the fractions (k,) of the path there. At a fixed speed
        only the ramps are chosen.
        """
        if self._holds_speed:
            speed = self._tool_path.fixed_speed
            assert speed is not None
            return EvenSpeed(self.prepared, path, interval, speed, self._keeps_to_path).solve()
        results, x = list[SolveResult](), None
        t, s = law or self._paced(path)
        spans = min(len(np.unique(path.knots)) + MORE_SPANS, FIRST_SPANS)
        for finer in FINER:
            retiming = PathRetiming(
                self.prepared, path, interval, self._space(spans * finer), scaling
            )
            results.append(retiming.solve(retiming.variables(s, t) if x is None else x))
            found, x = results[-1].spline, retiming.found
            if found is None and self.prepared.least_speed is not None:
                results[-1] = replace(results[-1], reason=TOO_SLOW)
            if found is None or self._keeps_to_path(found):
                return with_effort(results[-1], results)
        failed = replace(results[-1], status=SolveStatus.FAILED, reason=NOT_KEPT, spline=None)
        return with_effort(failed, results)

    def _paced(self, path: Spline) -> tuple[Array, Array]:
        """Times (k,) [s], and fractions (k,) of the path where a motion is then that is slow where
        the path bends.

        At every point, the speed keeps the rates of the path's own derivatives within the limits.
        """
        s = np.linspace(0.0, 1.0, SAMPLED * len(path.control_points))
        derivatives = np.stack([path.curve(s, d) for d in (1, 2, 3)])
        ratios = np.abs(derivatives) / self.prepared.arm.active_limits.rates[:, None]
        pace: Array = (ratios.max(axis=2) ** (1 / np.arange(1, 4))[:, None]).max(axis=0)
        if self.prepared.path is not None:
            pace = np.maximum(
                pace, self.prepared.path.speed_ratios(path.curve(s), path.curve(s, 1))
            )
        t = np.asarray(cumulative_trapezoid(pace, s, initial=0))
        at = np.linspace(0.0, 1.0, CHECKED)
        # as fast at most as this pace, whose peak is that of the quintic; in less time, with
        # shorter ramps
        duration = float(np.clip(quintic.PEAKS[0] * t[-1], self.t_min, self.t_max))
        law = quintic.fraction(at)
        if self.prepared.least_speed is not None:
            duration = float(np.clip(t[-1] / (1 - self._ramp), self.t_min, self.t_max))
            law = ramped.fraction(at, self._ramp)
        elif duration < quintic.PEAKS[0] * t[-1]:
            law = ramped.fraction(at, float(np.clip(1 - t[-1] / duration, *RAMPS)))
        return at * duration, np.interp(law, t / t[-1], s)

    def _keeps_to_path(self, motion: Spline) -> bool:
        """Whether a motion is within the path's tolerances."""
        assert self.prepared.course is not None
        q, _, _ = sample(motion, np.linspace(0.0, motion.duration, CHECKED))
        return max(path_ratios(self.prepared.arm, self.prepared.course, q).values()) <= 1


def _on_path(path: Spline, q: Array, t: Array) -> tuple[Array, Array]:
    """Times (k,) [s], and fractions (k,) of the path where a motion is then, by the way that its
    joints have gone.
    """
    s = np.linspace(0.0, 1.0, SAMPLED * len(path.control_points))
    gone, way = _way(q), _way(path.curve(s))
    return t, np.interp(gone / gone[-1], way / way[-1], s)


def _way(q: Array) -> Array:
    """The way (k,) [rad] that the joints have gone until each configuration q (k, nq)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
