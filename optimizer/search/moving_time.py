"""The time in which the arm moves for least mechanical work, before it rests.

Rest does no work, so more time never costs more. A solve over a long time, however, has evenly
spaced knots, too far apart for a swing of the arm, and ends in another local minimum than a solve
over a shorter time. Coarse motions tell in which part of the time the arm should move.
"""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.dynamics.plant import SMOOTHING
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.coarse_motions import COARSE, CoarseSolver
from joulepath.optimizer.search.least_work_settings import LEAST_WORK
from joulepath.optimizer.search.state import SearchState


@dataclass(frozen=True)
class MovingTimeSettings:
    """Settings of the search for the time in which the arm moves."""

    ratio: float = 0.7
    """Ratio of successive times."""
    least_ratio: float = 1.8
    """Least ratio of a time to the shortest duration of the joints: faster motions do more
    work."""
    long_ratio: float = 3.0
    """Ratio of the whole time to the shortest duration below which no shorter time is tried: none
    of 40 random moves of a UR5e needed less."""
    ample_ratio: float = 8.0
    """Greatest ratio of a time to the shortest duration. If more time is allowed, a shorter time is
    always worth a solve: over so long a time, the search also ranks the candidates poorly."""
    guesses: int = 16
    """Number of random guesses of a coarse motion."""
    promise: float = 0.97
    """Ratio to the coarse work over the whole time below which a shorter time is worth a solve."""
    equal: float = 1.02
    """Ratio of coarse works up to which the longer time is taken, in which friction is less."""


MOVING_TIME = MovingTimeSettings()


@dataclass(frozen=True)
class Swing:
    """A coarse motion that takes less than the whole time."""

    spline: Spline
    """The motion."""
    work: float
    """Mechanical work with penalties of exceeded limits [J]."""


def coarse_swing(state: SearchState, best: Candidate) -> Swing | None:
    """A coarse motion of a candidate that takes as long as the arm should move.

    Args:
        state: state of the search of a problem whose motions `may_rest`.
        best: the solved candidate of least work.

    Returns:
        The motion; None if less than the whole time promises hardly less work, and without time
        left or a compiled kernel.
    """
    settings, shortest = MOVING_TIME, best.shortest
    longest = state.problem.duration_max or best.duration
    ample, found = settings.ample_ratio * shortest, list[Swing]()
    if longest < settings.long_ratio * shortest:
        return None
    time = min(settings.ratio * longest, ample)
    while time > settings.least_ratio * shortest:
        if state.deadline.passed or not state.prepared.kernel.compiled:
            return None
        found.append(_swing(state, best, time))
        time *= settings.ratio
    if not found:
        return None
    least = min(each.work for each in found)
    if longest <= ample and least > settings.promise * _swing(state, best, longest).work:
        return None
    return next(each for each in found if each.work <= settings.equal * least)


def _swing(state: SearchState, candidate: Candidate, duration: float) -> Swing:
    """The best coarse motion of a candidate in a duration [s]."""
    solver = CoarseSolver(state.prepared, duration)
    best = solver.solved(
        [*solver.first([candidate]), *solver.random([candidate] * MOVING_TIME.guesses)],
        COARSE.control_points,
        SMOOTHING.power_width,
        LEAST_WORK.coarse_progress,
        LEAST_WORK.behind_ratio,
    )[0]
    return Swing(best.spline(duration), best.work)
