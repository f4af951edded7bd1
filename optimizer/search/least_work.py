"""Least mechanical work at a fixed duration: coarse motions select the candidates to be solved.

The bound on mechanical work rules out few candidates, and the work has many local minima. A coarse
motion takes a fifth of the time of a solve (`ManyMotions`). The search computes coarse motions of
tens of candidates, then of the best candidates with more control points and from random guesses.
Coarse motions may collide, and may slightly exceed limits. The search therefore solves the
collision-free coarse motion of least work, with sharp corners. It then solves every candidate with
a coarse motion of less work than the best motion found.

If this search finds no motion, all candidates are solved as for other objectives, by `outer_turns`
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
from joulepath.optimizer.search.coarse_motions import (
    COARSE,
    CoarseMotion,
    CoarseSolver,
    best_of_each,
)
from joulepath.optimizer.search.least_work_settings import LEAST_WORK, RestartSettings
from joulepath.optimizer.search.outer_turns import FAMILIES, families_of, settle_waiting
from joulepath.optimizer.search.sharpening import SHARPENING, follow_in_time
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods.duration_intervals import duration_intervals
from joulepath.optimizer.solve.methods.method import Method, above
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from joulepath.optimizer.solve.methods.spline_spaces import SPLINE_SPACES


def explore_least_work(state: SearchState, explore: Callable[[], object]) -> bool:
    """Find motions of least work through coarse motions; `explore` then solves the open candidates.

    The search runs at most once per request. It does nothing for another objective, a free
    duration, constraints along the path, a tight bound (every candidate is then solved), or little
    time, because the first motion comes late.

    Args:
        state: state of the search.
        explore: solves all open candidates.

    Returns:
        Whether a motion was found.
    """
    asked = state.problem
    if state.deadline.left < LEAST_WORK.least_time or not state.prepared.kernel.compiled:
        return False
    families = families_of(state)
    free = state.prepared.path is None and not asked.passes and asked.tool_path is None
    if state.least_work_sought or not (families and asked.has_fixed_duration and free):
        return False
    state.least_work_sought = True
    solver = CoarseSolver(state.prepared, float(asked.duration_max or 0.0))
    search = _LeastWorkSearch(state, families, solver)
    waiting = [each for family in families for each in family[1:]]
    try:
        with watch(state.deadline):
            search.run()
    except DeadlinePassed:
        state.cut_short = True
    if state.best() is None:
        return False
    left = [each for each in waiting if each.status is CandidateStatus.UNVISITED]
    behind = search.not_promising()
    for each in [*left, *behind]:
        each.deferred = True
    explore()
    # neither reason is a proof
    settle_waiting(state, behind, Reason.ROUGHLY)
    settle_waiting(state, left)
    return True


@dataclass(eq=False)
class _LeastWorkSearch:
    """Search for least work over the candidates of families."""

    state: SearchState
    families: list[list[Candidate]]
    solver: CoarseSolver
    coarse: dict[Candidate, CoarseMotion] = field(default_factory=dict)
    """Coarse motion of least work of each candidate."""
    tried: set[Candidate] = field(default_factory=set)
    """Solved candidates."""
    behind: set[Candidate] = field(default_factory=set)
    """Candidates given up because another candidate needs less work."""

    def run(self) -> None:
        """Find coarse motions, solve the best one, then all candidates with less expected work."""
        self._screen()
        if not self.coarse:
            return
        most = LEAST_WORK.contender_ratio * min(each.work for each in self.coarse.values())
        contenders = [each for each in self._by_work() if each.work <= most]
        contenders = self._solve_in_middle_space(contenders[: LEAST_WORK.most_contenders])
        settings = LEAST_WORK.sole if len(contenders) == 1 else LEAST_WORK.several
        found = [*contenders, *self._restarted(contenders[0], settings)]
        self._follow(self._without_collision(sorted(found, key=lambda each: each.work)), settings)
        self._solve_promising()

    def _restarted(self, best: CoarseMotion, settings: RestartSettings) -> list[CoarseMotion]:
        """Motions from random guesses of the best candidate, in batches as long as they improve."""
        guesses = self.solver.random([best.candidate] * settings.restarts)
        found, least = list[CoarseMotion](), best.work
        for k in range(0, len(guesses), settings.batch):
            batch = self._solve(
                guesses[k : k + settings.batch], COARSE.control_points, LEAST_WORK.restart_progress
            )
            middle = self._solve_in_middle_space(
                [each for each in batch if each.work <= LEAST_WORK.restart_ratio * least]
            )
            found += middle
            before, least = least, min([least, *(each.work for each in middle)])
            if least > LEAST_WORK.improvement_ratio * before:
                break
        return found

    def _solve(
        self, guesses: Sequence[CoarseMotion], count: int, progress: float
    ) -> list[CoarseMotion]:
        """Coarse motions from guesses on `count` control points."""
        return self.solver.solved(
            guesses, count, SMOOTHING.power_width, progress, LEAST_WORK.behind_ratio
        )

    def _solve_in_middle_space(self, guesses: Sequence[CoarseMotion]) -> list[CoarseMotion]:
        """Coarse motions from guesses, with more control points, stored for their candidates."""
        count, progress = SHARPENING.middle_points, LEAST_WORK.middle_progress
        return self._keep(self._solve(guesses, count, progress))

    def _screen(self) -> None:
        """Find coarse motions of one member per family, then of more members of the best ones."""
        firsts = sorted((family[0] for family in self.families), key=lambda each: each.lower_bound)
        for k in range(0, len(firsts), LEAST_WORK.batch):
            self._find(firsts[k : k + LEAST_WORK.batch])
        works = [self._work_of(family[0]) for family in self.families]
        most = FAMILIES.energy_ratio * min(works)
        near = [k for k in np.argsort(works, kind="stable").tolist() if works[k] <= most]
        best = [self.families[k] for k in near[: FAMILIES.families]]
        self._find([each for family in best for each in family[1 : FAMILIES.members]])

    def _find(self, candidates: Sequence[Candidate]) -> None:
        """Find coarse motions of all candidates with a lower bound below the least coarse work."""
        least = min((each.work for each in self.coarse.values()), default=np.inf)
        guesses = self.solver.first([each for each in candidates if each.lower_bound < least])
        self._keep(self._solve(guesses, COARSE.control_points, LEAST_WORK.coarse_progress))

    def _keep(self, found: list[CoarseMotion]) -> list[CoarseMotion]:
        """Store the motion of least work per candidate; returns the argument."""
        for each in best_of_each(found):
            if each.work < self._work_of(each.candidate):
                self.coarse[each.candidate] = each
        return found

    def _work_of(self, candidate: Candidate) -> float:
        known = self.coarse.get(candidate)
        return np.inf if known is None else known.work

    def _by_work(self) -> list[CoarseMotion]:
        """The coarse motions of candidates, the motion of least work first."""
        return sorted(self.coarse.values(), key=lambda each: each.work)

    def _without_collision(self, found: list[CoarseMotion]) -> list[CoarseMotion]:
        """The first motions without collision among motions in order of work."""
        clear: list[CoarseMotion] = []
        for each in found:
            if clear and (
                each.work > LEAST_WORK.follow_ratio * clear[0].work
                or len(clear) == LEAST_WORK.most_followed
            ):
                break
            if not any(each.is_equal(other) for other in clear) and self._may_sharpen(each):
                clear.append(each)
        return clear

    def _may_sharpen(self, motion: CoarseMotion) -> bool:
        """Whether a motion does not collide and is not nearly the fastest."""
        if self.solver.duration < SHARPENING.fast_ratio * motion.candidate.shortest:
            return False
        spline = motion.spline(self.solver.duration)
        return self.state.prepared.surroundings.worst_violation(spline) is None

    def _follow(self, motions: list[CoarseMotion], settings: RestartSettings) -> None:
        """Follow motions to sharp corners, the best first."""
        count, least = 0, np.inf
        for each in motions:
            if count == settings.sharpened or each.work > settings.ratio * least:
                self.behind.add(each.candidate)
                continue
            count += 1
            if self._sharpen(each):
                # another motion may still get sharp corners
                least = min(least, each.work)
        self.behind -= self.tried

    def _sharpen(self, motion: CoarseMotion) -> bool:
        """Follow a motion to sharp corners, unless it falls behind; whether it succeeds."""
        *wide, last = SHARPENING.steps
        points = motion.on(SHARPENING.dense_points)
        for step in wide:
            solver = self._solver(motion.candidate, step.width)
            attempt = partial(solver.solve_control_points, unchecked=True)
            result = self._attempt(attempt, points, step.progress)
            if result.spline is None:
                break
            cost = self.state.prepared.cost_of(result.spline)
            if cost > SHARPENING.rounder_ratio * self._least_energy:
                self.behind.add(motion.candidate)
                return False
            points = result.spline.control_points
        if self._solved(motion, points, last.width, last.progress).spline is None:
            return False
        self.tried.add(motion.candidate)
        return True

    def _solve_promising(self) -> None:
        """Solve all candidates with a coarse motion of less expected work than the best energy."""
        for motion in self._by_work():
            candidate, least = motion.candidate, self._least_energy
            if self._is_settled(candidate) or LEAST_WORK.promise * motion.work >= least:
                continue
            if np.isfinite(least) and self._may_sharpen(motion):
                self._sharpen(motion)
            if not self._is_settled(candidate):
                self.tried.add(candidate)
                points = motion.on(SHARPENING.middle_points)
                below = above(least, LEAST_WORK.colliding_ratio)
                result = self._solved(
                    motion, points, SMOOTHING.power_width, SHARPENING.progress, below
                )
                worth = above(least, LEAST_WORK.sharpening_ratio)
                if result.spline is not None and (candidate.energy or np.inf) < worth:
                    follow_in_time(self.state, candidate, least)

    def _is_settled(self, candidate: Candidate) -> bool:
        """Whether a candidate was solved, or given up because it seems to need more."""
        return candidate in self.tried or candidate in self.behind

    @property
    def _least_energy(self) -> float:
        """Energy of the best motion [J]; inf without one."""
        best = self.state.best()
        return np.inf if best is None or best.energy is None else best.energy

    def _solved(
        self,
        motion: CoarseMotion,
        points: Array,
        width: float,
        progress: float,
        below: float = np.inf,
    ) -> SolveResult:
        """Solve a candidate from control points, and store the result with the candidate.

        Unless the control points are dense, the candidate is solved without a guess if this solve
        fails, or if the duration is so short that the knots must be at the switches of jerk.

        Args:
            motion: coarse motion of the candidate.
            points: control points to start from, shape (n, nq) [rad].
            width: width of the smoothed corners [W].
            progress: smallest predicted relative decrease of the cost for a further step.
            below: cost that the motion must stay below [J].
        """
        state, candidate = self.state, motion.candidate
        is_dense = len(points) == SHARPENING.dense_points
        solver = self._solver(candidate, width, below)
        result = SolveResult(SolveStatus.FAILED, SolveReason.TOO_SHORT_FOR_EVEN_KNOTS)
        if is_dense or self.solver.duration >= SPLINE_SPACES.tight * candidate.shortest:
            result = self._attempt(solver.solve_control_points, points, progress)
        if result.status is SolveStatus.FAILED and not is_dense:
            result = in_time(state, solver.solve)
        state.cut_short |= result.cut_short
        if result.spline is not None:
            state.accept_if_better(candidate, result, state.prepared.energy(result.spline))
        elif (
            candidate.energy is None
            and not is_dense
            and result.status in (SolveStatus.FAILED, SolveStatus.PRUNED)
        ):
            candidate.attempt = result
            candidate.settle(CandidateStatus(result.status.value), Reason.METHOD, result.message)
        if candidate.status is not CandidateStatus.UNVISITED:
            state.tell_tried(candidate)
        return result

    def _solver(self, candidate: Candidate, width: float, below: float = np.inf) -> Method:
        """The method for a candidate, with corners of a width [W]; `below` as of `_solved`."""
        interval = duration_intervals(self.state.prepared, candidate.q_goal, width=width)[0]
        return solver_of(self.state, candidate, interval, below)

    def _attempt(
        self, attempt: Callable[..., SolveResult], points: Array, progress: float
    ) -> SolveResult:
        """The result of a solve from evenly spaced control points (n, nq) [rad]."""
        space, duration = bspline.uniform(len(points)), self.solver.duration
        return in_time(self.state, partial(attempt, space, points, duration, progress))

    def not_promising(self) -> list[Candidate]:
        """Open candidates without a coarse motion of less expected work than the best energy."""
        least = self._least_energy
        return [
            each.candidate
            for each in self._by_work()
            if each.candidate.status is CandidateStatus.UNVISITED
            and (each.candidate in self.behind or LEAST_WORK.promise * each.work >= least)
        ]
