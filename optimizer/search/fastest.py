"""The fastest motion over all candidates, as answer if no other motion is short enough."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from joulepath.optimizer.bounds.missed_branches import all_branches_known
from joulepath.optimizer.deadline import Deadline, DeadlinePassed, watch
from joulepath.optimizer.motion.spline import Spline, lasting, sampled
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.attempts import solve_from, solver_of
from joulepath.optimizer.search.candidates import Candidate, Reason
from joulepath.optimizer.search.errors import DurationTooShort
from joulepath.optimizer.search.least_duration_ends import with_shorter_duration
from joulepath.optimizer.search.outer_turns import families_of
from joulepath.optimizer.search.sampled_ends import fastest_samples
from joulepath.optimizer.search.state import FoundMotion, SearchState
from joulepath.optimizer.solve.methods.duration_intervals import DurationInterval
from joulepath.optimizer.solve.methods.fastest_motion import FastestMotion, FastestSettings
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus


@dataclass(frozen=True)
class FastestSearchSettings:
    """Settings of the search for the fastest motion over all candidates."""

    ample_ratio: float = 20.0
    """Ratio of allowed to shortest duration above which obstacles, not time, stop motions."""
    explored_share: float = 0.5
    """Share of the time after which candidates without a motion give way to this search."""
    most_moved: int = 12
    """Largest number of samples whose ends are moved to shorter durations, about 50 ms each."""
    equal_distance: float = 1e-9
    """Displacement [rad] below which joint positions are equal."""


FASTEST = FastestSearchSettings()


@dataclass(frozen=True)
class Fastest:
    """The fastest certified motion over all candidates."""

    candidate: Candidate
    spline: Spline
    bound: float
    """Proven least duration of all motions [s]; 0 if it is not known."""
    proven: bool
    """Whether no motion is faster by more than the share in `FastestSettings`."""
    cut_short: bool
    """Whether the deadline ended the search."""

    @property
    def duration(self) -> float:
        """Duration of the motion [s]."""
        return self.spline.duration

    @property
    def too_slow(self) -> DurationTooShort:
        """The error for a problem with a shorter allowed duration than this motion."""
        return DurationTooShort(self.bound, self.duration, self.proven, self.cut_short)


class _FastestOfCandidate(FastestMotion):
    """The search for the fastest motion of one candidate."""

    def __init__(
        self,
        state: SearchState,
        candidate: Candidate,
        known: Sequence[Spline],
        settings: FastestSettings | None = None,
        wanted: float | None = None,
    ) -> None:
        ends = np.array([candidate.q_start, candidate.q_goal])
        own = [
            each
            for each in known
            if np.abs(each.control_points[[0, -1]] - ends).max() < FASTEST.equal_distance
        ]
        self.state, self.candidate = state, candidate
        super().__init__(state.prepared, candidate.q_start, candidate.q_goal, own, settings, wanted)

    @property
    def deadline(self) -> Deadline:
        return self.state.deadline

    def solver(self, interval: DurationInterval) -> Method:
        return solver_of(self.state, self.candidate, interval)

    def confirms(self, spline: Spline) -> bool:
        return self.state.certified(self.candidate, spline, self.prepared.energy(spline)).valid

    def take_note(self, result: SolveResult) -> None:
        super().take_note(self.state.add_effort(result))


def fastest(
    state: SearchState, known: Sequence[Spline] = (), wanted: float | None = None
) -> Fastest | None:
    """The fastest motion over all candidates; None if none is found.

    The search disregards the allowed durations of the problem, up to `DURATIONS.longest`. The
    motion is at least as fast as all known motions with a valid certificate.

    Args:
        state: state of the search.
        known: known motions between ends of candidates.
        wanted: sufficient duration [s]; None for the fastest motion.
    """
    settings = FastestSettings()
    open_candidates = [each for each in _tried(state) if each.shortest <= DURATIONS.longest]
    searches, cut_short = list[_FastestOfCandidate](), False
    # proven least duration above which a candidate cannot matter
    enough = np.inf

    def take_note(search: _FastestOfCandidate) -> None:
        nonlocal enough
        is_wanted = wanted is not None and search.duration <= wanted
        enough = 0.0 if is_wanted else min(enough, search.duration / (1 + settings.proven))

    for candidate in sorted(open_candidates, key=lambda each: each.shortest):
        if candidate.shortest >= enough:
            break
        if state.deadline.passed:
            cut_short = True
            break
        searches.append(_FastestOfCandidate(state, candidate, known, settings, wanted))
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
    if all(each is not best.candidate for each in state.candidates):
        state.candidates.append(best.candidate)
    bound = least_duration(state)
    proven = best.duration <= bound * (1 + settings.proven)
    cut_short = not proven and (cut_short or any(each.cut_short for each in searches))
    return Fastest(best.candidate, best.best, bound, proven, cut_short)


def _tried(state: SearchState) -> list[Candidate]:
    """Candidates for the fastest motion.

    The result has all candidates except samples, the samples of least duration, and further
    configurations of the same targets with even shorter durations.
    """
    candidates, prepared = state.candidates, state.prepared
    tried = [
        each for each in candidates if each.holdable and not each.deferred and not each.sampled
    ] + fastest_samples(candidates)
    samples = (
        [] if prepared.problem.tool_path is not None else [each for each in tried if each.sampled]
    )
    quicker = list[Candidate | None]()
    with suppress(DeadlinePassed), watch(state.deadline):
        for each in sorted(samples, key=lambda each: each.shortest)[: FASTEST.most_moved]:
            quicker.append(with_shorter_duration(prepared, each))
    return tried + [each for each in quicker if each is not None and each.holdable]


def fastest_of(
    state: SearchState, candidate: Candidate, known: Sequence[Spline] = ()
) -> Spline | None:
    """The fastest motion of one candidate, of any duration; None if none is found."""
    return _FastestOfCandidate(state, candidate, known).run()


def least_duration(state: SearchState) -> float:
    """Proven least duration of all motions [s]; 0 if some end configurations are unknown."""
    candidates = state.candidates
    if any(each.sampled for each in candidates) or not all_branches_known(state.problem):
        return 0.0
    return max(min(each.shortest for each in candidates), state.prepared.least_time)


def explore_or_find_fastest(
    state: SearchState,
    explore: Callable[[], None],
    known: Sequence[Spline] = (),
    other: FoundMotion | None = None,
) -> None:
    """Solve candidates; if none has a motion of an allowed duration, take the fastest motion.

    The solves of several candidates leave time for the search of the fastest motion.

    Args:
        state: state of the search.
        explore: solves candidates.
        known: known motions between ends of candidates.
        other: a motion of another search, considered as well.

    Raises:
        DurationTooShort: the fastest motion takes longer than allowed.
    """
    limited, candidates = state.problem.duration_max is not None, state.candidates
    if limited and len(candidates) > 1 and not families_of(state):
        end, state.end = state.end, state.end.within(FASTEST.explored_share * state.end.left)
        explore()
        was_late, state.end = state.deadline.passed, end
        if state.best() is None:
            find_fastest(state, known)
        if was_late:
            # candidates left open are solved in the rest of the time
            state.cut_short = any(
                each.attempt is not None and each.attempt.cut_short for each in candidates
            )
            explore()
    else:
        explore()
    if other is not None:
        state.accept_if_better(other.candidate, other.result, other.energy)
    if state.best() is None:
        find_fastest(state, known)


def find_fastest(state: SearchState, known: Sequence[Spline] = (), improve: bool = True) -> None:
    """Take the fastest motion if no candidate has a motion within `duration_max`.

    It is slowed down to the least duration allowed.

    Args:
        state: state of the search.
        known: known motions between ends of candidates.
        improve: whether it is optimised further.

    Raises:
        DurationTooShort: the fastest motion takes longer than allowed.
    """
    longest = state.problem.duration_max
    shortest = min(candidate.shortest for candidate in state.candidates)
    if longest is None or (
        _are_stopped_by_obstacles(state) and longest > FASTEST.ample_ratio * shortest
    ):
        return
    found = fastest(state, known, longest if longest >= shortest else None)
    if found is None:
        if shortest > longest:
            raise DurationTooShort(least_duration(state), cut_short=state.deadline.passed)
        return
    candidate = found.candidate
    # rounding may make it a little longer than the same motion found before
    spline = state.allowed(
        lasting(found.spline, max(found.duration, state.problem.duration_min or 0.0))
    )
    if spline is None:
        raise found.too_slow
    candidate.deferred = False
    if candidate.reason is Reason.NOT_CONFIRMED:
        candidate.settle(CandidateStatus.UNVISITED, Reason.NOT_REACHED)
    energy = state.confirmed_energy(candidate, spline)
    if energy is not None:
        result = SolveResult(SolveStatus.SOLVED, SolveReason.FASTEST_MOTION_RETIMED, spline=spline)
        state.accept_if_better(candidate, result, energy, certified=True)
    state.cut_short |= state.deadline.passed
    if improve:
        solve_from(state, candidate, sampled(spline), fine=True)
    if found.duration > longest and state.best() is None:
        raise found.too_slow
    # the fastest motion alone is no optimum
    state.cut_short |= candidate.attempt is not None and candidate.attempt.spline is spline


def _are_stopped_by_obstacles(state: SearchState) -> bool:
    """Whether all failed candidates failed because of a collision."""
    failed = [each.attempt for each in state.candidates if each.attempt is not None]
    return bool(failed) and all(result.collision is not None for result in failed)
