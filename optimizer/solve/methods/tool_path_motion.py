"""Motion of least cost along a tool path: the joints follow the path, the timing is chosen."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from operator import itemgetter
from typing import ClassVar

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.kinematics.tool_path.course_tracing import Trace
from joulepath.optimizer.motion.bspline import DEGREE, Basis
from joulepath.optimizer.motion.spline import Spline, sampled
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.problem.tool_path import ToolPath
from joulepath.optimizer.solve.methods.duration_intervals import DurationInterval, fastest
from joulepath.optimizer.solve.methods.end_angle import try_angles
from joulepath.optimizer.solve.methods.even_speed import EvenSpeed
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.path_retiming import PathRetiming
from joulepath.optimizer.solve.methods.path_time_law import PathTimeLaws, fractions, on_path
from joulepath.optimizer.solve.methods.solve_result import (
    SolveReason,
    SolveResult,
    SolveStatus,
    with_effort,
)
from joulepath.optimizer.solve.methods.tool_turning import TurnedAtEnd, turned_paths


@dataclass(frozen=True)
class ToolPathMotionSettings:
    """Settings of motions along a tool path."""

    finer_scaling: int = 2
    """Factor on the spans in the second time scaling."""

    most_scaling_spans: int = 72
    """Largest number of spans of the second time scaling."""

    further_spans: int = 12
    """Spans of the motion in addition to the spans of its path."""

    most_first_spans: int = 67
    """Largest number of spans of the motion at first."""

    refinements: tuple[int, ...] = (1, 2, 4, 8)
    """Factors on the spans of the motion, tried until the motion keeps to the path."""

    nearly: float = 1.1
    """Ratio of durations beyond which a finer time scaling is not tried: it gains less time."""


TOOL_PATH_MOTION = ToolPathMotionSettings()


class ToolPathMotion(Method):
    """Solves a candidate along the tool path of the problem, from its start configuration.

    Every candidate follows its own curve of the joints, about which other candidates give no
    information: therefore many are solved.
    """

    most_solved: ClassVar[int | None] = 64
    takes_guesses: ClassVar[bool] = True

    @cached_property
    def _laws(self) -> PathTimeLaws:
        return PathTimeLaws(self.prepared, self.t_min, self.t_max)

    def solve(self) -> SolveResult:
        """Solve for the time scaling of least cost."""
        try:
            with watch(self.deadline):
                return self._solve()
        except DeadlinePassed:
            return SolveResult(SolveStatus.OUT_OF_TIME, SolveReason.DEADLINE_PASSED)

    def _solve(self) -> SolveResult:
        path = self.prepared.followed.joint_path(self.q_start)
        if path is None:
            return SolveResult(SolveStatus.INFEASIBLE, SolveReason.PATH_TOO_SHARP)
        if self.prepared.least_speed is not None:
            s = fractions(path)
            v_max = self.prepared.arm.active_limits.v_max
            slow = self.prepared.least_speed.out_of_reach(path.curve(s), path.curve(s, 1), v_max)
            if slow is not None:
                return SolveResult(
                    SolveStatus.INFEASIBLE, SolveReason.LEAST_SPEED_OUT_OF_REACH, figures=slow
                )
        first = self._laws.scaling(1)
        results = [self._solved_along(path, each, first) for each in self._intervals()]
        if all(result.spline is None for result in results) and not self._holds_speed:
            results += self._nearly_fastest(path)
        found = self._without_collision(
            min(results, key=lambda result: self.cost_of(result.spline))
        )
        if found.spline is None and self._may_turn():
            self._solve_turned(self._laws.paced(path), self._laws.scaling(1), np.inf, results)
            found = min([found, *results], key=lambda result: self.cost_of(result.spline))
        return with_effort(found, results)

    def _nearly_fastest(self, path: Spline) -> list[SolveResult]:
        """Attempts in a finer space, which may contain a motion that is nearly the fastest.

        In a limited time they start from the fastest motion of the first space. If that takes far
        longer, the candidate is infeasible.
        """
        law, results = None, list[SolveResult]()
        if self.t_max < DURATIONS.longest:
            fast = self._solved_along(path, fastest(self.prepared), self._laws.scaling(1))
            results.append(replace(fast, status=SolveStatus.FAILED, spline=None))
            if (
                fast.spline is not None
                and fast.spline.duration > TOOL_PATH_MOTION.nearly * self.t_max
            ):
                too_slow = SolveResult(
                    SolveStatus.INFEASIBLE,
                    SolveReason.TOOL_PATH_TAKES_LONGER,
                    figures=(fast.spline.duration,),
                )
                return [*results, too_slow]
            law = None if fast.spline is None else on_path(path, *sampled(fast.spline))
        finer = self._laws.scaling(TOOL_PATH_MOTION.finer_scaling)
        return [*results, self._solved_along(path, self.interval, finer, law)]

    def _clear_along(
        self, path: Spline, scaling: Basis, law: tuple[Array, Array] | None = None
    ) -> SolveResult:
        """The result of `_solved_along`, without its motion if that collides."""
        return self._without_collision(self._solved_along(path, self.interval, scaling, law))

    def _without_collision(self, found: SolveResult) -> SolveResult:
        """The result, without its motion if that collides."""
        hit = (
            None
            if found.spline is None
            else self.prepared.surroundings.worst_violation(found.spline)
        )
        if hit is None:
            return found
        return SolveResult(SolveStatus.FAILED, SolveReason.TOOL_PATH_COLLIDES, collision=hit)

    @property
    def _tool_path(self) -> ToolPath:
        assert self.prepared.problem.tool_path is not None
        return self.prepared.problem.tool_path

    @property
    def _holds_speed(self) -> bool:
        """Whether the speed of the TCP is fixed."""
        return self._tool_path.fixed_speed is not None

    def _may_turn(self) -> bool:
        """Whether the tool may turn about an axis, and other turnings were not searched before."""
        followed = self.prepared.followed
        return self._tool_path.about is not None and not followed.are_turnings_searched(
            self.q_start
        )

    def _solve_turned(
        self, law: tuple[Array, Array], scaling: Basis, least: float, results: list[SolveResult]
    ) -> None:
        """Solve with other turnings of the tool.

        The path of the best motion is kept, and no turning is chosen again. With a free angle at
        the goal only, turnings that end at the present angle are solved, too, so that no motion
        between fixed ends needs less.

        Args:
            law: times (k,) [s], and fractions (k,) of the path, with which turnings are compared.
            scaling: space of the time scaling.
            least: cost below which the path of a motion is kept [J].
            results: list to which the results are appended.
        """
        prepared, best, q_start = self.prepared, least, self.q_start
        assert prepared.course is not None
        prepared.followed.mark_turnings_searched(q_start)
        held, first_law = list[tuple[Trace, Spline]](), law
        if prepared.course.free_sides == ["goal"]:
            held += turned_paths(prepared, q_start, self.q_goal, *law, hold_goal=True)

        def is_best(trace: Trace, path: Spline, result: SolveResult) -> bool:
            nonlocal best
            results.append(result)
            cost = self.cost_of(result.spline)
            if result.spline is None or cost >= best:
                return False
            best = cost
            # the path is found from its start, and from the start of its motion
            for first in (trace.q[0], result.spline.control_points[0]):
                prepared.followed.select_turning(first, trace, path)
            return True

        for side in prepared.course.free_sides:
            found = self._at_best_angle(TurnedAtEnd(prepared, q_start, self.q_goal, side), results)
            if found is not None:
                trace, path, coarse = found
                assert coarse.spline is not None
                own = on_path(path, *sampled(coarse.spline))
                fine = self._clear_along(path, scaling, own)
                if any([is_best(trace, path, coarse), is_best(trace, path, fine)]):
                    q_start, law = trace.q[0], own
        for trace, path in turned_paths(prepared, q_start, self.q_goal, *law):
            is_best(trace, path, self._clear_along(path, scaling, law))
        for trace, path in held:
            is_best(trace, path, self._clear_along(path, scaling, first_law))

    def _at_best_angle(
        self, turned: TurnedAtEnd, results: list[SolveResult]
    ) -> tuple[Trace, Spline, SolveResult] | None:
        """Find the best angle of the tool at an end, by motions of the first time scaling.

        Args:
            turned: paths with other angles at an end.
            results: list to which the effort is appended.

        Returns:
            The trace, the path of the joints and the motion; None without a motion.
        """
        found = list[tuple[float, Trace, Spline, SolveResult]]()

        def cost(angle: float) -> float:
            followed = turned.by(angle)
            if followed is None:
                return np.inf
            result = self._clear_along(followed[1], self._laws.scaling(1))
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
        """Always: near a corner, the speed changes within a small share of the path."""
        return True

    def solve_from(self, q: Array, t: Array, fine: bool) -> SolveResult:
        """Solve from a motion along the path in a finer space, and with other turnings.

        Args:
            q: samples of the motion, shape (k, nq) [rad].
            t: times of the samples, shape (k,) [s].
            fine: not available: the result has no motion.
        """
        path = self.prepared.followed.joint_path(self.q_start)
        scaling = self._laws.scaling(TOOL_PATH_MOTION.finer_scaling)
        failed = SolveResult(SolveStatus.FAILED, SolveReason.NO_FINER_SCALING)
        if fine or path is None:
            return failed
        results, law = [failed], on_path(path, q, t)
        try:
            with watch(self.deadline):
                if self._holds_speed:
                    results.append(self._clear_along(path, scaling))
                elif scaling.n > TOOL_PATH_MOTION.most_scaling_spans + DEGREE:
                    scaling = self._laws.scaling(1)
                else:
                    results.append(self._solved_along(path, self.interval, scaling, law))
                if self._may_turn():
                    least = min(self.cost_of(result.spline) for result in results)
                    self._solve_turned(law, scaling, least, results)
        except DeadlinePassed:
            results.append(SolveResult(SolveStatus.OUT_OF_TIME, SolveReason.DEADLINE_PASSED))
        return with_effort(min(results, key=lambda result: self.cost_of(result.spline)), results)

    def _intervals(self) -> list[DurationInterval]:
        """Intervals of durations to solve in.

        Mechanical work falls with the duration, but its smoothed corners do not: the longest
        duration is tried too.
        """
        longest = replace(self.interval, t_min=self.t_max)
        may_be_slower = self.prepared.problem.objective == "mechanical" and self.t_min < self.t_max
        return [self.interval, longest] if may_be_slower else [self.interval]

    def _solved_along(
        self,
        path: Spline,
        interval: DurationInterval,
        scaling: Basis,
        law: tuple[Array, Array] | None = None,
    ) -> SolveResult:
        """Solve for the time scaling, in a space fine enough for the tolerance of the path.

        At a fixed speed only the ramps are chosen.

        Args:
            path: path of the joints.
            interval: allowed durations and the cost.
            scaling: space of the time scaling.
            law: initial guess, as times (k,) [s] and fractions (k,) of the path; None for one
                that slows down at bends.
        """
        if self._holds_speed:
            speed = self._tool_path.fixed_speed
            assert speed is not None
            return EvenSpeed(self.prepared, path, interval, speed, self._laws.keeps_to_path).solve()
        results, x = list[SolveResult](), None
        t, s = law or self._laws.paced(path)
        spans = len(np.unique(path.knots)) + TOOL_PATH_MOTION.further_spans
        spans = min(spans, TOOL_PATH_MOTION.most_first_spans)
        for finer in TOOL_PATH_MOTION.refinements:
            retiming = PathRetiming(
                self.prepared, path, interval, self._laws.space(spans * finer), scaling
            )
            results.append(retiming.solve(retiming.variables(s, t) if x is None else x))
            found, x = results[-1].spline, retiming.found
            if found is None and self.prepared.least_speed is not None:
                results[-1] = replace(results[-1], reason=SolveReason.LEAST_SPEED_NOT_KEPT)
            if found is None or self._laws.keeps_to_path(found):
                return with_effort(results[-1], results)
        failed = replace(
            results[-1],
            status=SolveStatus.FAILED,
            reason=SolveReason.TOLERANCE_NOT_KEPT,
            spline=None,
        )
        return with_effort(failed, results)
