"""Motions of least energy where every joint's power has a corner of its own: restarts, finer
motions, sharper corners.

The mechanical objective is the integral of Σ_j |tau_j v_j|, and an isolated bus draws Σ_j max(P_j,
0). The NLP smooths these corners over `SMOOTHING.power_width`. Every joint has one, so that the
optimum of the smoothed cost lies some percent above the least energy. Sharp corners from the start
would leave the SQP in poor local optima. So the optimum is followed from one width to the next, in
a space fine enough for the short pushes of such motions. On an isolated bus, it is followed back to
the first width in between: sharp corners hold a motion in an optimum that smooth ones lead out of.

The mechanical work of a motion has many local optima. As rest costs nothing, the best of them
swing, push and rest, which few control points hardly show. Coarse solves from random motions are
cheap; the best of them are followed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.plant import SMOOTHING, has_corners
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.motion.spline import Spline, lasting, sampled
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.search.attempts import in_time, solve_from, solver_of
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.incumbent import Incumbent
from joulepath.optimizer.search.random_displacements import random_displacements
from joulepath.optimizer.solve.methods.duration_intervals import (
    DurationInterval,
    duration_intervals,
)

# random motions from which the coarse problem is solved, and how many of its solutions are solved
# in the middle space
RESTARTS, FOLLOWED = 8, 3
# control points of the restarts, between them and the last motion, and of that
FEW, MIDDLE, DENSE = 13, 24, 40
# fixed durations, in multiples of the one found, in which the first motion on an isolated bus is
# solved in the middle space, too: from one duration to the next, the optimum of a free one may be
# in another basin, up to 1.7 % better
AROUND = (0.93, 0.95, 0.97, 0.99, 1.0, 1.02)
# relative decrease of the cost that a further step must promise, and in the last solve
PROGRESS, LAST_PROGRESS = 1e-3, 2e-4
# widths of the corners [W], and the decrease that a further step must promise, of the solves that
# follow a motion; with corners that only become sharper, two of 20 motions on an isolated bus ended
# 0.5 and 0.6 % too high
STEPS = (
    (SMOOTHING.sharper_power_widths[0], PROGRESS),
    (SMOOTHING.sharper_power_widths[1], LAST_PROGRESS),
)
ISOLATED_STEPS = (
    (SMOOTHING.sharper_power_widths[0], PROGRESS),
    (SMOOTHING.power_width, LAST_PROGRESS),
    (SMOOTHING.sharper_power_widths[0], LAST_PROGRESS),
)
# first solves are rough and coarse: those that need at most this ratio of the least energy are
# solved in the middle space, and so many of them
CONTENDING, CONTENDERS = 1.35, 6
# then other candidates are followed if they need at most this ratio of the least energy, and so
# many of them; they are given up once they need more than the last ratio of what the best one
# needed at the same width
NEAR, RIVALS, BEHIND = 1.03, 2, 1.005
# share by which a motion needs more before its corners are as sharp as they become
ROUNDER = 1.015
# a motion shorter than this ratio of the shortest duration switches at its limits: even spacing
# cannot represent it, and there is next to nothing to gain from sharper corners. Knots at the
# switches gain up to 0.3 %
LEAST_FREEDOM = 1.03


def sharpen(incumbent: Incumbent, best: Candidate) -> None:
    """Follow the best candidate, and those that need little more, to motions of sharp corners,
    while time is left.

    Does nothing if the objective has no corner per joint, or if the method has no evenly spaced
    control points.
    """
    problem = incumbent.problem
    if not incumbent.method.evenly_spaced or not has_corners(problem.objective, problem.arm):
        return
    if _is_nearly_fastest(incumbent, best):
        return
    if len(best.spline.control_points) == DENSE and problem.objective == "mechanical":
        # its corners are sharp
        return
    coarse = {id(each): each.spline for each in _near(incumbent, best, CONTENDING)[:CONTENDERS]}
    for rough in _near(incumbent, best, CONTENDING)[:CONTENDERS]:
        _Follower(incumbent, rough).solved(rough.spline, SMOOTHING.power_width, MIDDLE, PROGRESS)
    best = incumbent.best() or best
    rivals = _near(incumbent, best, NEAR)[1 : RIVALS + 1]
    follower, mechanical = _Follower(incumbent, best), problem.objective == "mechanical"
    if not mechanical:
        follower.solve_around(coarse.get(id(best), best.spline))
    ahead = follower.follow(restarts=RESTARTS if mechanical else 0)
    for rival in rivals:
        _Follower(incumbent, rival).follow(restarts=0, ahead=ahead)
    best = incumbent.best() or best
    if not mechanical and _is_nearly_fastest(incumbent, best) and not incumbent.deadline.passed:
        solve_from(incumbent, best, sampled(best.spline), fine=True)


def _is_nearly_fastest(incumbent: Incumbent, candidate: Candidate) -> bool:
    """Whether the motion of a solved candidate is so fast that it switches at its limits."""
    displacement = candidate.q_goal - candidate.q_start
    shortest = shortest_duration(displacement, incumbent.problem.arm.active_limits)
    return candidate.spline.duration < LEAST_FREEDOM * float(shortest)


def follow_in_time(incumbent: Incumbent, candidate: Candidate, best: float) -> None:
    """Follow a solved candidate to sharp corners, unless it turns out to need more than `best` [J];
    inf if none is known."""
    follower = _Follower(incumbent, candidate)
    if len(candidate.spline.control_points) != MIDDLE:
        follower.solved(candidate.spline, SMOOTHING.power_width, MIDDLE, PROGRESS)
    # with rounder corners it needs more
    follower.follow(
        restarts=0, ahead=[ROUNDER * best] * (len(STEPS) - 1) if np.isfinite(best) else []
    )


def _near(incumbent: Incumbent, best: Candidate, ratio: float) -> list[Candidate]:
    """The candidates with a motion of at most this ratio of the best one's energy, which comes
    first.
    """
    solved = [each for each in incumbent.candidates if each.energy is not None]
    most = ratio * (best.energy or 0.0)
    return sorted(
        (each for each in solved if each is best or (each.energy or 0.0) <= most), key=_energy_of
    )


def _energy_of(candidate: Candidate) -> float:
    return np.inf if candidate.energy is None else candidate.energy


@dataclass(frozen=True)
class _Follower:
    """Solves one candidate again. Motions that need less energy become the candidate's own."""

    incumbent: Incumbent
    candidate: Candidate

    def follow(self, restarts: int, ahead: Sequence[float] = ()) -> list[float]:
        """Solve with corners of one width after the other, from the candidate's motion or from the
        best of random ones.

        Returns the energies [J] at each width, inf without a motion. Ends early if one is far above
        that of `ahead`.
        """
        cost_of = self.incumbent.prepared.cost_of
        coarse = sorted(self._restarted(restarts), key=cost_of)[:FOLLOWED]
        middle = [self.solved(motion, SMOOTHING.power_width, MIDDLE, PROGRESS) for motion in coarse]
        best: Spline | None = min(
            [self.candidate.spline, *(each for each in middle if each is not None)], key=cost_of
        )
        energies: list[float] = []
        for width, progress in self._steps:
            best = None if best is None else self.solved(best, width, DENSE, progress)
            energies.append(cost_of(best))
            if len(ahead) >= len(energies) and energies[-1] > BEHIND * ahead[len(energies) - 1]:
                break
        return energies

    @property
    def _steps(self) -> tuple[tuple[float, float], ...]:
        """The width [W] and the progress of each solve that follows a motion."""
        is_mechanical = self.incumbent.problem.objective == "mechanical"
        return STEPS if is_mechanical else ISOLATED_STEPS

    def solve_around(self, coarse: Spline) -> None:
        """Solve from a coarse motion in fixed durations around that of the candidate's motion."""
        best = self.candidate.spline.duration
        interval = self._interval(best)
        for duration in (share * best for share in AROUND):
            if interval.t_min < duration < interval.t_max:
                q, t = sampled(lasting(coarse, duration))
                self._from_samples(q, t, SMOOTHING.power_width, MIDDLE, PROGRESS, fixed=True)

    def _restarted(self, count: int) -> list[Spline]:
        """Coarse motions from random displacements of the rest-to-rest quintic."""
        q_start, q_goal = self.candidate.q_start, self.candidate.q_goal
        limits = self.incumbent.problem.arm.active_limits
        line = quintic_spline(q_start, q_goal, self._interval(self.candidate.spline.duration).t_max)
        q, t = sampled(line)
        found = []
        for each in random_displacements(limits, line.duration, t / line.duration, count):
            guess = np.clip(q + each, limits.q_min, limits.q_max)
            motion = self._from_samples(guess, t, SMOOTHING.power_width, FEW, PROGRESS)
            if motion is not None:
                found.append(motion)
        return found

    def solved(self, spline: Spline, width: float, count: int, progress: float) -> Spline | None:
        """The motion solved with corners of `width` [W] on `count` control points; None if there is
        none in time.
        """
        interval = self._interval(spline.duration, width)
        duration = float(np.clip(spline.duration, interval.t_min, interval.t_max))
        return self._from_samples(*sampled(lasting(spline, duration)), width, count, progress)

    def _from_samples(
        self, q: Array, t: Array, width: float, count: int, progress: float, fixed: bool = False
    ) -> Spline | None:
        """The motion solved from samples q (k, nq) [rad] at t (k,) [s]; None if there is none or no
        time is left.

        `fixed`: it keeps its duration.
        """
        incumbent, candidate = self.incumbent, self.candidate
        if incumbent.deadline.passed:
            return None
        interval = self._interval(float(t[-1]), width)
        if fixed:
            interval = replace(interval, t_min=float(t[-1]), t_max=float(t[-1]))
        known = np.inf if candidate.energy is None else candidate.energy
        solver = solver_of(incumbent, candidate, interval, known)
        result = in_time(incumbent, partial(solver.solve_evenly, q, t, count, progress))
        if result.spline is not None:
            incumbent.accept_if_better(candidate, result, incumbent.prepared.energy(result.spline))
        return result.spline

    def _interval(self, duration: float, width: float = SMOOTHING.power_width) -> DurationInterval:
        """The interval of durations that holds `duration` [s]; the longest duration alone for
        mechanical work.

        Waiting needs no mechanical work: no duration needs less than the longest.
        """
        intervals = duration_intervals(self.incumbent.prepared, self.candidate.q_goal, width=width)
        interval = min(
            intervals, key=lambda each: max(each.t_min - duration, duration - each.t_max)
        )
        return (
            replace(interval, t_min=interval.t_max)
            if self.incumbent.problem.objective == "mechanical"
            else interval
        )
