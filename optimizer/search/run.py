"""The search for one problem's motion of least energy."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from models.robot import Array
from optimizer.certificate import certify
from optimizer.exceptions import (
    DeadlineExceeded,
    DurationTooShort,
    InvalidProblem,
    NoCollisionFreeTrajectory,
    NoTrajectory,
)
from optimizer.methods import METHODS, solver_for
from optimizer.methods.duration_intervals import Window, fastest, windows
from optimizer.methods.method import Attempt, Solver
from optimizer.prepared_problem import Task
from optimizer.problem.bus import Bus
from optimizer.problem.problem import LEAST_DURATION, Problem, narrowed
from optimizer.search import candidates as search
from optimizer.search import free_goal
from optimizer.search.baselines import baselines, guesses, nearest
from optimizer.search.branch_and_bound import PRUNED, explore
from optimizer.search.candidates import Entry
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
from optimizer.trajectories.spline import Spline, peak_rates, sampled, slowed, stretch
from optimizer.trajectories.time_scalings import quintic_spline

# share of the deadline kept for checking and reporting the answer, at most [s]
RESERVE_SHARE, RESERVE = 0.2, 0.1
# a baseline counts as better only beyond the quadrature's own error
SLACK = 1e-6
# what a joule of surplus may be worth where a store has not room for all of it, between burning it and storing it
CREDITS = (0.75, 0.5, 0.25)
UNCONFIRMED = "the certificate did not confirm it"


class Run:
    """One problem being worked on: its candidates and what was spent on them.

    `known` are motions between its ends, of any duration, to begin with.
    """

    def __init__(self, problem: Problem, known: Sequence[Spline] = ()) -> None:
        self.began = time.perf_counter()
        self.deadline = self.began + problem.deadline - min(RESERVE_SHARE * problem.deadline, RESERVE)
        self.problem = problem
        self.task = Task.of(problem)
        self.known = known
        self.method = METHODS[problem.method]
        self.entries: list[Entry] = []
        self.unreachable: list[UnreachableTarget] = []
        self.iterations = self.solves = 0
        self.cut_short = False

    def prepare(self) -> None:
        """Find the candidates, and bound them."""
        problem, task = self.problem, self.task
        (starts, no_starts), (goals, no_goals) = (ends(task, name) for name in ("start", "goal"))
        self.unreachable = no_starts + no_goals
        self.entries = search.pairs(task, starts, goals)
        search.bound(task, self.entries)
        if problem.arm.payload.mass > problem.arm.robot.rated_payload:
            rating = problem.arm.robot.rated_payload
            raise InvalidProblem(
                "payload.mass", f"payload.mass exceeds the robot's rating: give at most {rating:g} kg."
            )

    def solution(self) -> Solution:
        """The answer. Raises the errors of `optimize`."""
        self.prepare()
        for spline in self.known:
            self.begin(spline)
        without = self.without_store() if self.has_store else None
        self.explore()
        if without is not None:
            self.keep(*without)
        if self.best() is None:
            self.race()
        if self.method.most_solved is None:
            self.entries += free_goal.tours(self.task, self.entries, self.count, self.deadline)
        while (best := self.best()) is not None:
            self.refine(best)
            table = self.compared(best)
            best = self.best() or best
            answer = self.answer(best, table)
            if answer is not None:
                return answer
            best.status, best.reason, best.energy = "failed", UNCONFIRMED, None
            best.attempt = None
            # what was ruled out by its energy may be the best now
            for entry in self.entries:
                if entry.status == "pruned":
                    entry.status, entry.reason = "unvisited", search.UNVISITED
            self.explore()
        if any(entry.status == "unvisited" for entry in self.entries):
            raise DeadlineExceeded([entry.report() for entry in self.entries])
        raise self.no_trajectory()

    def no_trajectory(self) -> NoTrajectory:
        """Why no candidate has a motion: what is in the way, where that is what stopped the best of them."""
        candidates = [entry.report() for entry in self.entries]
        hits = [(entry, entry.attempt.hit) for entry in self.entries if entry.attempt and entry.attempt.hit]
        if not hits:
            return NoTrajectory(candidates)
        entry, hit = max(hits, key=lambda each: each[1].min_clearance)
        return NoCollisionFreeTrajectory(candidates, hit, entry.start.label, entry.goal.label)

    @property
    def has_store(self) -> bool:
        """Whether the objective hangs on a store's charge."""
        return self.problem.arm.bus.mode == "storage" and self.problem.objective == "electrical"

    def explore(self) -> None:
        """Solve candidates until no bound is below the best."""
        free_goal.release(self.entries)
        while True:
            explore(self.task, self.entries, self.attempt, self.deadline, most_solved=self.method.most_solved)
            if self.best() is not None or not free_goal.release(self.entries):
                break

    def attempt(self, entry: Entry) -> Attempt:
        """Solve the entry in every window of durations; the outcome of least energy."""
        open_to_it = [w for w in windows(self.task, entry.q_goal) if w.t_max >= entry.shortest]
        best, outcomes = self.best(), []
        for window in open_to_it:
            solver = self.solver(entry, window)
            if best is not None and best.energy is not None:
                solver.best_known = best.energy
            outcomes.append(self.count(solver.solve()))
        solved = [outcome for outcome in outcomes if outcome.spline is not None]
        if len(solved) > 1:
            solved.sort(key=lambda o: self.task.objective_of(self.task.energy(o.spline)) if o.spline else np.inf)
        late = [outcome for outcome in outcomes if outcome.status == "out of time"]
        self.cut_short |= bool(late)
        return (solved + late + outcomes)[0]

    def without_store(self) -> tuple[Entry, Attempt, Energy] | None:
        """The best motion on the same bus without its store, which the store only makes cheaper; None for want of time.

        An answer is never worse than this motion with the store.
        """
        left = self.deadline - time.perf_counter()
        if left <= 0:
            return None
        try:
            found = Run(replace(self.problem, arm=replace(self.problem.arm, bus=Bus()), deadline=left / 2)).solution()
        except DeadlineExceeded:
            return None
        self.iterations += found.solver.iterations
        self.solves += found.solver.nlp_solves
        ends = found.start.target, found.goal.target
        same = [e for e in self.entries if (e.start.target, e.goal.target) == ends]
        entry = free_goal.between(self.task, self.entries, found.start.q, found.goal.q, same)
        spline = found.trajectory.spline
        outcome = Attempt("solved", "converged", spline=spline, stationarity=found.solver.stationarity)
        return entry, outcome, self.task.energy(spline)

    def begin(self, spline: Spline) -> None:
        """Begin with a known motion, slowed or hastened to fit: as it is if it holds, improved, and beside it what is
        found from the ground up between its ends."""
        entry = free_goal.between(self.task, self.entries, spline.control_points[0], spline.control_points[-1])
        if entry.status == "infeasible" or time.perf_counter() > self.deadline:
            return
        least, most = self.problem.duration_min or 0.0, self.problem.duration_max or np.inf
        retimed = replace(spline, knots=spline.knots * (np.clip(spline.duration, least, most) / spline.duration))
        energy = self.task.energy(retimed)
        if self.certified(entry, retimed, energy).valid:
            self.keep(entry, Attempt("solved", "a known motion, retimed", spline=retimed), energy)
        self.learn(entry, *sampled(retimed), fine=self.problem.method == "time_scaling")
        outcome = self.attempt(entry)
        if outcome.spline is None:
            return
        self.keep(entry, outcome, self.task.energy(outcome.spline))
        if self.method.may_refine(outcome.spline) and entry.attempt is not outcome:
            # few control points are no match for the many of a known motion, but may lead to a better place
            self.learn(entry, *sampled(outcome.spline), fine=False)

    def best(self) -> Entry | None:
        """The solved entry of least energy."""
        return min((e for e in self.entries if e.energy is not None), key=lambda e: e.energy or 0.0, default=None)

    def solver(self, entry: Entry, window: Window) -> Solver:
        """What solves the entry in a window of durations."""
        return solver_for(self.task, entry.q_start, entry.q_goal, self.deadline, window)

    def count(self, outcome: Attempt) -> Attempt:
        """Add up what an attempt took."""
        self.iterations += outcome.iterations
        self.solves += outcome.solves
        return outcome

    def race(self) -> None:
        """No candidate holds the duration: find the fastest motion, and either start from it or say how long it takes.

        Raises DurationTooShort when even the fastest motion found takes longer than allowed.
        """
        longest = self.problem.duration_max
        if longest is None:
            return
        fastest = self.fastest()
        if fastest is None:
            least = min(entry.shortest for entry in self.entries)
            if least > longest:
                raise DurationTooShort(least)
        elif fastest[1].duration > longest:
            raise DurationTooShort(fastest[1].duration)
        else:
            entry, spline = fastest
            self.learn(entry, *sampled(spline), fine=True)

    def fastest(self) -> tuple[Entry, Spline] | None:
        """The fastest motion over all candidates, whatever the problem allows, and whose it is; None if none is found
        before the deadline."""
        free_goal.release(self.entries)
        winner, best = None, None
        for entry in sorted((e for e in self.entries if e.holdable and not e.held_back), key=lambda e: e.shortest):
            if (best is not None and entry.shortest >= best.duration) or time.perf_counter() > self.deadline:
                break
            spline = self.fastest_of(entry)
            if spline is not None and (best is None or spline.duration < best.duration):
                winner, best = entry, spline
        return None if winner is None or best is None else (winner, best)

    def fastest_of(self, entry: Entry) -> Spline | None:
        """The fastest motion of one candidate, whatever the problem allows."""
        return self.count(self.solver(entry, fastest(self.task)).solve()).spline

    def learn(
        self, entry: Entry, q: Array, t: Array, fine: bool, credit: float | None = None, duration: float | None = None
    ) -> None:
        """Optimise the entry from samples q (k, nq) at times t (k,), and keep the outcome if it spends less.

        `credit` [1] is what surplus is taken to be worth where there is a store; `duration` [s] is kept to, if given.
        """
        for window in windows(self.task, entry.q_goal, credit):
            if duration is not None:
                window = replace(window, t_min=duration, t_max=duration)
            outcome = self.count(self.solver(entry, window).learn(q, t, fine))
            if outcome.spline is not None:
                self.keep(entry, outcome, self.task.energy(outcome.spline))

    def keep(self, entry: Entry, outcome: Attempt, energy: Energy) -> None:
        """Take an outcome as the entry's if it spends less."""
        objective = self.task.objective_of(energy)
        if entry.reason != UNCONFIRMED and (entry.energy is None or objective < entry.energy):
            entry.attempt, entry.energy, entry.status, entry.reason = outcome, objective, "solved", outcome.reason

    def refine(self, entry: Entry) -> None:
        """A finer motion for the winner, where the method has one."""
        assert entry.attempt is not None and entry.attempt.spline is not None
        if self.method.may_refine(entry.attempt.spline) and time.perf_counter() < self.deadline:
            self.learn(entry, *sampled(entry.attempt.spline), fine=False)
        if self.has_store and self.method.learns:
            for share in CREDITS:
                if time.perf_counter() < self.deadline:
                    worth = self.problem.arm.regeneration
                    credit = worth + share * max(self.problem.arm.bus.efficiency - worth, 0.0)
                    self.learn(entry, *sampled(entry.attempt.spline), fine=False, credit=credit)
        longest, spline = self.problem.duration_max or 0.0, entry.attempt.spline
        slower = self.problem.objective == "mechanical" and spline.duration < longest * (1 - SLACK)
        if slower and self.method.learns and time.perf_counter() < self.deadline:
            # the smoothed corners of |tau v| charge for time, as the work does not: a free duration ends too soon
            self.learn(entry, *sampled(slowed(spline, longest / spline.duration)), fine=False, duration=longest)

    def compared(self, best: Entry) -> list[Baseline]:
        """The baselines; where one of them is feasible and better, it becomes the first guess of a finer attempt.

        Only baselines that the method can learn from, and only those of its own kind are adopted: what another
        parametrisation does better is not this one's answer.
        """
        for last, fine in ((False, False), (False, True), (True, True)):
            table, q_nearest = self.baselines(best)
            better = [b.name for b in table if b.within_limits and b.saving < -SLACK and self.allows(b.duration)]
            better = [name for name in better if name in (self.method.adopts if last else self.method.learns)]
            if not better:
                return table
            entry = next(e for e in self.entries if (e.q_start == best.q_start).all() and (e.q_goal == q_nearest).all())
            if entry.reason == UNCONFIRMED:
                return table
            if last:
                self.adopt(entry, better)
                break
            motions = guesses(self.problem, best.q_start, q_nearest, best.duration)
            for name in better:
                if time.perf_counter() < self.deadline:
                    self.learn(entry, motions[name].q, motions[name].t, fine)
            best = self.best() or best
        return self.baselines(self.best() or best)[0]

    def baselines(self, best: Entry) -> tuple[list[Baseline], Array]:
        """What other methods spend, and the nearest goal (nq,) that they go to."""
        assert best.energy is not None
        q_goals = np.array([e.q_goal for e in self.entries if (e.q_start == best.q_start).all()])
        task = self.task
        oracle = task.torques, task.potential, task.keeps_path
        table = baselines(self.problem, best.q_start, q_goals, best.duration, best.energy, *oracle)
        return table, nearest(self.problem, best.q_start, q_goals)

    def adopt(self, entry: Entry, better: list[BaselineName]) -> None:
        """A baseline that no spline tried comes up to is itself the answer, where a spline can be just that."""
        best = self.best()
        assert best is not None
        fastest = time_optimal_spline(self.problem.arm.active_limits, entry.q_start, entry.q_goal)
        motions: dict[BaselineName, Spline] = {
            "ruckig": fastest,
            "ruckig_slowed": slowed(fastest, best.duration / fastest.duration),
            "quintic": quintic_spline(entry.q_start, entry.q_goal, best.duration),
        }
        for name in better:
            limits = self.problem.arm.active_limits
            needed = stretch(peak_rates(motions[name]) / np.stack([limits.v_max, limits.a_max, limits.j_max]))
            spline = slowed(motions[name], max(needed, 1.0))
            energy = self.task.energy(spline)
            if self.allows(spline.duration) and self.certified(entry, spline, energy).valid:
                self.keep(entry, Attempt("solved", f"the {name} motion itself", spline=spline), energy)

    def certified(self, entry: Entry, spline: Spline, energy: Energy) -> Certificate:
        """The certificate of the entry's motion, against the very targets that the entry is of."""
        asked = narrowed(self.problem, entry.start.target, entry.goal.target)
        return certify(asked, spline, entry.q_start, entry.q_goal, energy)

    def allows(self, duration: float) -> bool:
        """Whether the request lets a motion take that long; a baseline between equal ends takes no time at all."""
        least, most = self.problem.duration_min or LEAST_DURATION, self.problem.duration_max or np.inf
        return bool(least * (1 - SLACK) <= duration <= most * (1 + SLACK))

    def answer(self, best: Entry, table: list[Baseline]) -> Solution | None:
        """The solution around the best entry, None when its certificate fails."""
        assert best.attempt is not None and best.attempt.spline is not None
        spline = best.attempt.spline
        energy = self.task.energy(spline)
        certificate = self.certified(best, spline, energy)
        if not certificate.valid:
            return None
        open_ends = [e for e in self.entries if e.status in ("unvisited", "failed")]
        for entry in open_ends:
            if entry.lower_bound >= self.task.objective_of(energy):
                entry.status, entry.reason = "pruned", PRUNED
        # a continuum is never searched through: it counts as done only where its bound rules it out
        family = family_bound_of(self.task, self.entries, self.deadline)
        done = all(e.status == "pruned" for e in open_ends) and family >= self.task.objective_of(energy)
        return Solution(
            status="optimal" if done and self.method.converges and not self.cut_short else "feasible",
            start=Branch(best.start.label, best.q_start, best.start.target),
            goal=Branch(best.goal.label, best.q_goal, best.goal.target),
            trajectory=self.task.trajectory(spline, self.problem.sample_period),
            energy=energy,
            lower_bound=min([family, *(e.lower_bound for e in self.entries if e.goal.loose is None)]),
            baselines=table,
            candidates=[e.report() for e in self.entries],
            unreachable=self.unreachable,
            certificate=certificate,
            solver=SolverReport(
                wall_time=time.perf_counter() - self.began,
                iterations=self.iterations,
                nlp_solves=self.solves,
                stationarity=best.attempt.stationarity,
            ),
        )
