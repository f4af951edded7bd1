"""Duration of the movement for least mechanical work, if the arm may rest afterwards.

Rest does no work, so the least work in a long time is at most the least work in a short time. A
solve over a long time may still end in a worse local minimum, because its evenly spaced knots are
too far apart for a swing of the arm. Coarse motions of several durations show how long the arm
should move.
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
    """Settings of the search for the duration of the movement.

    All durations are relative to the shortest duration of the joints.
    """

    ratio: float = 0.7
    """Ratio of two successive durations of coarse motions."""
    least_ratio: float = 1.8
    """Least duration of coarse motions: faster motions do more work."""
    long_ratio: float = 3.0
    """Allowed duration below which the search is left out. It found nothing better for 40 random
    moves of a UR5e with 1.5 to 3 times the shortest duration."""
    ample_ratio: float = 8.0
    """Greatest duration of coarse motions. If the allowed duration is longer, a shorter movement is
    always solved, because the ranking of candidates over a long time is poor."""
    guesses: int = 16
    """Number of random guesses of a coarse motion."""
    promise: float = 0.97
    """Ratio of coarse works below which a shorter movement is solved: the work in the shorter
    duration over the work in the allowed duration."""
    equal: float = 1.02
    """Ratio to the least coarse work up to which a longer duration is preferred. For a move of a
    Panda, the solve then ended at 46.7 J instead of 53.5 J."""


MOVING_TIME = MovingTimeSettings()


@dataclass(frozen=True)
class Swing:
    """A coarse motion that is shorter than the allowed duration."""

    spline: Spline
    """The motion."""
    work: float
    """Mechanical work with penalties of exceeded limits [J]."""


def coarse_swing(state: SearchState, best: Candidate) -> Swing | None:
    """A coarse motion of a candidate, of the duration in which the arm should move.

    Args:
        state: state of the search of a problem whose motions `may_rest`.
        best: solved candidate of least work.

    Returns:
        The motion; None if a shorter movement hardly promises less work, if the deadline has
        passed, if the kernel is not compiled, or with constraints along the path, of which coarse
        motions know nothing.
    """
    settings, shortest = MOVING_TIME, best.shortest
    longest = state.problem.duration_max or best.duration
    ample, found = settings.ample_ratio * shortest, list[Swing]()
    if longest < settings.long_ratio * shortest or state.prepared.path is not None:
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
