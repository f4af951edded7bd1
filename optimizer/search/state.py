"""State of one search: candidates, the best motion so far, deadline and effort."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, Self

import numpy as np

from joulepath.optimizer.certificate import certify
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, watch
from joulepath.optimizer.exceptions import DeadlineExceeded
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.motion.spline import Spline, lasting
from joulepath.optimizer.prepared_problem import ArmModels, PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS, Problem, narrowed
from joulepath.optimizer.progress import (
    CandidatesFound,
    CandidateTried,
    Improved,
    Tell,
    no_listener,
)
from joulepath.optimizer.result.baseline import Baseline
from joulepath.optimizer.result.candidates import CandidateStatus, UnreachableTarget
from joulepath.optimizer.result.certificate import Certificate
from joulepath.optimizer.result.energy import Energy
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.search.candidates import Candidate, Reason
from joulepath.optimizer.search.finishing_time import finishing_time
from joulepath.optimizer.solve.methods import method_of
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.solve_result import SolveResult

ENERGY_TOLERANCE = 1e-6
"""Relative difference of two energies that counts: the error of the compared quadratures."""
DURATION_TOLERANCE = 1e-6
"""Relative excess of a duration beyond the allowed interval that counts as rounding."""


@dataclass(frozen=True)
class FoundMotion:
    """A motion of a candidate that another search found."""

    candidate: Candidate
    result: SolveResult
    energy: Energy


@dataclass
class SearchState:
    """State of one search, which its stages read and change in turn."""

    prepared: PreparedProblem
    """The problem with its models."""
    end: Deadline
    """Deadline of the answer."""
    candidates: list[Candidate] = field(default_factory=list)
    """All pairs of start and goal configurations."""
    iterations: int = 0
    """Iterations of all attempts."""
    solves: int = 0
    """Number of NLPs solved in all attempts."""
    cut_short: bool = False
    """Whether there may be a better motion, because the deadline ended a part of the search."""
    longest: float = 0.0
    """Longest duration that the answer may have, as far as it is known [s]."""
    tell: Tell = no_listener
    """Receives the progress."""
    proven: float | None = None
    """Lower bound of all motions [J]; None before it is known."""
    clock: Clock = time.perf_counter
    """Clock [s]."""
    known: Sequence[Spline] = ()
    """Motions between ends of candidates, of any duration, that warm-start the search."""
    began: float = 0.0
    """Start of the search [s]."""
    unreachable: list[UnreachableTarget] = field(default_factory=list)
    """Targets without a configuration."""
    without_storage: FoundMotion | None = None
    """The answer without energy storage on the bus."""
    near_goals_activated: bool = False
    """Whether `near_goals` has chosen the first goals of free orientation."""
    goal_was_lost: bool = False
    """Whether the search had no motion to one of the best goals of free orientation."""
    least_work_sought: bool = False
    """Whether coarse motions of least work have been sought."""
    sliding_work_sought: bool = False
    """Whether least work between sliding ends has been sought."""
    other_durations_solved: bool = False
    """Whether motions of least work of other durations have been compared."""
    best_ends_searched: bool = False
    """Whether least work between the ends of the best motion has been sought."""
    seeks_baselines: bool = False
    """Whether baselines along planned paths are sought where the usual ones break a limit."""
    baselines: list[Baseline] = field(default_factory=list)
    """Baselines of the best motion."""
    answer: Solution | None = None
    """The answer, once the certificate confirms it."""

    @classmethod
    def of(
        cls,
        problem: Problem,
        known: Sequence[Spline] = (),
        clock: Clock = time.perf_counter,
        tell: Tell = no_listener,
        models: ArmModels | None = None,
    ) -> Self:
        """State of a search that begins now; arguments as of `Run`."""
        began = clock()
        prepared = PreparedProblem.of(problem, models)
        end = Deadline.after(problem.deadline, clock)
        return cls(prepared, end, tell=tell, clock=clock, known=known, began=began)

    @property
    def deadline(self) -> Deadline:
        """Deadline of the search: `end` less the time to certify and report the answer."""
        return self.end.earlier_by(finishing_time(self.problem, self.longest, len(self.candidates)))

    @property
    def problem(self) -> Problem:
        """The problem to solve."""
        return self.prepared.problem

    @property
    def method(self) -> type[Method]:
        """The problem's method."""
        return method_of(self.problem)

    @property
    def uses_storage(self) -> bool:
        """Whether the objective depends on the charge of energy storage on the bus."""
        return self.problem.arm.bus.mode == "storage" and self.problem.objective == "electrical"

    def best(self) -> Candidate | None:
        """The solved candidate of least energy; None if no candidate is solved."""
        solved = (candidate for candidate in self.candidates if candidate.energy is not None)
        return min(solved, key=lambda candidate: candidate.energy or 0.0, default=None)

    def too_late(self) -> DeadlineExceeded:
        """The error for no certified motion before the deadline."""
        return DeadlineExceeded([candidate.report() for candidate in self.candidates])

    def add_effort(self, result: SolveResult) -> SolveResult:
        """Add the effort of an attempt to the totals; returns the result unchanged."""
        if result.spline is not None:
            self.longest = max(self.longest, result.spline.duration)
        self.iterations += result.iterations
        self.solves += result.solves
        return result

    def add_search(self, other: SearchState) -> None:
        """Add the effort of another search to the totals."""
        self.iterations += other.iterations
        self.solves += other.solves

    def accept_if_better(
        self,
        candidate: Candidate,
        result: SolveResult,
        energy: Energy,
        moved: Candidate | None = None,
        certified: bool = False,
    ) -> None:
        """Give a candidate a motion unless it has one of less energy.

        A candidate of which the certificate refused a motion takes no motion that is not certified.

        Args:
            candidate: the candidate.
            result: result with the motion.
            energy: energy of the motion.
            moved: candidate with the ends of the motion, if they have moved.
            certified: whether the certificate confirms the motion.
        """
        objective, closed = energy.of(self.problem.objective), candidate.refused and not certified
        if not closed and (candidate.energy is None or objective < candidate.energy):
            candidate.take(result, objective)
            if moved is not None:
                candidate.move(moved)
            self.tell_best()

    def reject(self, candidate: Candidate) -> None:
        """Drop a motion that the certificate did not confirm: the candidate has its last one again.

        Candidates that its energy pruned are open again.
        """
        candidate.refuse()
        for other in self.candidates:
            if other.status is CandidateStatus.PRUNED:
                other.settle(CandidateStatus.UNVISITED, Reason.NOT_REACHED)

    def certified(self, candidate: Candidate, spline: Spline, energy: Energy) -> Certificate:
        """The certificate of a motion, checked against the targets of its candidate."""
        narrow = narrowed(self.problem, candidate.start.target, candidate.goal.target)
        return certify(narrow, spline, candidate.q_start, candidate.q_goal, energy)

    def confirmed_energy(self, candidate: Candidate, spline: Spline) -> Energy | None:
        """Energy of a motion; None if its certificate does not confirm it before the deadline."""
        try:
            with watch(self.deadline):
                energy = self.prepared.energy(spline)
                return energy if self.certified(candidate, spline, energy).valid else None
        except DeadlinePassed:
            return None

    def lasts_below(self, ratio: float, candidate: Candidate) -> bool:
        """Whether the motion of a candidate takes less than a multiple of the shortest duration of
        its joints.

        Then its jerk switches nearly as in the fastest motion.
        """
        displacement = candidate.q_goal - candidate.q_start
        shortest = shortest_duration(displacement, self.problem.arm.active_limits)
        return candidate.spline.duration < ratio * float(shortest)

    def tell_candidates(self) -> None:
        """Tell the number of candidates."""
        self.tell(CandidatesFound(len(self.candidates)))

    def tell_tried(self, candidate: Candidate) -> None:
        """Tell the outcome of a candidate, and the best motion."""
        if self.tell is no_listener:
            return
        index = self.candidates.index(candidate)
        status: Literal["solved", "pruned", "failed"] = "failed"
        if candidate.energy is not None:
            status = "solved"
        elif candidate.status is CandidateStatus.PRUNED:
            status = "pruned"
        self.tell(CandidateTried(index, status, candidate.lower_bound, candidate.energy))
        self.tell_best()

    def tell_best(self) -> None:
        """Tell the best motion so far, if there is one."""
        best = None if self.tell is no_listener else self.best()
        if best is not None and best.energy is not None:
            self.tell(Improved(best.energy, best.duration, self.proven, best.q_goal))

    @property
    def _durations(self) -> tuple[float, float]:
        """Least and greatest duration that the problem allows [s]."""
        return self.problem.duration_min or DURATIONS.least, self.problem.duration_max or np.inf

    def allows(self, duration: float) -> bool:
        """Whether the problem allows a duration [s], up to rounding.

        A baseline between equal ends has the duration 0.
        """
        least, most = self._durations
        return bool(least * (1 - DURATION_TOLERANCE) <= duration <= most * (1 + DURATION_TOLERANCE))

    def allowed(self, spline: Spline) -> Spline | None:
        """The motion without a rounding error of its duration; None if the problem forbids it."""
        if not self.allows(spline.duration):
            return None
        return lasting(spline, float(np.clip(spline.duration, *self._durations)))
