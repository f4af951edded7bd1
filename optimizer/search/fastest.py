"""The fastest motion over all candidates of a problem, and what to do if only that one is short
enough.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from joulepath.optimizer.bounds.missed_branches import all_branches_known
from joulepath.optimizer.deadline import Deadline, DeadlinePassed, watch
from joulepath.optimizer.motion.spline import Spline, lasting, sampled
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.result.energy import Energy
from joulepath.optimizer.search.attempts import solve_from, solver_of
from joulepath.optimizer.search.candidates import Candidate, Reason
from joulepath.optimizer.search.errors import DurationTooShort
from joulepath.optimizer.search.incumbent import Incumbent
from joulepath.optimizer.search.outer_turns import families_of
from joulepath.optimizer.search.quicker_ends import with_quicker_ends
from joulepath.optimizer.search.sampled_ends import fastest_samples
from joulepath.optimizer.solve.methods.duration_intervals import DurationInterval
from joulepath.optimizer.solve.methods.fastest_motion import FastestMotion, FastestSettings
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus

# motions that obstacles stop are not too slow if so many times the shortest duration is allowed
AMPLE = 20.0
# share of the time after which candidates, none of which has had a motion in the time that is
# allowed, give way to the search for the fastest motion
SHARE_IN_VAIN = 0.5
# samples whose ends are moved to where they are quicker, at most: each takes some 50 ms
MOST_MOVED = 12
# joint positions that differ by less are the same [rad]
SAME = 1e-9


@dataclass(frozen=True)
class Fastest:
    """The fastest motion found over all candidates, which the certificate confirms, and its
    candidate.

    No motion takes less than `bound` [s], 0 where that is not known. `proven`: none is faster, but
    for the share that `FastestSettings` allows. `cut_short`: the deadline ended the search.
    """

    candidate: Candidate
    spline: Spline
    bound: float
    proven: bool
    cut_short: bool

    @property
    def duration(self) -> float:
        """Its duration [s]."""
        return self.spline.duration

    @property
    def too_slow(self) -> DurationTooShort:
        """The error for a problem that allows no motion so slow."""
        return DurationTooShort(self.bound, self.duration, self.proven, self.cut_short)


class _FastestOfCandidate(FastestMotion):
    """The search for the fastest motion of one candidate."""

    def __init__(
        self,
        incumbent: Incumbent,
        candidate: Candidate,
        known: Sequence[Spline],
        settings: FastestSettings | None = None,
        wanted: float | None = None,
    ) -> None:
        ends = np.array([candidate.q_start, candidate.q_goal])
        own = [each for each in known if np.abs(each.control_points[[0, -1]] - ends).max() < SAME]
        self.incumbent, self.candidate = incumbent, candidate
        super().__init__(
            incumbent.prepared, candidate.q_start, candidate.q_goal, own, settings, wanted
        )

    @property
    def deadline(self) -> Deadline:
        return self.incumbent.deadline

    def solver(self, interval: DurationInterval) -> Method:
        return solver_of(self.incumbent, self.candidate, interval)

    def confirms(self, spline: Spline) -> bool:
        return self.incumbent.certified(self.candidate, spline, self.prepared.energy(spline)).valid

    def take_note(self, result: SolveResult) -> None:
        super().take_note(self.incumbent.add_effort(result))


def fastest(
    incumbent: Incumbent, known: Sequence[Spline] = (), wanted: float | None = None
) -> Fastest | None:
    """The fastest motion over all candidates; None if none is found. The durations that the problem
    allows do not count.

    It is no slower than the motions `known` between ends of candidates, if the certificate confirms
    them. With `wanted` [s] it is the first motion found that takes no longer, if there is one.
    """
    settings = FastestSettings()
    open_candidates = _tried(incumbent)
    searches, cut_short = list[_FastestOfCandidate](), False
    # what cannot beat the fastest motion known by more than counts is not looked at
    enough = np.inf

    def take_note(search: _FastestOfCandidate) -> None:
        nonlocal enough
        is_wanted = wanted is not None and search.duration <= wanted
        enough = 0.0 if is_wanted else min(enough, search.duration / (1 + settings.proven))

    for candidate in sorted(open_candidates, key=lambda each: each.shortest):
        if candidate.shortest >= enough:
            break
        if incumbent.deadline.passed:
            cut_short = True
            break
        searches.append(_FastestOfCandidate(incumbent, candidate, known, settings, wanted))
        searches[-1].look_quickly()
        take_note(searches[-1])
    searches.sort(key=lambda each: each.duration)
    for search in searches[: settings.most_thorough]:
        if search.bound < enough:
            search.look_thoroughly()
            take_note(search)
    best = min(searches, key=lambda each: each.duration, default=None)
    if best is None or best.best is None:
        return None
    if all(each is not best.candidate for each in incumbent.candidates):
        incumbent.candidates.append(best.candidate)
    bound = least_duration(incumbent)
    proven = best.duration <= bound * (1 + settings.proven)
    cut_short = not proven and (cut_short or any(each.cut_short for each in searches))
    return Fastest(best.candidate, best.best, bound, proven, cut_short)


def _tried(incumbent: Incumbent) -> list[Candidate]:
    """The candidates of which the fastest may be one: all but samples, the samples of least
    duration, and others of the same targets that are quicker still."""
    candidates, prepared = incumbent.candidates, incumbent.prepared
    tried = [each for each in candidates if each.holdable and not each.deferred] + fastest_samples(
        candidates
    )
    samples = (
        [] if prepared.problem.tool_path is not None else [each for each in tried if each.sampled]
    )
    quicker = list[Candidate | None]()
    with suppress(DeadlinePassed), watch(incumbent.deadline):
        for each in sorted(samples, key=lambda each: each.shortest)[:MOST_MOVED]:
            quicker.append(with_quicker_ends(prepared, each))
    return tried + [each for each in quicker if each is not None and each.holdable]


def fastest_of(
    incumbent: Incumbent, candidate: Candidate, known: Sequence[Spline] = ()
) -> Spline | None:
    """The fastest motion of one candidate, whatever durations the problem allows; None if none is
    found.
    """
    return _FastestOfCandidate(incumbent, candidate, known).run()


def least_duration(incumbent: Incumbent) -> float:
    """What no motion of a problem takes less than [s]; 0 where some configurations of its ends are
    not known.
    """
    candidates = incumbent.candidates
    if any(each.sampled for each in candidates) or not all_branches_known(incumbent.problem):
        return 0.0
    return max(min(each.shortest for each in candidates), incumbent.prepared.least_time)


def explore_or_find_fastest(
    incumbent: Incumbent,
    explore: Callable[[], None],
    known: Sequence[Spline] = (),
    beside: tuple[Candidate, SolveResult, Energy] | None = None,
) -> None:
    """Solve candidates by `explore`; if none has a motion in the time that is allowed, take the
    fastest motion.

    The motion `beside` counts as well. While several candidates are tried in vain, time is left for
    the search of the fastest motion. Raises DurationTooShort.
    """
    limited, candidates = incumbent.problem.duration_max is not None, incumbent.candidates
    if limited and len(candidates) > 1 and not families_of(incumbent):
        end, incumbent.end = incumbent.end, incumbent.end.within(SHARE_IN_VAIN * incumbent.end.left)
        explore()
        was_late, incumbent.end = incumbent.deadline.passed, end
        if incumbent.best() is None:
            find_fastest(incumbent, known)
        if was_late:
            # what was left open is solved in the rest of the time
            incumbent.cut_short = any(
                each.attempt is not None and each.attempt.cut_short for each in candidates
            )
            explore()
    else:
        explore()
    if beside is not None:
        incumbent.accept_if_better(*beside)
    if incumbent.best() is None:
        find_fastest(incumbent, known)


def find_fastest(incumbent: Incumbent, known: Sequence[Spline] = (), improve: bool = True) -> None:
    """Called when no candidate has a motion within `duration_max`: take the fastest motion if it is
    in time.

    It is slowed to the least duration allowed, and optimised from there if it is to `improve`.

    Raises DurationTooShort if even the fastest motion found takes longer.
    """
    longest = incumbent.problem.duration_max
    shortest = min(candidate.shortest for candidate in incumbent.candidates)
    if longest is None or (_are_stopped_by_obstacles(incumbent) and longest > AMPLE * shortest):
        return
    found = fastest(incumbent, known, longest if longest >= shortest else None)
    if found is None:
        if shortest > longest:
            raise DurationTooShort(least_duration(incumbent), cut_short=incumbent.deadline.passed)
        return
    candidate = found.candidate
    # rounding may leave it a little longer than the same motion that was found before
    spline = incumbent.allowed(
        lasting(found.spline, max(found.duration, incumbent.problem.duration_min or 0.0))
    )
    if spline is None:
        raise found.too_slow
    candidate.deferred = False
    if candidate.reason is Reason.NOT_CONFIRMED:
        candidate.settle(CandidateStatus.UNVISITED, Reason.NOT_REACHED)
    energy = incumbent.confirmed_energy(candidate, spline)
    if energy is not None:
        result = SolveResult(SolveStatus.SOLVED, SolveReason.FASTEST_MOTION_RETIMED, spline=spline)
        incumbent.accept_if_better(candidate, result, energy)
    incumbent.cut_short |= incumbent.deadline.passed
    if improve:
        solve_from(incumbent, candidate, sampled(spline), fine=True)
    if found.duration > longest and incumbent.best() is None:
        raise found.too_slow
    # a motion that is only the fastest one is no optimum
    incumbent.cut_short |= candidate.attempt is not None and candidate.attempt.spline is spline


def _are_stopped_by_obstacles(incumbent: Incumbent) -> bool:
    """Whether all candidates that failed did so because of a collision."""
    failed = [each.attempt for each in incumbent.candidates if each.attempt is not None]
    return bool(failed) and all(result.collision is not None for result in failed)
