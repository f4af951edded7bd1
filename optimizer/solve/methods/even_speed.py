"""Motions along a tool path at a fixed speed of the TCP: even between two ramps, whose lengths
alone are free.

The way of the TCP along the path of the joints is measured by its own derivative, so that the speed
is even on what is followed, and not on what was asked for. On a ramp the speed rises as 10 x³ - 15
x⁴ + 6 x⁵ over the time. The motion is the spline that fits this best, with so many knots that the
speed is off by no more than its tolerance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.kinematics.tool_path.followed_paths import EvenMotion
from joulepath.optimizer.kinematics.tool_path.least_speed import LeastSpeed
from joulepath.optimizer.motion.bspline import DEGREE, clamped, fit
from joulepath.optimizer.motion.spline import Spline, sample
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.tool_path import SPEED_TOLERANCE
from joulepath.optimizer.solve.methods.duration_intervals import DurationInterval
from joulepath.optimizer.solve.methods.limit_repair import path_excess, repair_factors
from joulepath.optimizer.solve.methods.method import CONVERGED, SolveResult, SolveStatus

# samples of the path per control point, to measure along it
SAMPLED = 16
# share of a ramp's way that is used at most; and times of a ramp that are tried, over the longest
# one
USED, TIMES = 0.98, (1.0, 0.75, 0.55, 0.4)
# even spans of a motion, first and more, spans of each ramp, and instants per span at which it is
# fitted
SPANS, RAMP_SPANS, FITTED = (48, 96, 192, 384), 8, 5
# spans that are shorter than this share of an even one are none
LEAST_SPAN = 0.05
# the speed is checked at as many instants per span, and uses no more of its tolerance
CHECKED, WITHIN = 8, 0.5
# m per unit of the path: where the TCP moves less, it turns in place
LEAST_PACE = 1e-9
TURNS = "the tool turns in place on its way: no path.speed can be held there"
TOO_FAST = (
    "the joints' limits do not allow the fixed path.speed with ramps of path.speed.ramp: give a "
    "lower speed, a longer "
    "path.speed.ramp, or a larger path.blend"
)
NOT_HELD = (
    "found no motion that holds the fixed path.speed: give a larger path.blend or path.tolerance"
)


@dataclass(frozen=True, eq=False)
class _Tried:
    """The `motion` with ramps of some `times` [s], None if there is none within the limits, and its
    cost [J].
    """

    times: tuple[float, float]
    motion: Spline | None
    cost: float
    too_fast: bool


@dataclass(frozen=True, eq=False)
class EvenSpeed:
    """Motions along `path`, a spline of the joints over [0, 1], at a fixed `speed` [m/s] of the
    TCP.

    `keeps` says whether a motion is within the tolerances of the tool path.
    """

    prepared: PreparedProblem
    path: Spline
    interval: DurationInterval
    speed: float
    keeps: Callable[[Spline], bool]

    def solve(self) -> SolveResult:
        """The motion of least cost over the lengths of both ramps. Ends by DeadlinePassed once that
        is watched.
        """
        if self._pace.min() < LEAST_PACE:
            return SolveResult(SolveStatus.INFEASIBLE, TURNS)
        tried = list[_Tried]()
        for pairs in (
            self._even_ramps(),
            self._uneven_ramps(0, tried),
            self._uneven_ramps(1, tried),
        ):
            tried += [self._tried(*pair) for pair in pairs]
        for each in sorted(tried, key=lambda each: each.cost):
            motion = self._kept(each)
            if motion is not None:
                return SolveResult(
                    SolveStatus.SOLVED, CONVERGED, len(tried), len(tried), motion, stationarity=0.0
                )
        reason = TOO_FAST if any(each.too_fast for each in tried) else NOT_HELD
        return SolveResult(SolveStatus.FAILED, reason, len(tried), len(tried))

    def _tried(self, first: float, last: float) -> _Tried:
        checkpoint()

        def compute() -> EvenMotion:
            motion = self._motion(first, last, SPANS)
            return motion, motion is not None and self._is_within_limits(motion)

        motion, within = self.prepared.followed.even_motion(self.path, first, last, compute)
        cost = self._cost(motion) if motion is not None and within else np.inf
        return _Tried(
            (first, last), motion if within else None, cost, motion is not None and not within
        )

    def _kept(self, tried: _Tried) -> Spline | None:
        """The motion, with more spans if it leaves its path by more than it may; None if there is
        none.
        """
        motion = tried.motion
        if motion is None or self.keeps(motion):
            return motion
        for spans in SPANS[1:]:
            finer = self._motion(*tried.times, (spans,))
            if finer is not None and self._is_within_limits(finer) and self.keeps(finer):
                return finer
        return None

    def _cost(self, motion: Spline) -> float:
        if self.interval.minimum_time:
            return motion.duration
        return self.prepared.cost_of(motion) + self.interval.price * motion.duration

    @property
    def _least_speed(self) -> LeastSpeed:
        assert self.prepared.least_speed is not None
        return self.prepared.least_speed

    def _speeds(self, q: Array, v: Array) -> Array:
        return np.asarray(self._least_speed.speed.ratios(q, v)[:, 0] * self._least_speed.least)

    @cached_property
    def _at(self) -> Array:
        return np.linspace(0.0, 1.0, SAMPLED * len(self.path.control_points))

    @cached_property
    def _pace(self) -> Array:
        """How far the TCP moves per unit of the path (k,) [m]."""
        return self._speeds(self.path.curve(self._at), self.path.curve(self._at, 1))

    @cached_property
    def _gone(self) -> Array:
        """How far the TCP has moved (k,) [m]."""
        return np.asarray(CubicSpline(self._at, self._pace).antiderivative()(self._at))

    @cached_property
    def _fraction(self) -> CubicSpline:
        """The fraction of the path after a way [m]."""
        return CubicSpline(self._gone, self._at)

    @cached_property
    def _bounds(self) -> tuple[float, float]:
        """Least and greatest mean time [s] of both ramps that the durations of the interval
        allow."""
        even = float(self._gone[-1]) / self.speed
        return self.interval.t_min - even, self.interval.t_max - even

    @cached_property
    def _longest(self) -> float:
        """Longest time [s] of a ramp."""
        return 2 * USED * self._least_speed.ramp / self.speed

    def _even_ramps(self) -> Iterator[tuple[float, float]]:
        """Times [s] of two equal ramps, the longest ones first, and those of the shortest and the
        longest motion.
        """
        for time in (*(self._longest * share for share in TIMES), *self._bounds):
            if (
                max(self._bounds[0], 0.0) <= time <= min(self._bounds[1], self._longest)
                and time > 0
            ):
                yield time, time

    def _uneven_ramps(self, end: int, tried: list[_Tried]) -> Iterator[tuple[float, float]]:
        """The best times [s] so far, but for other ones at one end."""
        best = min(tried, key=lambda each: each.cost, default=None)
        if best is None or best.motion is None:
            return
        for share in TIMES:
            times = list(best.times)
            times[end] = self._longest * share
            known = any(each.times == tuple(times) for each in tried)
            if not known and self._bounds[0] <= sum(times) / 2 <= self._bounds[1]:
                yield times[0], times[1]

    def _motion(self, first: float, last: float, numbers: Sequence[int]) -> Spline | None:
        """The motion with ramps of these times [s], in the first of these numbers of spans with
        which it holds its speed; None if it does not."""
        length = float(self._gone[-1])
        duration = length / self.speed + (first + last) / 2
        for spans in numbers:
            breaks = _breaks(spans, first / duration, last / duration)
            t = _within(breaks, FITTED) * duration
            gone = np.where(
                t < duration / 2,
                _ramped(t, first, self.speed),
                length - _ramped(duration - t, last, self.speed),
            )
            q = self.path.curve(np.clip(self._fraction(gone), 0.0, 1.0))
            q[[0, -1]] = self.path.control_points[[0, -1]]
            knots = clamped(breaks)
            motion = Spline(DEGREE, knots * duration, fit(q, t / duration, knots))
            if self._deviation(motion, first, last) <= WITHIN:
                return motion
        return None

    def _deviation(self, motion: Spline, first: float, last: float) -> float:
        """The largest deviation from the speed over its tolerance: between the ramps, and above it
        on them.
        """
        assert self.prepared.problem.tool_path is not None
        t = _within(np.unique(motion.knots), CHECKED)
        q, v, _ = sample(motion, t)
        off = self._speeds(q, v) / self.speed - 1
        even = (t >= first) & (t <= motion.duration - last)
        return float(np.where(even, np.abs(off), off).max()) / SPEED_TOLERANCE

    def _is_within_limits(self, motion: Spline) -> bool:
        none, path = np.zeros(len(motion.control_points[0])), self.prepared.path
        excess = path_excess(self.prepared, motion, path, None)
        return repair_factors(self.prepared, motion, (none, none)) is None and not excess.any()


def _breaks(spans: int, first: float, last: float) -> Array:
    """Ends of spans (k,) in [0, 1]: even ones, and those of ramps that take shares `first` and
    `last` of the time.
    """
    ramp = np.linspace(0.0, 1.0, RAMP_SPANS + 1)
    breaks = np.unique(
        np.concatenate([np.linspace(0.0, 1.0, spans + 1), first * ramp, 1 - last * ramp])
    )
    breaks = breaks[np.append(True, np.diff(breaks) > LEAST_SPAN / spans)]
    breaks[-1] = 1.0
    return np.asarray(breaks)


def _within(breaks: Array, count: int) -> Array:
    """So many instants in every span between `breaks` (k,), and the last one."""
    inside = np.linspace(0.0, 1.0, count, endpoint=False)
    return np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * inside).ravel(), breaks[-1])


def _ramped(t: Array, ramp: float, speed: float) -> Array:
    """The way (k,) [m] after times t (k,) [s] from rest: a ramp of `ramp` [s], then at the speed
    [m/s].
    """
    x = np.clip(t / ramp, 0.0, 1.0)
    return np.asarray(speed * (ramp * (2.5 * x**4 - 3 * x**5 + x**6) + np.maximum(t - ramp, 0.0)))
