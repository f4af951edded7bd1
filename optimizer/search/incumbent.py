"""The incumbent of a search: the best motion found so far, among the candidates, with the effort
spent on them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from joulepath.optimizer.certificate import certify
from joulepath.optimizer.deadline import Deadline, DeadlinePassed, watch
from joulepath.optimizer.motion.spline import Spline, lasting
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS, Problem, narrowed
from joulepath.optimizer.progress import (
    CandidatesFound,
    CandidateTried,
    Improved,
    Tell,
    no_listener,
)
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.result.certificate import Certificate
from joulepath.optimizer.result.energy import Energy
from joulepath.optimizer.search.candidates import Candidate, Reason
from joulepath.optimizer.search.reserve import reserve
from joulepath.optimizer.solve.methods import method_of
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.solve_result import SolveResult

# a baseline counts as better only beyond this share, the error of the quadratures that are compared
SLACK = 1e-6


@dataclass
class Incumbent:
    """State of one search, shared by all of its stages.

    `candidates` are all start and goal pairs, `iterations` and `solves` the effort over all
    attempts. `cut_short` says that the deadline ended a part of the search although there is a
    motion, or that this was not optimised: there might be a better one. `end` is the instant at
    which the answer is due, `longest` [s] the longest duration that the answer is known to have,
    perhaps. `tell` gets what is found; `proven` [J] is what no motion goes below, None if that is
    not known yet.
    """

    prepared: PreparedProblem
    end: Deadline
    candidates: list[Candidate] = field(default_factory=list)
    iterations: int = 0
    solves: int = 0
    cut_short: bool = False
    longest: float = 0.0
    tell: Tell = no_listener
    proven: float | None = None

    @property
    def deadline(self) -> Deadline:
        """The deadline of the search: `end`, less the time to certify and report a motion like
        those known so far.
        """
        return self.end.earlier_by(reserve(self.problem, self.longest, len(self.candidates)))

    @property
    def problem(self) -> Problem:
        """The problem that is solved."""
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

    def add_effort(self, result: SolveResult) -> SolveResult:
        """Add an attempt's effort to the totals; returns the result unchanged."""
        if result.spline is not None:
            self.longest = max(self.longest, result.spline.duration)
        self.iterations += result.iterations
        self.solves += result.solves
        return result

    def accept_if_better(
        self,
        candidate: Candidate,
        result: SolveResult,
        energy: Energy,
        moved: Candidate | None = None,
        certified: bool = False,
    ) -> None:
        """Take a result as the candidate's own if the candidate has none or one of more energy.

        `moved` is the candidate with the ends of the motion, if these have moved. A candidate of
        which the certificate refused a motion takes no further result, unless that is `certified`
        already.
        """
        objective, closed = energy.of(self.problem.objective), candidate.refused and not certified
        if not closed and (candidate.energy is None or objective < candidate.energy):
            candidate.take(result, objective)
            if moved is not None:
                candidate.move(moved)
            self.tell_best()

    def reject(self, candidate: Candidate) -> None:
        """Drop a motion that the certificate did not confirm: the candidate has the one before it
        again.

        Candidates that its energy pruned are open again.
        """
        candidate.refuse()
        for other in self.candidates:
            if other.status is CandidateStatus.PRUNED:
                other.settle(CandidateStatus.UNVISITED, Reason.NOT_REACHED)

    def certified(self, candidate: Candidate, spline: Spline, energy: Energy) -> Certificate:
        """The certificate of a candidate's motion, checked against the targets of this
        candidate."""
        asked = narrowed(self.problem, candidate.start.target, candidate.goal.target)
        return certify(asked, spline, candidate.q_start, candidate.q_goal, energy)

    def confirmed_energy(self, candidate: Candidate, spline: Spline) -> Energy | None:
        """The energy of a motion of a candidate; None if its certificate does not confirm it before
        the deadline.
        """
        try:
            with watch(self.deadline):
                energy = self.prepared.energy(spline)
                return energy if self.certified(candidate, spline, energy).valid else None
        except DeadlinePassed:
            return None

    def tell_candidates(self) -> None:
        """Tell how many candidates there are."""
        self.tell(CandidatesFound(len(self.candidates)))

    def tell_tried(self, candidate: Candidate) -> None:
        """Tell what became of a candidate, and what is the best now."""
        if self.tell is no_listener:
            return
        index = next(k for k, each in enumerate(self.candidates) if each is candidate)
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
        """The least and the greatest duration [s] that the problem allows."""
        return self.problem.duration_min or DURATIONS.least, self.problem.duration_max or np.inf

    def allows(self, duration: float) -> bool:
        """Whether the problem allows a duration [s]; a baseline between equal ends has the duration
        0.
        """
        least, most = self._durations
        return bool(least * (1 - SLACK) <= duration <= most * (1 + SLACK))

    def allowed(self, spline: Spline) -> Spline | None:
        """The motion, with a duration that rounding takes out of bounds brought back; None if it is
        not allowed.
        """
        return (
            lasting(spline, float(np.clip(spline.duration, *self._durations)))
            if self.allows(spline.duration)
            else None
        )
