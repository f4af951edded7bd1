"""Least mechanical work at a fixed duration: candidates are compared by rough motions, and few are
solved.

The bound on mechanical work rules out little, and a motion has many local optima. Rough motions
take a fifth of the time of solves (`batched_motions`): those of tens of candidates, then of the
best on more control points and from random guesses. They may collide, and exceed a limit by a
little. So the motion of least work among those that do not collide is solved, with sharp corners.
Then every candidate is solved whose rough motion promises less than what is found.

Where no motion is found here, all candidates are solved as with other objectives: by `outer_turns`
and `sharpening`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.dynamics.plant import SMOOTHING
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.attempts import in_time, solver_of
from joulepath.optimizer.search.candidates import Candidate, Reason
from joulepath.optimizer.search.incumbent import Incumbent
from joulepath.optimizer.search.outer_turns import FAMILIES, MEMBERS, NEAR, families_of, leave
from joulepath.optimizer.search.rough_work import COARSE, Rough, RoughWork, best_of_each
from joulepath.optimizer.search.sharpening import (
    DENSE,
    LAST_PROGRESS,
    LEAST_FREEDOM,
    MIDDLE,
    PROGRESS,
    follow_in_time,
)
from joulepath.optimizer.solve.methods.duration_intervals import duration_intervals
from joulepath.optimizer.solve.methods.method import above
from joulepath.optimizer.solve.methods.refined_work import refine_work
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from joulepath.optimizer.solve.methods.spline_spaces import SPLINE_SPACES

# time [s] that the search needs to be sure of a motion
LEAST_TIME = 3.0
# candidates whose rough motions are found at a time, in order of their lower bounds
AT_ONCE = 12
# relative decreases that a further step must promise: on few control points, from random guesses,
# and on more control points
COARSE_PROGRESS, RESTART_PROGRESS, MIDDLE_PROGRESS = 2e-2, 2e-3, 2e-3
# motions are given up if they are expected to need more than this ratio of the least of all
BEHIND = 1.4
# those that need at most this ratio of the least work on few control points are solved on more of
# them, and so many
CONTENDING, CONTENDERS = 1.35, 8
# motions from random guesses that need more than this ratio of the least work on few control points
# are dropped. Half of them do: more control points take longest from there, and hardly ever make
# the best motion of one
HOPELESS = 1.6
# a batch of guesses has helped if a motion from one needs at most this ratio of the least work
# before
HELPFUL = 0.99
# motions without collisions that need at most this ratio of the least are followed, and so many
NEAR_BEST, RIVALS = 1.05, 6
# width of their corners [W] at first
FIRST_WIDTH = 0.2
# on as many control points as the last motion, and with sharp corners, a motion needs about this
# ratio of its work
PROMISE = 0.97
# a motion that collides must be below this multiple of the best energy without clearance
# constraints, and below this one before its corners are sharpened
WORTH, WORTH_SHARPENING = 1.05, 1.04


def explore_least_work(incumbent: Incumbent, explore: Callable[[], object]) -> bool:
    """Find motions as the module says; `explore` solves the candidates that are left open. False if
    none was found.

    Does nothing with another objective, a free duration, constraints along the path, or a tight
    bound, for which every candidate is solved; nor with little time, as the first motion comes
    late.
    """
    asked = incumbent.problem
    if incumbent.deadline.left < LEAST_TIME or not incumbent.prepared.kernel.compiled:
        return False
    families = families_of(incumbent)
    fixed = asked.duration_max is not None and asked.duration_min == asked.duration_max
    free = incumbent.prepared.path is None and not asked.passes and asked.tool_path is None
    if not (families and fixed and free) or any(
        each.attempt for family in families for each in family
    ):
        return False
    work = _LeastWork(
        incumbent, families, RoughWork(incumbent.prepared, float(asked.duration_max or 0.0))
    )
    waiting = [each for family in families for each in family[1:]]
    try:
        with watch(incumbent.deadline):
            work.search()
    except DeadlinePassed:
        incumbent.cut_short = True
    if incumbent.best() is None:
        return False
    left = [each for each in waiting if each.status is CandidateStatus.UNVISITED]
    behind = work.not_promising()
    for each in [*left, *behind]:
        each.deferred = True
    explore()
    # neither proves that they need more than the answer
    leave(incumbent, behind, Reason.ROUGHLY)
    leave(incumbent, left)
    return True


@dataclass(frozen=True)
class _Effort:
    """`restarts`: random guesses of the best candidate at most, in batches of `at_once`; one that
    does not help is the last. `sharpened`: how many of all motions get sharp corners, if they need
    at most `near` times the least before."""

    restarts: int
    at_once: int
    sharpened: int
    near: float


# The motion of least work often is a wide swing. Some percent of the guesses lead to it, and on few
# control points it does not stand out. Rough motions within some percent do not tell which needs
# the least once its corners are sharp. Where there are several candidates, finding the best of them
# has taken time already
SOLE, SEVERAL = _Effort(32, 32, 4, 1.03), _Effort(32, 8, 1, 1.0)


@dataclass(eq=False)
class _LeastWork:
    """The search. `rough` are the motions of least work that are known of its candidates by their
    ids, `tried` the candidates that were solved, `behind` those that turned out to need more than
    another one on the way."""

    incumbent: Incumbent
    families: list[list[Candidate]]
    work: RoughWork
    rough: dict[int, Rough] = field(default_factory=dict)
    tried: set[int] = field(default_factory=set)
    behind: set[int] = field(default_factory=set)

    def search(self) -> None:
        """Find rough motions, solve the best, then those that promise less."""
        self._screen()
        if not self.rough:
            return
        least = min(each.work for each in self.rough.values())
        contenders = [each for each in self._known() if each.work <= CONTENDING * least][
            :CONTENDERS
        ]
        contenders = self._note(
            self.work.solved(contenders, MIDDLE, SMOOTHING.power_width, MIDDLE_PROGRESS, BEHIND)
        )
        effort = SOLE if len(contenders) == 1 else SEVERAL
        again = self._restarted(contenders[0], effort)
        self._follow(self._clear(sorted([*contenders, *again], key=lambda each: each.work)), effort)
        self._solve_promising()

    def _restarted(self, best: Rough, effort: _Effort) -> list[Rough]:
        """Motions from random guesses of the best candidate, batch by batch as long as they
        help."""
        guesses, found, least = (
            self.work.random(best.candidate, effort.restarts),
            list[Rough](),
            best.work,
        )
        for k in range(0, len(guesses), effort.at_once):
            coarse = self.work.solved(
                guesses[k : k + effort.at_once],
                COARSE,
                SMOOTHING.power_width,
                RESTART_PROGRESS,
                BEHIND,
            )
            worth = [each for each in coarse if each.work <= HOPELESS * least]
            middle = self._note(
                self.work.solved(worth, MIDDLE, SMOOTHING.power_width, MIDDLE_PROGRESS, BEHIND)
            )
            found += middle
            before, least = least, min([least, *(each.work for each in middle)])
            if least > HELPFUL * before:
                break
        return found

    def _screen(self) -> None:
        """Rough motions of one member of each family, then of the best families' others."""
        firsts = sorted((family[0] for family in self.families), key=lambda each: each.lower_bound)
        for k in range(0, len(firsts), AT_ONCE):
            self._find(firsts[k : k + AT_ONCE])
        works = [self._work_of(family[0]) for family in self.families]
        near = [
            k for k in np.argsort(works, kind="stable").tolist() if works[k] <= NEAR * min(works)
        ]
        self._find([each for k in near[:FAMILIES] for each in self.families[k][1:MEMBERS]])

    def _find(self, candidates: Sequence[Candidate]) -> None:
        """Find rough motions of those candidates whose bounds do not rule them out."""
        least = min((each.work for each in self.rough.values()), default=np.inf)
        open_ = [each for each in candidates if each.lower_bound < least]
        self._note(
            self.work.solved(
                self.work.first(open_), COARSE, SMOOTHING.power_width, COARSE_PROGRESS, BEHIND
            )
        )

    def _note(self, found: list[Rough]) -> list[Rough]:
        """Keep the motions of least work of each candidate; returns what was found."""
        for each in best_of_each(found):
            if each.work < self._work_of(each.candidate):
                self.rough[id(each.candidate)] = each
        return found

    def _work_of(self, candidate: Candidate) -> float:
        known = self.rough.get(id(candidate))
        return np.inf if known is None else known.work

    def _known(self) -> list[Rough]:
        """The rough motions that are known, that of least work first."""
        return sorted(self.rough.values(), key=lambda each: each.work)

    def _clear(self, found: list[Rough]) -> list[Rough]:
        """Of motions in order of work, the first that does not collide, and others near it that do
        not, either.
        """
        clear: list[Rough] = []
        for each in found:
            if clear and (each.work > NEAR_BEST * clear[0].work or len(clear) == RIVALS):
                break
            if not any(each.is_like(other) for other in clear) and self._is_clear(each):
                clear.append(each)
        return clear

    def _is_clear(self, rough: Rough) -> bool:
        """Whether corners may be sharpened from a motion: it does not collide, and its time is not
        too short.
        """
        roomy = self.work.duration >= LEAST_FREEDOM * rough.candidate.shortest
        return (
            roomy
            and self.incumbent.prepared.surroundings.worst_violation(
                rough.spline(self.work.duration)
            )
            is None
        )

    def _follow(self, clear: list[Rough], effort: _Effort) -> None:
        """Follow motions to sharp corners, the best first."""
        made, least = 0, np.inf
        for each in clear:
            if made == effort.sharpened or each.work > effort.near * least:
                self.behind.add(id(each.candidate))
                continue
            made += 1
            if self._sharpen(each):
                # if there is none, there may be one with rounder corners
                least = min(least, each.work)
        self.behind -= self.tried

    def _sharpen(self, rough: Rough) -> bool:
        """Follow a motion to sharp corners, unless it is left behind on the way; whether one was
        found.
        """
        result = self._sharpened(rough)
        if result.spline is not None:
            self.tried.add(id(rough.candidate))
        elif result.status is SolveStatus.PRUNED:
            self.behind.add(id(rough.candidate))
        return result.spline is not None

    def _sharpened(self, rough: Rough) -> SolveResult:
        """A candidate's solve with sharp corners, from a rough motion; by the SQP, if it collides
        or fails.
        """
        incumbent, found = self.incumbent, list[Array]()

        def sharpen() -> SolveResult:
            points, first = rough.on(DENSE), FIRST_WIDTH
            result, points = refine_work(
                incumbent.prepared, points, self.work.duration, first, self._least_known
            )
            found.append(points)
            return result

        result = in_time(incumbent, sharpen)
        if result.spline is None and result.status is not SolveStatus.PRUNED and found:
            return self._solved(rough, found[0], SMOOTHING.sharper_power_widths[-1], LAST_PROGRESS)
        if result.spline is not None:
            incumbent.accept_if_better(
                rough.candidate, result, incumbent.prepared.energy(result.spline)
            )
            incumbent.tell_tried(rough.candidate)
        return result

    def _solve_promising(self) -> None:
        """Solve the candidates whose rough motions promise less than what is known, the most
        promising first.
        """
        for rough in self._known():
            candidate, known = rough.candidate, self._least_known
            if self._is_settled(candidate) or PROMISE * rough.work >= known:
                continue
            if np.isfinite(known) and self._is_clear(rough):
                self._sharpen(rough)
            if not self._is_settled(candidate):
                self.tried.add(id(candidate))
                result = self._solved(
                    rough, rough.on(MIDDLE), SMOOTHING.power_width, PROGRESS, above(known, WORTH)
                )
                if result.spline is not None and (candidate.energy or np.inf) < above(
                    known, WORTH_SHARPENING
                ):
                    follow_in_time(self.incumbent, candidate, known)

    def _is_settled(self, candidate: Candidate) -> bool:
        """Whether a candidate was solved, or given up as it seems to need more than another one."""
        return id(candidate) in self.tried | self.behind

    @property
    def _least_known(self) -> float:
        """Energy [J] of the best motion, inf without one."""
        best = self.incumbent.best()
        return np.inf if best is None or best.energy is None else best.energy

    def _solved(
        self, rough: Rough, points: Array, width: float, progress: float, below: float = np.inf
    ) -> SolveResult:
        """A candidate's solve from control points (n, nq) [rad], which it keeps; from nothing if
        that fails while no motion is known, or time is so short that knots must be at the switches
        of jerk."""
        incumbent, candidate = self.incumbent, rough.candidate
        interval = duration_intervals(incumbent.prepared, candidate.q_goal, width=width)[0]
        solver = solver_of(incumbent, candidate, interval, below)
        result = SolveResult(SolveStatus.FAILED, SolveReason.TOO_SHORT_FOR_EVEN_KNOTS)
        if self.work.duration >= SPLINE_SPACES.tight * candidate.shortest or len(points) == DENSE:
            space = bspline.uniform(len(points))
            attempt = partial(
                solver.solve_control_points, space, points, self.work.duration, progress
            )
            result = in_time(incumbent, attempt)
        if result.status is SolveStatus.FAILED and len(points) != DENSE:
            result = in_time(incumbent, solver.solve)
        incumbent.cut_short |= result.cut_short
        if result.spline is not None:
            incumbent.accept_if_better(candidate, result, incumbent.prepared.energy(result.spline))
        elif len(points) != DENSE and result.status in (SolveStatus.FAILED, SolveStatus.PRUNED):
            candidate.attempt = result
            candidate.settle(CandidateStatus(result.status.value), Reason.METHOD, result.message)
        if candidate.status is not CandidateStatus.UNVISITED:
            incumbent.tell_tried(candidate)
        return result

    def not_promising(self) -> list[Candidate]:
        """The candidates that are left whose rough motions do not promise less than what is
        known."""
        known = self._least_known
        return [
            each.candidate
            for each in self._known()
            if each.candidate.status is CandidateStatus.UNVISITED
            and (id(each.candidate) in self.behind or PROMISE * each.work >= known)
        ]
