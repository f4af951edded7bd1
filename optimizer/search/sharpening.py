"""Refinement of motions whose cost has a corner in every joint's power.

The mechanical objective is the integral of Σ_j |tau_j v_j|, and an isolated bus draws Σ_j max(P_j,
0). The NLP smooths these corners over `SMOOTHING.power_width`. Because every joint has one, the
optimum of the smoothed cost lies some percent above the least energy. Sharp corners from the start
would leave the SQP in poor local optima. So the optimum is followed from one width to the next, in
a space fine enough for the short pushes of such motions. On an isolated bus, it is followed back to
the first width in between: sharp corners hold a motion in an optimum that smooth corners lead out
of.

The mechanical work of a motion has many local optima. As rest costs nothing, the best of them
swing, push and rest, which few control points hardly represent. Coarse solves from random motions
are cheap; the best of them are followed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.plant import SMOOTHING, has_corners
from joulepath.optimizer.motion.spline import Spline, lasting, sampled
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.search.attempts import attempted, context_of, solve_from
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.random_displacements import random_displacements
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods.duration_intervals import (
    DurationInterval,
    interval_around,
)


@dataclass(frozen=True)
class CornerStep:
    """Settings of one solve that follows a motion."""

    width: float
    """Width of the smoothed corners [W]."""
    progress: float
    """Relative decrease of the cost promised by a further step at least."""


@dataclass(frozen=True)
class SharpeningSettings:
    """Settings of the refinement of motions with corners."""

    restarts: int = 8
    """Number of random motions from which the coarse problem is solved."""
    followed: int = 3
    """Number of coarse motions solved in the middle space."""
    coarse_points: int = 13
    """Number of control points of coarse motions."""
    middle_points: int = 24
    """Number of control points of the middle space."""
    dense_points: int = 40
    """Number of control points of the last motion."""
    duration_ratios: tuple[float, ...] = (0.93, 0.95, 0.97, 0.99, 1.0, 1.02)
    """Fixed durations, in multiples of the duration found, for which a motion on an isolated bus is
    solved in the middle space, too.

    Solves with near durations may find another basin than the solve with a free duration, up to
    1.7 % better.
    """
    progress: float = 1e-3
    """Smallest predicted relative decrease of the cost for a further step."""
    last_progress: float = 2e-4
    """Smallest predicted relative decrease of the cost for a further step of the last solves."""
    coarse_ratio: float = 1.35
    """Largest ratio of a first motion's energy to the least if it is solved in the middle space."""
    most_coarse: int = 6
    """Largest number of first motions solved in the middle space."""
    rounder_ratio: float = 1.015
    """Ratio of a motion's energy before its corners are as sharp as possible to its last energy."""
    fast_ratio: float = 1.03
    """Ratio of the duration to the shortest below which a motion switches at its limits.

    Evenly spaced knots cannot represent it, and sharper corners gain next to nothing. Knots at the
    switches gain up to 0.3 %.
    """

    @property
    def steps(self) -> tuple[CornerStep, ...]:
        """Solves that follow a motion of least mechanical work."""
        return (
            CornerStep(SMOOTHING.sharper_power_widths[0], self.progress),
            CornerStep(SMOOTHING.sharper_power_widths[1], self.last_progress),
        )

    @property
    def isolated_steps(self) -> tuple[CornerStep, ...]:
        """Solves that follow a motion on an isolated bus.

        With corners that only become sharper, two of 20 motions ended 0.5 and 0.6 % too high.
        """
        return (
            CornerStep(SMOOTHING.sharper_power_widths[0], self.progress),
            CornerStep(SMOOTHING.power_width, self.last_progress),
            CornerStep(SMOOTHING.sharper_power_widths[0], self.last_progress),
        )


SHARPENING = SharpeningSettings()


def sharpen(state: SearchState, best: Candidate) -> None:
    """Follow the best candidate to a motion of sharp corners.

    Candidates of little more energy are solved in the middle space before. Without corners in the
    objective, or without evenly spaced control points in the method, it does nothing.
    """
    problem = state.problem
    if not state.method.evenly_spaced or not has_corners(problem.objective, problem.arm):
        return
    if state.lasts_below(SHARPENING.fast_ratio, best):
        return
    if (
        len(best.spline.control_points) == SHARPENING.dense_points
        and problem.objective == "mechanical"
    ):
        # its corners are sharp already
        return
    contenders = _contenders(state, best)
    coarse = {each: each.spline for each in contenders}
    for contender in contenders:
        _Follower(state, contender).solve_in_middle_space()
    best = state.best() or best
    follower, mechanical = _Follower(state, best), problem.objective == "mechanical"
    if not mechanical:
        follower.solve_around(coarse.get(best, best.spline))
    # with ends that slide, motions from random starts are known already
    restarts = SHARPENING.restarts if mechanical and not state.sliding_work_sought else 0
    follower.follow(restarts)
    best = state.best() or best
    if (
        not mechanical
        and state.lasts_below(SHARPENING.fast_ratio, best)
        and not state.deadline.passed
    ):
        solve_from(state, best, sampled(best.spline), fine=True)


def follow_in_time(state: SearchState, candidate: Candidate, best: float) -> None:
    """Follow a candidate to sharp corners, unless it comes to need more than an energy.

    Args:
        state: state of the search.
        candidate: solved candidate.
        best: least known energy [J]; inf if none is known.
    """
    follower = _Follower(state, candidate)
    if len(candidate.spline.control_points) != SHARPENING.middle_points:
        follower.solve_in_middle_space()
    # with rounder corners it needs more
    follower.follow(restarts=0, most=SHARPENING.rounder_ratio * best)


def _contenders(state: SearchState, best: Candidate) -> list[Candidate]:
    """The candidates of least energy, up to `coarse_ratio` times the best energy."""
    most = SHARPENING.coarse_ratio * (best.energy or 0.0)
    solved = [each for each in state.candidates if each.energy is not None]
    near = (each for each in solved if each is best or (each.energy or 0.0) <= most)
    return sorted(near, key=lambda each: each.energy or 0.0)[: SHARPENING.most_coarse]


@dataclass(frozen=True)
class _Follower:
    """Solves one candidate again; motions of less energy become the candidate's own."""

    state: SearchState
    candidate: Candidate

    def follow(self, restarts: int, most: float = np.inf) -> None:
        """Solve with corners of one width after the other.

        It starts from the candidate's motion or the best of motions from random starts.

        Args:
            restarts: number of random starts.
            most: energy at a width above which the candidate is given up [J].
        """
        cost_of = self.state.prepared.cost_of
        coarse = sorted(self._restarted(restarts), key=cost_of)[: SHARPENING.followed]
        middle = [
            self.solved(
                motion, SMOOTHING.power_width, SHARPENING.middle_points, SHARPENING.progress
            )
            for motion in coarse
        ]
        motion = min(
            [self.candidate.spline, *(each for each in middle if each is not None)], key=cost_of
        )
        is_mechanical = self.state.problem.objective == "mechanical"
        for step in SHARPENING.steps if is_mechanical else SHARPENING.isolated_steps:
            found = self.solved(motion, step.width, SHARPENING.dense_points, step.progress)
            if found is None or cost_of(found) > most:
                return
            motion = found

    def solve_in_middle_space(self) -> None:
        """Solve from the candidate's motion in the middle space, with wide corners."""
        motion = self.candidate.spline
        self.solved(motion, SMOOTHING.power_width, SHARPENING.middle_points, SHARPENING.progress)

    def solve_around(self, coarse: Spline) -> None:
        """Solve from a coarse motion in fixed durations around the duration of the candidate's
        motion.
        """
        best = self.candidate.spline.duration
        interval = self._interval(best)
        for duration in (share * best for share in SHARPENING.duration_ratios):
            if interval.t_min < duration < interval.t_max:
                q, t = sampled(lasting(coarse, duration))
                count, progress = SHARPENING.middle_points, SHARPENING.progress
                self._from_samples(q, t, SMOOTHING.power_width, count, progress, fixed=True)

    def _restarted(self, count: int) -> list[Spline]:
        """Coarse motions from random displacements of the rest-to-rest quintic."""
        q_start, q_goal = self.candidate.q_start, self.candidate.q_goal
        limits = self.state.problem.arm.active_limits
        line = quintic_spline(q_start, q_goal, self._interval(self.candidate.spline.duration).t_max)
        q, t = sampled(line)
        found = []
        for each in random_displacements(limits, line.duration, t / line.duration, count):
            guess = np.clip(q + each, limits.q_min, limits.q_max)
            motion = self._from_samples(
                guess, t, SMOOTHING.power_width, SHARPENING.coarse_points, SHARPENING.progress
            )
            if motion is not None:
                found.append(motion)
        return found

    def solved(self, spline: Spline, width: float, count: int, progress: float) -> Spline | None:
        """The motion solved from another one; None if there is none in time.

        Args:
            spline: motion to start from.
            width: width of the smoothed corners [W].
            count: number of control points.
            progress: relative decrease of the cost promised by a further step at least.
        """
        interval = self._interval(spline.duration, width)
        duration = float(np.clip(spline.duration, interval.t_min, interval.t_max))
        return self._from_samples(*sampled(lasting(spline, duration)), width, count, progress)

    def _from_samples(
        self, q: Array, t: Array, width: float, count: int, progress: float, fixed: bool = False
    ) -> Spline | None:
        """The motion solved from samples; None if there is none or no time is left.

        Args:
            q: samples, shape (k, nq) [rad].
            t: their times, shape (k,) [s].
            width: width of the smoothed corners [W].
            count: number of control points.
            progress: relative decrease of the cost promised by a further step at least.
            fixed: whether the motion keeps its duration.
        """
        state, candidate = self.state, self.candidate
        if state.deadline.passed:
            return None
        interval = self._interval(float(t[-1]), width)
        if fixed:
            interval = replace(interval, t_min=float(t[-1]), t_max=float(t[-1]))
        known = np.inf if candidate.energy is None else candidate.energy
        result, moved = attempted(
            state,
            candidate,
            partial(context_of, state, candidate, interval, known),
            lambda solver: solver.solve_evenly(q, t, count, progress),
        )
        if result.spline is not None:
            energy = state.prepared.energy(result.spline)
            state.accept_if_better(candidate, result, energy, moved)
        return result.spline

    def _interval(self, duration: float, width: float = SMOOTHING.power_width) -> DurationInterval:
        """The interval of durations around a duration [s]; for mechanical work, the longest
        duration.

        Rest needs no mechanical work: no duration needs less than the longest.
        """
        prepared, q_goal = self.state.prepared, self.candidate.q_goal
        interval = interval_around(prepared, q_goal, duration, width)
        return (
            replace(interval, t_min=interval.t_max)
            if self.state.problem.objective == "mechanical"
            else interval
        )
