"""The fastest motion: over one candidate, over all of them, and what to do if only that one is short enough."""

from __future__ import annotations

from functools import partial

from optimizer.exceptions import DurationTooShort
from optimizer.methods.duration_intervals import fastest as all_durations
from optimizer.search.attempts import in_time, solve_from, solver_of
from optimizer.search.candidates import Candidate
from optimizer.search.incumbent import Incumbent
from optimizer.search.sampled_ends import activate_deferred
from optimizer.trajectories.spline import Spline, sampled

# motions that obstacles stop are not too slow if so many times the shortest duration is allowed
AMPLE = 20.0


def find_fastest(incumbent: Incumbent) -> None:
    """Called when no candidate has a motion within `duration_max`: optimise from the fastest motion if it is in time.

    Raises DurationTooShort if even the fastest motion found takes longer.
    """
    longest = incumbent.problem.duration_max
    if longest is None or (_are_stopped_by_obstacles(incumbent) and longest > AMPLE * _least_duration(incumbent)):
        return
    found = fastest(incumbent)
    if found is None:
        least = _least_duration(incumbent)
        if least > longest:
            raise DurationTooShort(least)
        return
    candidate, spline = found
    if spline.duration > longest:
        raise DurationTooShort(spline.duration)
    solve_from(incumbent, candidate, sampled(spline), fine=True)


def _least_duration(incumbent: Incumbent) -> float:
    """The least lower bound on the duration [s] of any candidate."""
    return min(candidate.shortest for candidate in incumbent.candidates)


def _are_stopped_by_obstacles(incumbent: Incumbent) -> bool:
    """Whether all candidates that failed did so because of a collision."""
    failed = [each.attempt for each in incumbent.candidates if each.attempt is not None]
    return bool(failed) and all(result.collision is not None for result in failed)


def fastest(incumbent: Incumbent) -> tuple[Candidate, Spline] | None:
    """The fastest motion over all candidates, and its candidate; None if the deadline passes before one is found.

    The durations that the problem allows do not count.
    """
    activate_deferred(incumbent.candidates)
    winner, best = None, None
    open_candidates = [each for each in incumbent.candidates if each.holdable and not each.deferred]
    for candidate in sorted(open_candidates, key=lambda each: each.shortest):
        if (best is not None and candidate.shortest >= best.duration) or incumbent.deadline.passed:
            break
        spline = fastest_of(incumbent, candidate)
        if spline is not None and (best is None or spline.duration < best.duration):
            winner, best = candidate, spline
    return None if winner is None or best is None else (winner, best)


def fastest_from(incumbent: Incumbent, candidate: Candidate, spline: Spline) -> Spline | None:
    """The fastest motion of one candidate, optimised from one of its motions; None if none was found."""
    solver = solver_of(incumbent, candidate, all_durations(incumbent.prepared))
    return in_time(incumbent, partial(solver.solve_from, *sampled(spline), fine=False)).spline


def fastest_of(incumbent: Incumbent, candidate: Candidate) -> Spline | None:
    """The fastest motion of one candidate, whatever durations the problem allows; None if none was found."""
    return in_time(incumbent, solver_of(incumbent, candidate, all_durations(incumbent.prepared)).solve).spline
