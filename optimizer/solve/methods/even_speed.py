"""Motions along a tool path at a fixed speed of the TCP, with two ramps of free lengths.

The length of the TCP's path is measured along the path of the joints, so that the speed is constant
on the path that is followed, rather than on the path asked for. On a ramp the speed rises as 10 x³
- 15 x⁴ + 6 x⁵ over the time x. The motion is the spline that fits this best, with enough knots for
the tolerance of the speed.
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
from joulepath.optimizer.problem.tool_path import TOOL_PATH
from joulepath.optimizer.solve.methods.duration_intervals import DurationInterval
from joulepath.optimizer.solve.methods.limit_repair import path_excess, repair_factors
from joulepath.optimizer.solve.methods.retimed_path import instants_in_spans
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus


@dataclass(frozen=True)
class EvenSpeedSettings:
    """Settings of motions at a fixed speed of the TCP."""

    samples_per_point: int = 16
    """Samples of the path per control point, to measure along it."""

    used_ramp: float = 0.98
    """Largest share of the length of a ramp that is used."""

    ramp_times: tuple[float, ...] = (1.0, 0.75, 0.55, 0.4)
    """Times of a ramp that are tried, relative to the longest time."""

    spans: tuple[int, ...] = (48, 96, 192, 384)
    """Evenly spaced spans of a motion, tried in turn."""

    ramp_spans: int = 12
    """Spans of a ramp."""

    fitted_per_span: int = 5
    """Instants per span at which the motion is fitted to the path."""

    least_span: float = 0.05
    """Length, relative to the shortest of the evenly spaced spans and those of ramps, below which a
    span is merged."""

    growth: float = 2.0
    """Ratio of successive spans beside a short ramp."""

    checked_per_span: int = 8
    """Instants per span at which the speed is checked."""

    tolerance_used: float = 0.5
    """Share of the tolerance of the speed that is used."""

    least_pace: float = 1e-9
    """Length of the TCP's path per unit of the joint path below which the tool turns in place
    [m]."""


EVEN_SPEED = EvenSpeedSettings()


@dataclass(frozen=True, eq=False)
class _Attempt:
    """Attempt with given ramps."""

    times: tuple[float, float]
    """Times of the ramps [s]."""

    motion: Spline | None
    """The motion; None without a motion within the limits."""

    cost: float
    """Cost of the motion; infinite without a motion [J]."""

    too_fast: bool
    """Whether the motion exceeds the limits."""


@dataclass(frozen=True, eq=False)
class EvenSpeed:
    """Motions along a path of the joints at a fixed speed of the TCP."""

    prepared: PreparedProblem

    path: Spline
    """Path of the joints over [0, 1]."""

    interval: DurationInterval
    """Allowed durations and the cost."""

    speed: float
    """Speed of the TCP [m/s]."""

    keeps: Callable[[Spline], bool]
    """Whether a motion keeps the tolerances of the tool path."""

    def solve(self) -> SolveResult:
        """Solve for the ramps of least cost.

        Raises:
            DeadlinePassed: the watched deadline passed.
        """
        if self._pace.min() < EVEN_SPEED.least_pace:
            return SolveResult(SolveStatus.INFEASIBLE, SolveReason.TOOL_TURNS_IN_PLACE)
        tried = list[_Attempt]()
        for pairs in (
            self._even_ramps(),
            self._uneven_ramps(0, tried),
            self._uneven_ramps(1, tried),
        ):
            tried += [self._attempt(*pair) for pair in pairs]
        for each in sorted(tried, key=lambda each: each.cost):
            motion = self._on_path(each)
            if motion is not None:
                return SolveResult(
                    SolveStatus.SOLVED,
                    SolveReason.CONVERGED,
                    len(tried),
                    len(tried),
                    motion,
                    stationarity=0.0,
                )
        too_fast = any(each.too_fast for each in tried)
        reason = SolveReason.FIXED_SPEED_TOO_FAST if too_fast else SolveReason.FIXED_SPEED_NOT_HELD
        return SolveResult(SolveStatus.FAILED, reason, len(tried), len(tried))

    def _attempt(self, first: float, last: float) -> _Attempt:
        checkpoint()

        def compute() -> EvenMotion:
            motion = self._motion(first, last, EVEN_SPEED.spans)
            return motion, motion is not None and self._is_within_limits(motion)

        motion, within = self.prepared.followed.even_motion(self.path, first, last, compute)
        cost = self._cost(motion) if motion is not None and within else np.inf
        return _Attempt(
            (first, last), motion if within else None, cost, motion is not None and not within
        )

    def _on_path(self, attempt: _Attempt) -> Spline | None:
        """The motion, with more spans if it leaves its path too far; None without a motion."""
        motion = attempt.motion
        if motion is None or self.keeps(motion):
            return motion
        for spans in EVEN_SPEED.spans[1:]:
            finer = self._motion(*attempt.times, (spans,))
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
        count = EVEN_SPEED.samples_per_point * len(self.path.control_points)
        return np.linspace(0.0, 1.0, count)

    @cached_property
    def _pace(self) -> Array:
        """Length of the TCP's path per unit of the joint path (k,) [m]."""
        return self._speeds(self.path.curve(self._at), self.path.curve(self._at, 1))

    @cached_property
    def _travelled(self) -> Array:
        """Length of the TCP's path so far (k,) [m]."""
        return np.asarray(CubicSpline(self._at, self._pace).antiderivative()(self._at))

    @cached_property
    def _fraction(self) -> CubicSpline:
        """Fraction of the joint path after a length of the TCP's path [m]."""
        return CubicSpline(self._travelled, self._at)

    @cached_property
    def _bounds(self) -> tuple[float, float]:
        """Smallest and largest mean time [s] of both ramps in the interval of durations."""
        even = float(self._travelled[-1]) / self.speed
        return self.interval.t_min - even, self.interval.t_max - even

    @cached_property
    def _longest(self) -> float:
        """Longest time [s] of a ramp."""
        return 2 * EVEN_SPEED.used_ramp * self._least_speed.ramp / self.speed

    def _even_ramps(self) -> Iterator[tuple[float, float]]:
        """Times [s] of two equal ramps, the longest first; then of shortest and longest motion."""
        tried = (self._longest * share for share in EVEN_SPEED.ramp_times)
        least, most = max(self._bounds[0], 0.0), min(self._bounds[1], self._longest)
        for time in (*tried, *self._bounds):
            if least <= time <= most and time > 0:
                yield time, time

    def _uneven_ramps(self, end: int, tried: list[_Attempt]) -> Iterator[tuple[float, float]]:
        """The best times [s] so far, with other times at one end."""
        best = min(tried, key=lambda each: each.cost, default=None)
        if best is None or best.motion is None:
            return
        for share in EVEN_SPEED.ramp_times:
            times = list(best.times)
            times[end] = self._longest * share
            known = any(each.times == tuple(times) for each in tried)
            if not known and self._bounds[0] <= sum(times) / 2 <= self._bounds[1]:
                yield times[0], times[1]

    def _motion(self, first: float, last: float, numbers: Sequence[int]) -> Spline | None:
        """Fit a motion.

        Args:
            first: time of the first ramp [s].
            last: time of the last ramp [s].
            numbers: numbers of spans, tried until the motion holds its speed.

        Returns:
            The motion; None if it does not hold its speed.
        """
        length = float(self._travelled[-1])
        duration = length / self.speed + (first + last) / 2
        for spans in numbers:
            breaks = _breaks(spans, first / duration, last / duration)
            t = instants_in_spans(breaks, EVEN_SPEED.fitted_per_span) * duration
            gone = np.where(
                t < duration / 2,
                _ramped(t, first, self.speed),
                length - _ramped(duration - t, last, self.speed),
            )
            q = self.path.curve(np.clip(self._fraction(gone), 0.0, 1.0))
            q[[0, -1]] = self.path.control_points[[0, -1]]
            knots = clamped(breaks)
            motion = Spline(DEGREE, knots * duration, fit(q, t / duration, knots))
            if self._deviation(motion, first, last) <= EVEN_SPEED.tolerance_used:
                return motion
        return None

    def _deviation(self, motion: Spline, first: float, last: float) -> float:
        """Largest deviation of the speed, relative to its tolerance; on ramps, excess alone."""
        assert self.prepared.problem.tool_path is not None
        t = instants_in_spans(np.unique(motion.knots), EVEN_SPEED.checked_per_span)
        q, v, _ = sample(motion, t)
        off = self._speeds(q, v) / self.speed - 1
        even = (t >= first) & (t <= motion.duration - last)
        return float(np.where(even, np.abs(off), off).max()) / TOOL_PATH.speed_tolerance

    def _is_within_limits(self, motion: Spline) -> bool:
        none, path = np.zeros(len(motion.control_points[0])), self.prepared.path
        excess = path_excess(self.prepared, motion, path, None)
        return repair_factors(self.prepared, motion, (none, none)) is None and not excess.any()


def _breaks(spans: int, first: float, last: float) -> Array:
    """Ends of spans (k,) in [0, 1]: evenly spaced, and within and beside ramps.

    Args:
        spans: number of evenly spaced spans.
        first: share of the time of the first ramp.
        last: share of the time of the last ramp.
    """
    breaks = np.unique(
        np.concatenate(
            [np.linspace(0.0, 1.0, spans + 1), _graded(first, spans), 1 - _graded(last, spans)]
        )
    )
    shortest = min(1 / spans, first / EVEN_SPEED.ramp_spans, last / EVEN_SPEED.ramp_spans)
    breaks = breaks[np.append(True, np.diff(breaks) > EVEN_SPEED.least_span * shortest)]
    breaks[-1] = 1.0
    return np.asarray(breaks)


def _graded(ramp: float, spans: int) -> Array:
    """Ends of spans (k,) from 0: of a ramp, and after it of spans that grow to evenly spaced ones.

    A kink of the jerk at the end of a ramp disturbs the fit over the length of the span after it.

    Args:
        ramp: share of the time of the ramp.
        spans: number of evenly spaced spans.
    """
    widths = [ramp / EVEN_SPEED.ramp_spans] * EVEN_SPEED.ramp_spans
    while (width := EVEN_SPEED.growth * widths[-1]) < 1 / spans:
        widths.append(width)
    ends = np.cumsum([0.0, *widths])
    return ends[ends < 1.0]


def _ramped(t: Array, ramp: float, speed: float) -> Array:
    """Length (k,) [m] after times t (k,) [s], for a ramp from rest [s] to a speed [m/s]."""
    x = np.clip(t / ramp, 0.0, 1.0)
    return np.asarray(speed * (ramp * (2.5 * x**4 - 3 * x**5 + x**6) + np.maximum(t - ramp, 0.0)))
