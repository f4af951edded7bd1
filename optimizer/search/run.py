"""The search for one problem's motion of least energy."""

from __future__ import annotations

import time
from collections.abc import Sequence

from joulepath.optimizer.deadline import Clock
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import ArmModels
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.progress import Tell, no_listener
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.search import exploration, stages, warm_start
from joulepath.optimizer.search.answer import answer
from joulepath.optimizer.search.baseline_comparison import baselines_of
from joulepath.optimizer.search.no_trajectory import no_trajectory
from joulepath.optimizer.search.sampled_ends import between
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus


class Run:
    """One search: runs the stages of `stages.METHOD` over its `state`.

    Args:
        problem: the problem.
        known: motions between the problem's ends, of any duration, that warm-start the search.
        clock: function that returns the time [s].
        tell: receives the progress.
        models: models of the problem's arm, if they are built already.
        seeks_baselines: whether baselines along planned paths are sought where the usual ones break
            a limit.
    """

    def __init__(
        self,
        problem: Problem,
        known: Sequence[Spline] = (),
        clock: Clock = time.perf_counter,
        tell: Tell = no_listener,
        models: ArmModels | None = None,
        seeks_baselines: bool = False,
    ) -> None:
        self.state = SearchState.of(problem, known, clock, tell, models)
        self.state.seeks_baselines = seeks_baselines

    @property
    def problem(self) -> Problem:
        """The problem."""
        return self.state.problem

    @property
    def began(self) -> float:
        """Start of the search [s]."""
        return self.state.began

    def prepare(self) -> None:
        """Find and bound the candidates; raises the errors of `stages.prepare`."""
        stages.prepare(self.state)

    def warm_start(self, spline: Spline) -> None:
        """Solve the candidate of a known motion from this motion."""
        warm_start.warm_start(self.state, spline)

    def explore(self) -> None:
        """Solve candidates until no lower bound is below the best energy."""
        exploration.explore(self.state)

    def search(self) -> Solution:
        """The solution from prepared candidates; raises the errors of `optimize`."""
        return stages.search(self.state)

    def solution(self) -> Solution:
        """The certified motion of least energy; raises the errors of `optimize`."""
        self.prepare()
        stages.start_from_known_motions(self.state)
        return self.search()

    def as_it_is(
        self, spline: Spline, stationarity: float | None = None, is_optimal: bool = False
    ) -> Solution:
        """A known motion as solution, without any search.

        Args:
            spline: the motion.
            stationarity: stationarity at the end of the search for the motion.
            is_optimal: whether the search for the motion ended before its deadline.

        Raises:
            NoTrajectory: the certificate does not confirm the motion.
        """
        self.prepare()
        state = self.state
        candidate = between(state.prepared, state.candidates, *spline.control_points[[0, -1]])
        result = SolveResult(
            SolveStatus.SOLVED,
            SolveReason.KNOWN_MOTION,
            spline=spline,
            stationarity=stationarity,
        )
        state.accept_if_better(candidate, result, state.prepared.energy(spline))
        state.cut_short = not is_optimal
        found = answer(state, candidate, baselines_of(state, candidate))
        if found is None:
            state.reject(candidate)
            raise no_trajectory(state.candidates)
        return found
