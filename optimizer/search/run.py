"""The search for one problem's motion of least energy: the order of its stages."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, checkpoint, watch
from joulepath.optimizer.dynamics.interval import MotionEnergy, with_interval
from joulepath.optimizer.exceptions import DeadlineExceeded, NoTrajectory
from joulepath.optimizer.motion.spline import Spline, lasting, sampled
from joulepath.optimizer.prepared_problem import ArmModels, PreparedProblem
from joulepath.optimizer.problem.bus import Bus
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.progress import Improved, Tell, no_listener
from joulepath.optimizer.result.candidates import CandidateStatus, UnreachableTarget
from joulepath.optimizer.result.energy import Energy
from joulepath.optimizer.result.solution import (
    Baseline,
    Configuration,
    LimitsInForce,
    Solution,
    SolverReport,
)
from joulepath.optimizer.search import free_goal, self_motions
from joulepath.optimizer.search.attempts import solve, solve_from
from joulepath.optimizer.search.baselines import standing, with_savings
from joulepath.optimizer.search.branch_and_bound import explore
from joulepath.optimizer.search.candidates import Candidate, Reason, bound, pairs
from joulepath.optimizer.search.claims import may_be_optimal
from joulepath.optimizer.search.ends import ends
from joulepath.optimizer.search.errors import DurationTooShort
from joulepath.optimizer.search.fastest import explore_or_find_fastest, find_fastest
from joulepath.optimizer.search.freed_duration import start_from_free_duration
from joulepath.optimizer.search.incumbent import Incumbent
from joulepath.optimizer.search.least_work import explore_least_work
from joulepath.optimizer.search.missed_branches import all_known
from joulepath.optimizer.search.near_goals import activate_near_goals
from joulepath.optimizer.search.other_starts import start_beside
from joulepath.optimizer.search.outer_turns import explore_families
from joulepath.optimizer.search.path_ends import path_candidates
from joulepath.optimizer.search.refinement import (
    baselines_of,
    compare_with_baselines,
    refine,
    refine_rivals,
)
from joulepath.optimizer.search.refusals import no_trajectory
from joulepath.optimizer.search.ruled_out import ruled_out
from joulepath.optimizer.search.sampled_ends import activate_deferred, between
from joulepath.optimizer.search.second_attempt import reject
from joulepath.optimizer.search.seeds import activate_seeds
from joulepath.optimizer.search.sliding import slides
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus

# time after the deadline [s] at which a certificate is given up: better a little late than no
# answer
OVERTIME = 0.1


class Run:
    """One search. `known` are motions between the problem's ends, of any duration, that warm-start
    it.

    `tell` gets what is found. `models` are those of the problem's arm, if they are built already.
    """

    def __init__(
        self,
        problem: Problem,
        known: Sequence[Spline] = (),
        clock: Clock = time.perf_counter,
        tell: Tell = no_listener,
        models: ArmModels | None = None,
    ) -> None:
        self.clock, self.began = clock, clock()
        self.problem, self.known = problem, known
        prepared = PreparedProblem.of(problem, models)
        self.incumbent = Incumbent(prepared, Deadline.after(problem.deadline, clock), tell=tell)
        self.unreachable: list[UnreachableTarget] = []
        self.moved = self.lost = False

    def prepare(self) -> None:
        """Find the candidates, and give each its lower bound. Raises the errors of `optimize` that
        need no search.
        """
        try:
            with watch(self.incumbent.end):
                self._prepare()
        except DeadlinePassed:
            raise self.too_late() from None

    def _prepare(self) -> None:
        problem, prepared = self.problem, self.incumbent.prepared
        if problem.tool_path is not None:
            self.incumbent.candidates = path_candidates(prepared)
        else:
            (starts, no_starts), (goals, no_goals) = (
                ends(prepared, name) for name in ("start", "goal")
            )
            self.unreachable = no_starts + no_goals
            self.incumbent.candidates = pairs(prepared, starts, goals)
        bound(prepared, self.incumbent.candidates)
        checkpoint()
        least = min(candidate.shortest for candidate in self.incumbent.candidates)
        self.incumbent.longest = max(least, problem.duration_min or 0.0)
        problem.arm.check_rating("payload.mass", problem.arm.payload.mass)
        self.incumbent.proven = self._proven()
        self.incumbent.tell_candidates()

    def _proven(self) -> float | None:
        """What no motion goes below [J]; None if candidates that are not known, or not solved, have
        to be bounded.
        """
        candidates = self.incumbent.candidates
        if (
            self.problem.tool_path
            or any(each.sampled for each in candidates)
            or not all_known(self.problem)
        ):
            return None
        return min(each.lower_bound for each in candidates)

    def solution(self) -> Solution:
        """The motion of least energy that the certificate confirms. Raises the errors of
        `optimize`.
        """
        self.prepare()
        for spline in self.known:
            self.warm_start(spline)
        return self.search()

    def as_it_is(
        self, spline: Spline, stationarity: float | None = None, is_optimal: bool = False
    ) -> Solution:
        """The solution that a known motion is, without any search. Raises NoTrajectory if it is not
        certified.

        `is_optimal`: a search found it, which ended with this `stationarity`.
        """
        self.prepare()
        incumbent = self.incumbent
        candidate = between(
            incumbent.prepared, incumbent.candidates, *spline.control_points[[0, -1]]
        )
        result = SolveResult(
            SolveStatus.SOLVED,
            SolveReason.KNOWN_MOTION,
            spline=spline,
            stationarity=stationarity,
        )
        incumbent.accept_if_better(candidate, result, incumbent.prepared.energy(spline))
        incumbent.cut_short = not is_optimal
        answer = self.answer(candidate, baselines_of(incumbent, candidate))
        if answer is None:
            incumbent.reject(candidate)
            raise no_trajectory(self.incumbent.candidates)
        return answer

    def search(self) -> Solution:
        """The solution, from candidates that are prepared, and of which some may be solved. Raises
        as `solution`.
        """
        incumbent = self.incumbent
        problem, without = self.problem, None
        if incumbent.uses_storage:
            # storage never makes a motion need more energy
            without = self.solved_beside(
                replace(problem, arm=replace(problem.arm, bus=Bus())), share=0.5
            )
        # rest does no work: any motion may rest for the time that is left
        may_rest = (
            problem.objective == "mechanical" and problem.duration_min != problem.duration_max
        )
        explore_or_find_fastest(incumbent, self.explore, self.known, without)
        if incumbent.method.most_solved is None:
            incumbent.candidates += free_goal.refine_goals(incumbent) + self_motions.refine(
                incumbent
            )
            incumbent.tell_candidates()
            incumbent.tell_best()
        while (best := incumbent.best()) is not None:
            if not best.refused:
                best = start_beside(incumbent, best)
                coarse = best.energy or 0.0
                refine(incumbent, best)
                refine_rivals(incumbent, best, coarse)
                best = incumbent.best() or best
                start_from_free_duration(incumbent, best)
            longest = (
                self.solved_beside(replace(problem, duration_min=problem.duration_max))
                if may_rest
                else None
            )
            if longest is not None:
                incumbent.accept_if_better(*longest)
            best, may_rest = incumbent.best() or best, False
            table = compare_with_baselines(incumbent, best)
            best = incumbent.best() or best
            # a coarse motion that was not refined is no optimum
            incumbent.cut_short |= incumbent.deadline.passed
            answer = self.answer(best, table)
            if answer is not None:
                return answer
            reject(incumbent, best)
            self.explore()
        if any(each.reason is Reason.NOT_CONFIRMED for each in incumbent.candidates):
            find_fastest(incumbent, self.known, improve=False)
            if (last := incumbent.best()) is not None and (
                answer := self.answer(last, baselines_of(incumbent, last))
            ):
                return answer
        if any(candidate.status is CandidateStatus.UNVISITED for candidate in incumbent.candidates):
            raise self.too_late()
        raise no_trajectory(self.incumbent.candidates)

    def too_late(self) -> DeadlineExceeded:
        """The error for no certified motion before the deadline."""
        return DeadlineExceeded([candidate.report() for candidate in self.incumbent.candidates])

    def explore(self) -> None:
        """Solve candidates until no lower bound is below the incumbent; deferred ones too while
        nothing is solved.
        """
        incumbent = self.incumbent
        candidates, most_solved = incumbent.candidates, incumbent.method.most_solved
        self.activate()

        def solve_open() -> None:
            explore(
                incumbent.prepared,
                candidates,
                lambda candidate: solve(incumbent, candidate),
                incumbent.deadline,
                most_solved,
                incumbent.tell_tried,
            )

        if explore_least_work(incumbent, solve_open):
            return
        while True:
            explore_families(incumbent, solve_open)
            solved = incumbent.best() is not None and not self.has_lost_a_goal()
            if solved or incumbent.deadline.passed or not self.activate():
                break

    def has_lost_a_goal(self) -> bool:
        """Whether, for the first time, no motion was found to one of the best goals of free
        orientation.

        Where torque hardly suffices, there may be one to a goal beside it.
        """
        lost = any(
            each.status is CandidateStatus.FAILED
            and each.attempt is not None
            and each.attempt.collision is None
            for each in self.incumbent.candidates
            if each.goal.tolerance is not None
        )
        first, self.lost = lost and not self.lost, self.lost or lost
        return first

    def activate(self) -> bool:
        """Activate deferred candidates; false if there are none."""
        prepared, candidates = self.incumbent.prepared, self.incumbent.candidates
        if not self.moved and self.problem.tool_path is None:
            self.moved = True
            if activate_near_goals(prepared, candidates):
                self.activate_samples([each for each in candidates if each.goal.tolerance is None])
                return True
        return self.activate_samples(candidates)

    def activate_samples(self, candidates: list[Candidate]) -> bool:
        """Activate deferred ones of these candidates; false if there are none."""
        if any(slides(self.incumbent.prepared, each) for each in candidates):
            return activate_seeds(self.incumbent.prepared, candidates)
        return activate_deferred(candidates)

    def solved_beside(
        self, other: Problem, share: float = 1.0
    ) -> tuple[Candidate, SolveResult, Energy] | None:
        """The answer to another problem, whose motions this one allows, as a motion of it: no
        dearer than there.

        It gets a `share` of the time left. None if it has no answer by then.
        """
        incumbent, left = self.incumbent, self.incumbent.deadline.left
        if left <= 0:
            return None
        try:
            found = Run(
                replace(other, bound="normal", deadline=share * left), clock=self.clock
            ).solution()
        except (DeadlineExceeded, DurationTooShort, NoTrajectory):
            return None
        incumbent.iterations += found.solver.iterations
        incumbent.solves += found.solver.nlp_solves
        targets = found.start.target, found.goal.target
        same = [
            each
            for each in incumbent.candidates
            if (each.start.target, each.goal.target) == targets
        ]
        candidate = between(
            incumbent.prepared, incumbent.candidates, found.start.q, found.goal.q, same
        )
        spline = found.trajectory.spline
        result = SolveResult(
            SolveStatus.SOLVED,
            SolveReason.CONVERGED,
            spline=spline,
            stationarity=found.solver.stationarity,
        )
        return candidate, result, incumbent.prepared.energy(spline)

    def warm_start(self, spline: Spline) -> None:
        """Solve the candidate of a known motion from it, and without it; the better result counts.

        The motion is rescaled in time to the allowed durations. It is accepted as it is if its
        certificate is valid.
        """
        incumbent = self.incumbent
        prepared = incumbent.prepared
        q_start, q_goal = spline.control_points[0], spline.control_points[-1]
        candidate = between(prepared, incumbent.candidates, q_start, q_goal)
        if candidate.status is CandidateStatus.INFEASIBLE or incumbent.deadline.passed:
            return
        least, most = self.problem.duration_min or 0.0, self.problem.duration_max or np.inf
        known = lasting(spline, float(np.clip(spline.duration, least, most)))
        energy = incumbent.confirmed_energy(candidate, known)
        if energy is not None:
            incumbent.accept_if_better(
                candidate,
                SolveResult(SolveStatus.SOLVED, SolveReason.KNOWN_MOTION_RETIMED, spline=known),
                energy,
            )
        solve_from(incumbent, candidate, sampled(known), fine=self.problem.method == "time_scaling")
        result = solve(incumbent, candidate)
        if result.spline is None:
            # a known motion is no optimum if solves from it fail; it may be one if they end early,
            # being no better
            failed = result.status is not SolveStatus.PRUNED
            incumbent.cut_short |= (
                failed and candidate.attempt is not None and candidate.attempt.spline is known
            )
            return
        incumbent.accept_if_better(candidate, result, prepared.energy(result.spline))
        if incumbent.method.may_refine(result.spline) and candidate.attempt is not result:
            # with few control points it needs more energy than the known motion, but may lead to a
            # better optimum
            solve_from(incumbent, candidate, sampled(result.spline), fine=False)

    def answer(self, best: Candidate, table: list[Baseline]) -> Solution | None:
        """The solution around the best candidate; None if its certificate fails. Raises
        DeadlineExceeded.
        """
        incumbent, spline, prepared = self.incumbent, best.spline, self.incumbent.prepared
        try:
            with watch(incumbent.end.earlier_by(-OVERTIME)):
                energy = prepared.energy(spline)
                certificate = incumbent.certified(best, spline, energy)
                if not certificate.valid:
                    return None
                trajectory = prepared.trajectory(spline, self.problem.sample_period)
                sensitivity = prepared.sensitivity(spline)
                unmodelled = prepared.surroundings.unmodelled_contacts(spline)
        except DeadlinePassed:
            raise self.too_late() from None
        objective = energy.of(self.problem.objective)
        least, done = ruled_out(incumbent, objective)
        is_proven = not incumbent.cut_short and may_be_optimal(
            self.problem.objective, objective, least
        )
        assert best.attempt is not None
        incumbent.tell(Improved(objective, spline.duration, least, best.q_goal))
        arm = self.problem.arm
        return Solution(
            status="optimal" if done and is_proven and incumbent.method.converges else "feasible",
            start=Configuration(best.start.label, best.q_start, best.start.target),
            goal=Configuration(best.goal.label, best.q_goal, best.goal.target),
            trajectory=trajectory,
            energy=with_interval(energy, sensitivity, spline.duration, arm),
            sensitivity=sensitivity,
            lower_bound=least,
            limits=LimitsInForce.of(arm.active_limits, arm.tcp_speed, arm.elbow_speed),
            complete=all_known(self.problem),
            baselines=with_savings(
                table,
                self.problem,
                MotionEnergy(energy.electrical.total, sensitivity, spline.duration),
                standing(arm, best.q_goal, prepared.torques),
            ),
            candidates=[each.report() for each in incumbent.candidates],
            unreachable=self.unreachable,
            certificate=certificate,
            unmodelled=unmodelled,
            solver=SolverReport(
                wall_time=self.clock() - self.began,
                iterations=incumbent.iterations,
                nlp_solves=incumbent.solves,
                stationarity=best.attempt.stationarity,
            ),
        )
