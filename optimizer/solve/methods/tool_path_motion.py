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
from joulepath.optimizer.motion.spline import Spline, sampled
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.problem.tool_path import ToolPath
from joulepath.optimizer.solve.methods.duration_intervals import DurationInterval, fastest
from joulepath.optimizer.solve.methods.end_angle import try_angles
from joulepath.optimizer.solve.methods.even_speed import EvenSpeed
from joulepath.optimizer.solve.methods.method import Method, above
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

    refinements: tuple[float, ...] = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
    """Factors on the spans of the motion, tried until the motion keeps to the path."""

    scaling_power: float = 0.5
    """Exponent of these factors in the factors on the spans of the time scaling: a scaling as fine
    as the motion has changes that the motion does not follow, and leaves the path."""

    failures: int = 2
    """Successive factors without a motion within the limits after which no finer one is tried."""

    promising: float = 1.1
    """Multiple of the incumbent's cost above which a motion that does not keep to the path yet is
    not solved in finer spaces: there, it hardly becomes cheaper."""

    finer: tuple[float, ...] = (1.5, 3.0)
    """First factors of second solves."""

    most_finer_spans: int = 120
    """Largest number of spans of second solves: they gain little on long paths."""

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
        results, law = list[SolveResult](), None
        for interval in self._intervals():
            results.append(self._solved_along(path, interval, law))
            spline = results[-1].spline
            law = None if spline is None else on_path(path, *sampled(spline))
        if all(result.spline is None for result in results):
            for result in results:
                if result.status is SolveStatus.PRUNED:
                    return with_effort(result, results)
            if not self._holds_speed:
                results += self._nearly_fastest(path)
        found = self._without_collision(
            min(results, key=lambda result: self.cost_of(result.spline))
        )
        if found.spline is None and self._may_turn():
            self._solve_turned(self._laws.paced(path), 1.0, np.inf, results)
            found = min([found, *results], key=lambda result: self.cost_of(result.spline))
        return with_effort(found, results)

    def _nearly_fastest(self, path: Spline) -> list[SolveResult]:
        """Attempts in a finer space, which may contain a motion that is nearly the fastest.

        In a limited time they start from the fastest motion of the first space. If that takes far
        longer, the candidate is infeasible.
        """
        law, results = None, list[SolveResult]()
        if self.t_max < DURATIONS.longest:
            fast = self._solved_along(path, fastest(self.prepared))
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
        return [*results, self._solved_along(path, self.interval, law, TOOL_PATH_MOTION.finer[0])]

    def _clear_along(
        self, path: Spline, law: tuple[Array, Array] | None = None, finer: float = 1.0
    ) -> SolveResult:
        """The result of `_solved_along`, without its motion if that collides."""
        return self._without_collision(self._solved_along(path, self.interval, law, finer))

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
        self, law: tuple[Array, Array], finer: float, least: float, results: list[SolveResult]
    ) -> None:
        """Solve with other turnings of the tool.

        The path of the best motion is kept, and no turning is chosen again. With a free angle at
        the goal only, turnings that end at the present angle are solved, too, so that no motion
        between fixed ends needs less.

        Args:
            law: times (k,) [s], and fractions (k,) of the path, with which turnings are compared.
            finer: factor on the number of spans.
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
                fine = self._clear_along(path, own, finer)
                if any([is_best(trace, path, coarse), is_best(trace, path, fine)]):
                    q_start, law = trace.q[0], own
        for trace, path in turned_paths(prepared, q_start, self.q_goal, *law):
            is_best(trace, path, self._clear_along(path, law, finer))
        for trace, path in held:
            is_best(trace, path, self._clear_along(path, first_law, finer))

    def _at_best_angle(
        self, turned: TurnedAtEnd, results: list[SolveResult]
    ) -> tuple[Trace, Spline, SolveResult] | None:
        """Find the best angle of the tool at an end, by motions of the first spaces.

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
            result = self._clear_along(followed[1])
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
        failed = SolveResult(SolveStatus.FAILED, SolveReason.NO_FINER_SCALING)
        if fine or path is None:
            return failed
        results, law = [failed], on_path(path, q, t)
        most = TOOL_PATH_MOTION.most_finer_spans
        factors = [each for each in TOOL_PATH_MOTION.finer if self._laws.spans(path, each) <= most]
        try:
            with watch(self.deadline):
                if self._holds_speed:
                    results.append(self._clear_along(path))
                else:
                    # a result before the deadline counts
                    results.extend(
                        self._solved_along(path, self.interval, law, finer) for finer in factors
                    )
                if self._may_turn():
                    least = min(self.cost_of(result.spline) for result in results)
                    self._solve_turned(law, max(factors, default=1.0), least, results)
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
        law: tuple[Array, Array] | None = None,
        finer: float = 1.0,
    ) -> SolveResult:
        """Solve for the time scaling, in a space fine enough for the tolerance of the path.

        The spans of each space are short where the motion found before is at bends. At a fixed
        speed only the ramps are chosen.

        Args:
            path: path of the joints.
            interval: allowed durations and the cost.
            law: initial guess, as times (k,) [s] and fractions (k,) of the path; None for one
                that slows down at bends.
            finer: factor on the numbers of spans.
        """
        if self._holds_speed:
            speed = self._tool_path.fixed_speed
            assert speed is not None
            return EvenSpeed(self.prepared, path, interval, speed, self._laws.keeps_to_path).solve()
        results, failures, law = list[SolveResult](), 0, law or self._laws.paced(path)
        for factor in TOOL_PATH_MOTION.refinements:
            space = self._laws.space(path, law, factor * finer)
            scaling = self._laws.space(path, law, factor**TOOL_PATH_MOTION.scaling_power * finer)
            retiming = PathRetiming(self.prepared, path, interval, space, scaling)
            t, s = law
            found = retiming.solve(retiming.variables(s, t), self._laws.keeps_to_path)
            if found.reason is SolveReason.NO_MOTION_ALONG_PATH:
                failures += 1
                if self.prepared.least_speed is not None:
                    found = replace(found, reason=SolveReason.LEAST_SPEED_NOT_KEPT)
            else:
                failures = 0
            results.append(found)
            if found.spline is not None or failures == TOOL_PATH_MOTION.failures:
                break
            coarse, margin = retiming.motion(retiming.found), TOOL_PATH_MOTION.promising
            if not interval.minimum_time and (
                self.cost_of(coarse) > above(self.incumbent_cost, margin)
            ):
                results.append(SolveResult(SolveStatus.PRUNED, SolveReason.PROMISES_NO_LESS))
                break
            law = retiming.law(retiming.found)
        return with_effort(results[-1], results)
