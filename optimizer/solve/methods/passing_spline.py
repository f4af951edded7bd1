"""Motion of least cost through configurations without resting, as one spline.

One quintic B-spline per joint, as in `bspline`. It passes through every configuration at a free
time, chosen together with the control points and the duration. The first solve has few control
points. A refinement has double knots at the passes, since jerk may change quickly there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import ClassVar

import numpy as np
from scipy.interpolate import make_interp_spline

from joulepath.models.robot import Array
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.bspline import Basis
from joulepath.optimizer.motion.joined import joined, spline_through
from joulepath.optimizer.motion.passing import pass_times
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.motion.spline import SAMPLING, Spline, lasting, sampled
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from joulepath.optimizer.solve.methods.guess import Guess
from joulepath.optimizer.solve.methods.limit_repair import sampled_overshoot
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import (
    SolveReason,
    SolveResult,
    SolveStatus,
    with_effort,
)
from joulepath.optimizer.solve.methods.sqp_method import SqpMethod


@dataclass(frozen=True)
class PassingSplineSettings:
    """Settings of the spline spaces of motions through passes."""

    coarse_points: int = 13
    """Control points of the first solve without passes, as of `bspline`."""

    points_per_pass: int = 3
    """Further control points of the first solve per pass."""

    multiplicity: int = 2
    """Multiplicity of the knots at passes."""

    widest_span: float = 1 / 6
    """Widest span between knots, relative to the mean time between passes."""

    fine_widest_span: float = 1 / 7
    """The same in a finer space."""

    same_configuration: float = 1e-9
    """Distance to the configuration before up to which a pass is met with this one [rad]."""


PASSING_SPLINE = PassingSplineSettings()


class PassingSpline(SqpMethod):
    """Solves a candidate through the passes of the problem."""

    takes_long: ClassVar[bool] = True

    def solve(self) -> SolveResult:
        """Solve from a smooth curve through all configurations, then from motions between rests.

        A motion that rests at the passes is the result if no better motion is found from it.
        """
        settings = PASSING_SPLINE
        count = settings.coarse_points + settings.points_per_pass * len(self.passes)
        space = bspline.uniform(count)
        tried, rests = [self.improve(Guess(space, self._smooth(space), 0.0))], list[SolveResult]()
        if tried[0].spline is not None and self.interval.minimum_time:
            # with few control points, the motion is slow
            tried.append(self.solve_from(*sampled(tried[0].spline), fine=True))
        if tried[0].status is SolveStatus.FAILED:
            rests = self._between_rests()
            stopping = [result.spline for result in rests if result.spline is not None]
            if len(stopping) < len(rests):
                return with_effort(
                    next(result for result in rests if result.spline is None), [*tried, *rests]
                )
            motion = joined(stopping)
            known = lasting(motion, float(np.clip(motion.duration, self.t_min, self.t_max)))
            tried.append(self.solve_from(*sampled(known), fine=False))
            if known.duration >= motion.duration:
                tried.append(
                    SolveResult(SolveStatus.SOLVED, SolveReason.STOPS_AT_PASSES, spline=known)
                )
        best = min(tried, key=lambda result: self.cost_of(result.spline))
        return with_effort(best if best.spline is not None else tried[-1], [*tried, *rests])

    @staticmethod
    def may_refine(found: Spline) -> bool:
        """Whether the knots are evenly spaced: `solve_from` places knots at the passes."""
        return bool(np.ptp(np.diff(np.unique(found.knots))) < 1e-9 * found.duration)

    def solve_from(self, q: Array, t: Array, fine: bool) -> SolveResult:
        """Solve from samples q (k, nq) [rad] at times t (k,) [s] of a motion through the passes.

        If `fine`, there are more control points.
        """
        settings = PASSING_SPLINE
        duration = float(t[-1])
        at = pass_times(make_interp_spline(t, q, k=3), self.passes) / duration
        widest = settings.fine_widest_span if fine else settings.widest_span
        space = bspline.graded(at, settings.multiplicity, widest / (len(self.passes) + 1))
        points = space.fit(q, t / duration)
        near = self.prepared.surroundings.is_near_contact(q)
        return self.improve(Guess(space, points, duration, collision_free=near))

    def along_path(self, q: Array, t: Array) -> SolveResult:
        """Solve from samples q (k, nq) [rad] of a path at times t (k,) in [0, 1]."""
        return self.solve_from(q, t, fine=False)

    def overshoot(self, spline: Spline) -> tuple[Array, Array]:
        """Excess (nq,) [rad] below and above the position limits, measured at samples.

        Passes may move control points beyond the limits.
        """
        return sampled_overshoot(self.prepared, spline)

    @cached_property
    def passes(self) -> Array:
        """Configurations (k, nq) [rad] of the passes, without repetitions of the one before."""
        same = PASSING_SPLINE.same_configuration
        kept = [self.q_start]
        for q in self.prepared.problem.passes:
            if np.abs(q - kept[-1]).max() > same:
                kept.append(q)
        if len(kept) > 1 and np.abs(kept[-1] - self.q_goal).max() <= same:
            kept.pop()
        return np.array(kept[1:]).reshape(-1, len(self.q_start))

    @property
    def _configurations(self) -> Array:
        """Start, passes and goal (k, nq) [rad]."""
        return np.array([self.q_start, *self.passes, self.q_goal])

    def _smooth(self, space: Basis) -> Array:
        """Control points (n, nq) [rad] of a curve through all configurations.

        At a pass, a joint has the speed of the parabola through its neighbours, and rests where it
        turns back.
        """
        q, limits = self._configurations, self.coordinates.limits
        lengths = np.maximum(shortest_duration(np.diff(q, axis=0), limits), DURATIONS.least)
        t = np.concatenate([[0.0], np.cumsum(lengths)]) / lengths.sum()
        width = np.diff(t)[:, None]
        slopes, v = np.diff(q, axis=0) / width, np.zeros_like(q)
        mean = (slopes[:-1] * width[1:] + slopes[1:] * width[:-1]) / (width[1:] + width[:-1])
        v[1:-1] = np.where(slopes[:-1] * slopes[1:] > 0, mean, 0.0)
        at = np.linspace(0.0, 1.0, SAMPLING.fit_samples)
        return space.fit(spline_through(t, q, v, np.zeros_like(q)).curve(at), at)

    def _between_rests(self) -> list[SolveResult]:
        """Motions of any duration from rest to rest, up to the first solve without a motion."""
        problem = replace(self.prepared.problem, passes=(), duration_min=None, duration_max=None)
        interval = replace(self.interval, t_min=DURATIONS.least, t_max=DURATIONS.longest)
        results = list[SolveResult]()
        for a, b in pairwise(self._configurations):
            part = self.prepared.beside(replace(problem, start=a, goal=b))
            results.append(FreeSpline(SolveContext(part, a, b, self.deadline, interval)).solve())
            if results[-1].spline is None:
                break
        return results
