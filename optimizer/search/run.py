"""The search for one problem's motion of least energy."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from models.robot import Array
from optimizer.certificate import certify
from optimizer.deadline import Clock, Deadline
from optimizer.exceptions import (
    DeadlineExceeded,
    DurationTooShort,
    InvalidProblem,
    NoCollisionFreeTrajectory,
    NoTrajectory,
)
from optimizer.methods import METHODS, solver_for
from optimizer.methods.duration_intervals import DurationInterval, duration_intervals, fastest
from optimizer.methods.method import Method, SolveResult, SolveStatus
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.bus import Bus
from optimizer.problem.problem import LEAST_DURATION, Problem, narrowed
from optimizer.search import candidates as search
from optimizer.search import free_goal
from optimizer.search.baselines import baselines, guesses, nearest
from optimizer.search.branch_and_bound import PRUNED, explore
from optimizer.search.candidates import Candidate
from optimizer.search.ends import ends
from optimizer.search.free_goal_bound import family_bound_of
from optimizer.solution import (
    Baseline,
    BaselineName,
    Branch,
    Certificate,
    Energy,
    Solution,
    SolverReport,
    UnreachableTarget,
)
from optimizer.trajectories.ruckig_motion import time_optimal_spline
from optimizer.trajectories.spline import Spline, lasting, least_time_scale, retimed, sampled
from optimizer.trajectories.time_scalings import quintic_spline

# share of the deadline kept for checking and reporting the answer, at most [s]
RESERVE_SHARE, RESERVE = 0.2, 0.1
# a baseline counts as better only beyond the quadrature's own error
SLACK = 1e-6
# what a joule of surplus may be worth where a store has not room for all of it, between burning it and storing it
SURPLUS_VALUES = (0.75, 0.5, 0.25)
UNCONFIRMED = "the certificate did not confirm it"


class Run:
    """One problem being worked on: its candidates and what was spent on them.

    `known` are motions between its ends, of any duration, to begin with.
    """

    def __init__(self, problem: Problem, known: Sequence[Spline] = (), clock: Clock = time.perf_counter) -> None:
        self.clock, self.began = clock, clock()
        self.deadline = Deadline.after(problem.deadline - min(RESERVE_SHARE * problem.deadline, RESERVE), clock)
        self.problem = problem
        self.prepared = PreparedProblem.of(problem)
        self.known = known
        self.method = METHODS[problem.method]
        self.candidates: list[Candidate] = []
        self.unreachable: list[UnreachableTarget] = []
        self.iterations = self.solves = 0
        self.cut_short = False

    def prepare(self) -> None:
        """Find the candidates, and bound them."""
        problem, prepared = self.problem, self.prepared
        (starts, no_starts), (goals, no_goals) = (ends(prepared, name) for name in ("start", "goal"))
        self.unreachable = no_starts + no_goals
        self.candidates = search.pairs(prepared, starts, goals)
        search.bound(prepared, self.candidates)
        if problem.arm.payload.mass > problem.arm.robot.rated_payload:
            rating = problem.arm.robot.rated_payload
            raise InvalidProblem(
                "payload.mass", f"payload.mass exceeds the robot's rating: give at most {rating:g} kg."
            )

    def solution(self) -> Solution:
        """The answer. Raises the errors of `optimize`."""
        self.prepare()
        for spline in self.known:
            self.warm_start(spline)
        without = self.without_store() if self.has_store else None
        self.explore()
        if without is not None:
            self.accept_if_better(*without)
        if self.best() is None:
            self.find_fastest()
        if self.method.most_solved is None:
            self.candidates += free_goal.refine_goals(self.prepared, self.candidates, self.add_effort, self.deadline)
        while (best := self.best()) is not None:
            self.refine(best)
            table = self.compare_with_baselines(best)
            best = self.best() or best
            answer = self.answer(best, table)
            if answer is not None:
                return answer
            best.status, best.reason, best.energy = "failed", UNCONFIRMED, None
            best.attempt = None
            # what was ruled out by its energy may be the best now
            for candidate in self.candidates:
                if candidate.status == "pruned":
                    candidate.status, candidate.reason = "unvisited", search.UNVISITED
            self.explore()
        if any(candidate.status == "unvisited" for candidate in self.candidates):
            raise DeadlineExceeded([candidate.report() for candidate in self.candidates])
        raise self.no_trajectory()

    def no_trajectory(self) -> NoTrajectory:
        """Why no candidate has a motion: what is in the way, where that is what stopped the best of them."""
        candidates = [candidate.report() for candidate in self.candidates]
        hits = [
            (candidate, candidate.attempt.collision)
            for candidate in self.candidates
            if candidate.attempt and candidate.attempt.collision
        ]
        if not hits:
            return NoTrajectory(candidates)
        candidate, hit = max(hits, key=lambda each: each[1].min_clearance)
        return NoCollisionFreeTrajectory(candidates, hit, candidate.start.label, candidate.goal.label)

    @property
    def has_store(self) -> bool:
        """Whether the objective hangs on a store's charge."""
        return self.problem.arm.bus.mode == "storage" and self.problem.objective == "electrical"

    def explore(self) -> None:
        """Solve candidates until no bound is below the best."""
        free_goal.activate_deferred(self.candidates)
        while True:
            explore(self.prepared, self.candidates, self.attempt, self.deadline, most_solved=self.method.most_solved)
            if self.best() is not None or not free_goal.activate_deferred(self.candidates):
                break

    def attempt(self, candidate: Candidate) -> SolveResult:
        """Solve the candidate in every interval of durations; the outcome of least energy."""
        open_to_it = [w for w in duration_intervals(self.prepared, candidate.q_goal) if w.t_max >= candidate.shortest]
        best, outcomes = self.best(), []
        for interval in open_to_it:
            solver = self.solver(candidate, interval)
            if best is not None and best.energy is not None:
                solver.best_known = best.energy
            outcomes.append(self.add_effort(solver.solve()))
        solved = [outcome for outcome in outcomes if outcome.spline is not None]
        if len(solved) > 1:
            solved.sort(
                key=lambda o: self.prepared.objective_of(self.prepared.energy(o.spline)) if o.spline else np.inf
            )
        late = [outcome for outcome in outcomes if outcome.status is SolveStatus.OUT_OF_TIME]
        self.cut_short |= bool(late)
        return (solved + late + outcomes)[0]

    def without_store(self) -> tuple[Candidate, SolveResult, Energy] | None:
        """The best motion on the same bus without its store, which the store only makes cheaper; None for want of time.

        An answer is never worse than this motion with the store.
        """
        left = self.deadline.left
        if left <= 0:
            return None
        try:
            found = Run(
                replace(self.problem, arm=replace(self.problem.arm, bus=Bus()), deadline=left / 2), clock=self.clock
            ).solution()
        except DeadlineExceeded:
            return None
        self.iterations += found.solver.iterations
        self.solves += found.solver.nlp_solves
        ends = found.start.target, found.goal.target
        same = [e for e in self.candidates if (e.start.target, e.goal.target) == ends]
        candidate = free_goal.between(self.prepared, self.candidates, found.start.q, found.goal.q, same)
        spline = found.trajectory.spline
        outcome = SolveResult(SolveStatus.SOLVED, "converged", spline=spline, stationarity=found.solver.stationarity)
        return candidate, outcome, self.prepared.energy(spline)

    def warm_start(self, spline: Spline) -> None:
        """Begin with a known motion, retimed or hastened to fit: as it is if it holds, improved, and beside it what is
        found from the ground up between its ends."""
        candidate = free_goal.between(
            self.prepared, self.candidates, spline.control_points[0], spline.control_points[-1]
        )
        if candidate.status == "infeasible" or self.deadline.passed:
            return
        least, most = self.problem.duration_min or 0.0, self.problem.duration_max or np.inf
        known = lasting(spline, float(np.clip(spline.duration, least, most)))
        energy = self.prepared.energy(known)
        if self.certified(candidate, known, energy).valid:
            self.accept_if_better(
                candidate, SolveResult(SolveStatus.SOLVED, "a known motion, retimed", spline=known), energy
            )
        self.solve_from(candidate, *sampled(known), fine=self.problem.method == "time_scaling")
        outcome = self.attempt(candidate)
        if outcome.spline is None:
            return
        self.accept_if_better(candidate, outcome, self.prepared.energy(outcome.spline))
        if self.method.may_refine(outcome.spline) and candidate.attempt is not outcome:
            # few control points are no match for the many of a known motion, but may lead to a better place
            self.solve_from(candidate, *sampled(outcome.spline), fine=False)

    def best(self) -> Candidate | None:
        """The solved candidate of least energy."""
        return min((e for e in self.candidates if e.energy is not None), key=lambda e: e.energy or 0.0, default=None)

    def solver(self, candidate: Candidate, interval: DurationInterval) -> Method:
        """What solves the candidate in a interval of durations."""
        return solver_for(self.prepared, candidate.q_start, candidate.q_goal, self.deadline, interval)

    def add_effort(self, outcome: SolveResult) -> SolveResult:
        """Add up what an attempt took."""
        self.iterations += outcome.iterations
        self.solves += outcome.solves
        return outcome

    def find_fastest(self) -> None:
        """No candidate holds the duration: find the fastest motion, and either start from it or say how long it takes.

        Raises DurationTooShort when even the fastest motion found takes longer than allowed.
        """
        longest = self.problem.duration_max
        if longest is None:
            return
        fastest = self.fastest()
        if fastest is None:
            least = min(candidate.shortest for candidate in self.candidates)
            if least > longest:
                raise DurationTooShort(least)
        elif fastest[1].duration > longest:
            raise DurationTooShort(fastest[1].duration)
        else:
            candidate, spline = fastest
            self.solve_from(candidate, *sampled(spline), fine=True)

    def fastest(self) -> tuple[Candidate, Spline] | None:
        """The fastest motion over all candidates, whatever the problem allows, and whose it is; None if none is found
        before the deadline."""
        free_goal.activate_deferred(self.candidates)
        winner, best = None, None
        for candidate in sorted(
            (e for e in self.candidates if e.holdable and not e.deferred), key=lambda e: e.shortest
        ):
            if (best is not None and candidate.shortest >= best.duration) or self.deadline.passed:
                break
            spline = self.fastest_of(candidate)
            if spline is not None and (best is None or spline.duration < best.duration):
                winner, best = candidate, spline
        return None if winner is None or best is None else (winner, best)

    def fastest_of(self, candidate: Candidate) -> Spline | None:
        """The fastest motion of one candidate, whatever the problem allows."""
        return self.add_effort(self.solver(candidate, fastest(self.prepared)).solve()).spline

    def solve_from(
        self,
        candidate: Candidate,
        q: Array,
        t: Array,
        fine: bool,
        surplus_value: float | None = None,
        duration: float | None = None,
    ) -> None:
        """Optimise the candidate from samples q (k, nq) at times t (k,), and keep the outcome if it spends less.

        `surplus_value` [1] is what surplus is taken to be worth where there is a store; `duration` [s] is kept to, if
        given.
        """
        for interval in duration_intervals(self.prepared, candidate.q_goal, surplus_value):
            if duration is not None:
                interval = replace(interval, t_min=duration, t_max=duration)
            outcome = self.add_effort(self.solver(candidate, interval).solve_from(q, t, fine))
            if outcome.spline is not None:
                self.accept_if_better(candidate, outcome, self.prepared.energy(outcome.spline))

    def accept_if_better(self, candidate: Candidate, outcome: SolveResult, energy: Energy) -> None:
        """Take an outcome as the candidate's if it spends less."""
        objective = self.prepared.objective_of(energy)
        if candidate.reason != UNCONFIRMED and (candidate.energy is None or objective < candidate.energy):
            candidate.attempt, candidate.energy, candidate.status, candidate.reason = (
                outcome,
                objective,
                "solved",
                outcome.reason,
            )

    def refine(self, candidate: Candidate) -> None:
        """A finer motion for the winner, where the method has one."""
        assert candidate.attempt is not None and candidate.attempt.spline is not None
        if self.method.may_refine(candidate.attempt.spline) and not self.deadline.passed:
            self.solve_from(candidate, *sampled(candidate.attempt.spline), fine=False)
        if self.has_store and self.method.guess_baselines:
            for share in SURPLUS_VALUES:
                if not self.deadline.passed:
                    worth = self.problem.arm.regeneration
                    surplus_value = worth + share * max(self.problem.arm.bus.efficiency - worth, 0.0)
                    self.solve_from(
                        candidate, *sampled(candidate.attempt.spline), fine=False, surplus_value=surplus_value
                    )
        longest, spline = self.problem.duration_max or 0.0, candidate.attempt.spline
        slower = self.problem.objective == "mechanical" and spline.duration < longest * (1 - SLACK)
        if slower and self.method.guess_baselines and not self.deadline.passed:
            # the smoothed corners of |tau v| charge for time, as the work does not: a free duration ends too soon
            self.solve_from(
                candidate, *sampled(retimed(spline, longest / spline.duration)), fine=False, duration=longest
            )

    def compare_with_baselines(self, best: Candidate) -> list[Baseline]:
        """The baselines; where one of them is feasible and better, it becomes the first guess of a finer attempt.

        Only baselines that the method can learn from, and only those of its own kind are adopted: what another
        parametrisation does better is not this one's answer.
        """
        for last, fine in ((False, False), (False, True), (True, True)):
            table, q_nearest = self.baselines(best)
            better = [b.name for b in table if b.within_limits and b.saving < -SLACK and self.allows(b.duration)]
            better = [
                name
                for name in better
                if name in (self.method.accepted_baselines if last else self.method.guess_baselines)
            ]
            if not better:
                return table
            candidate = next(
                e for e in self.candidates if (e.q_start == best.q_start).all() and (e.q_goal == q_nearest).all()
            )
            if candidate.reason == UNCONFIRMED:
                return table
            if last:
                self.accept_baseline(candidate, better)
                break
            motions = guesses(self.problem, best.q_start, q_nearest, best.duration)
            for name in better:
                if not self.deadline.passed:
                    self.solve_from(candidate, motions[name].q, motions[name].t, fine)
            best = self.best() or best
        return self.baselines(self.best() or best)[0]

    def baselines(self, best: Candidate) -> tuple[list[Baseline], Array]:
        """What other methods spend, and the nearest goal (nq,) that they go to."""
        assert best.energy is not None
        q_goals = np.array([e.q_goal for e in self.candidates if (e.q_start == best.q_start).all()])
        prepared = self.prepared
        oracle = prepared.torques, prepared.potential, prepared.satisfies_path_constraints
        table = baselines(self.problem, best.q_start, q_goals, best.duration, best.energy, *oracle)
        return table, nearest(self.problem, best.q_start, q_goals)

    def accept_baseline(self, candidate: Candidate, better: list[BaselineName]) -> None:
        """A baseline that no spline tried comes up to is itself the answer, where a spline can be just that."""
        best = self.best()
        assert best is not None
        fastest = time_optimal_spline(self.problem.arm.active_limits, candidate.q_start, candidate.q_goal)
        motions: dict[BaselineName, Spline] = {
            "ruckig": fastest,
            "ruckig_slowed": retimed(fastest, best.duration / fastest.duration),
            "quintic": quintic_spline(candidate.q_start, candidate.q_goal, best.duration),
        }
        for name in better:
            needed = least_time_scale(motions[name], self.problem.arm.active_limits.rates)
            spline = retimed(motions[name], max(needed, 1.0))
            energy = self.prepared.energy(spline)
            if self.allows(spline.duration) and self.certified(candidate, spline, energy).valid:
                self.accept_if_better(
                    candidate, SolveResult(SolveStatus.SOLVED, f"the {name} motion itself", spline=spline), energy
                )

    def certified(self, candidate: Candidate, spline: Spline, energy: Energy) -> Certificate:
        """The certificate of the candidate's motion, against the very targets that the candidate is of."""
        asked = narrowed(self.problem, candidate.start.target, candidate.goal.target)
        return certify(asked, spline, candidate.q_start, candidate.q_goal, energy)

    def allows(self, duration: float) -> bool:
        """Whether the request lets a motion take that long; a baseline between equal ends takes no time at all."""
        least, most = self.problem.duration_min or LEAST_DURATION, self.problem.duration_max or np.inf
        return bool(least * (1 - SLACK) <= duration <= most * (1 + SLACK))

    def answer(self, best: Candidate, table: list[Baseline]) -> Solution | None:
        """The solution around the best candidate, None when its certificate fails."""
        assert best.attempt is not None and best.attempt.spline is not None
        spline = best.attempt.spline
        energy = self.prepared.energy(spline)
        certificate = self.certified(best, spline, energy)
        if not certificate.valid:
            return None
        open_ends = [e for e in self.candidates if e.status in ("unvisited", "failed")]
        for candidate in open_ends:
            if candidate.lower_bound >= self.prepared.objective_of(energy):
                candidate.status, candidate.reason = "pruned", PRUNED
        # a continuum is never searched through: it counts as done only where its bound rules it out
        family = family_bound_of(self.prepared, self.candidates, self.deadline)
        done = all(e.status == "pruned" for e in open_ends) and family >= self.prepared.objective_of(energy)
        return Solution(
            status="optimal" if done and self.method.converges and not self.cut_short else "feasible",
            start=Branch(best.start.label, best.q_start, best.start.target),
            goal=Branch(best.goal.label, best.q_goal, best.goal.target),
            trajectory=self.prepared.trajectory(spline, self.problem.sample_period),
            energy=energy,
            lower_bound=min([family, *(e.lower_bound for e in self.candidates if e.goal.tolerance is None)]),
            baselines=table,
            candidates=[e.report() for e in self.candidates],
            unreachable=self.unreachable,
            certificate=certificate,
            solver=SolverReport(
                wall_time=self.clock() - self.began,
                iterations=self.iterations,
                nlp_solves=self.solves,
                stationarity=best.attempt.stationarity,
            ),
        )
