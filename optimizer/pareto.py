"""Public entry point: `pareto(problem, points)` finds the front of energy and duration.

The last point is the answer of `optimize`, or of a search from a motion of less energy. A motion
with less energy only within the scatter of solves is the same optimum.

Between two neighbours the front lies within the rectangle they span: a slower motion than the left
one is dominated unless it needs less energy, and no motion needs less energy than the right one.
Durations are therefore chosen one by one, as the geometric mean of the two neighbours whose
rectangle has the longest sides in log T and energy.

If two neighbours belong to different candidates, the front may jump between them. The candidate of
the right one has a fastest motion of its own. If this is slower than the left point, the jump is at
its duration. This duration is tried next, with one just below it, as bisection would only converge
to it.

A duration is solved with a warm start from the motions on both sides and without one, and so is
every other candidate with a lower bound below the best energy for this duration.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

from joulepath.optimizer.deadline import Clock
from joulepath.optimizer.exceptions import DeadlineExceeded, InvalidProblem, NoTrajectory
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.problem.declared_types import checked_arguments
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.progress import (
    CandidatesFound,
    CandidateTried,
    Improved,
    Tell,
    no_listener,
    only_news,
)
from joulepath.optimizer.result.front import Dropped, Front, FrontSolver
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.search.errors import DurationTooShort
from joulepath.optimizer.search.fastest import fastest, fastest_of
from joulepath.optimizer.search.finishing_time import report_time
from joulepath.optimizer.search.front_nodes import FrontNode, distinct, next_interval, switches
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.search.sampled_ends import between


@dataclass(frozen=True)
class ParetoSettings:
    """Settings of the front."""

    least_points: int = 2
    """Least number of points."""
    most_points: int = 100
    """Most points."""
    share_of_end: float = 1 / 3
    """Share of the time left for the fastest motion, and for either end of the front."""
    before_jump: tuple[float, ...] = (1e-4, 1e-3)
    """Relative distances below the duration of a jump at which the front before it is solved."""
    least_time: float = 1e-3
    """Least deadline of a search [s]."""
    same_energy: float = 1e-3
    """Relative difference up to which two energies are the same optimum, the scatter of solves."""


PARETO = ParetoSettings()


@checked_arguments
def pareto(
    problem: Problem,
    points: int = 12,
    clock: Clock = time.perf_counter,
    tell: Tell = no_listener,
    progress: bool = True,
) -> Front:
    """Find the front of energy over duration, from the fastest motion to the motion of least
    energy.

    Args:
        problem: problem with a free or bounded duration. The mechanical objective needs
            `duration_max`. Its `deadline` holds for the whole front.
        points: largest number of motions, 2 to 100.
        clock: function that returns the time [s].
        tell: receives the progress: durations as candidates, and the motion of least energy.
        progress: whether a bar may show the progress, as of `optimize`.

    Returns:
        The motions of the front, fastest first.

    Raises:
        JoulepathError: as `optimize`; InvalidProblem also for a fixed duration, or too many points.
    """
    least, most = PARETO.least_points, PARETO.most_points
    if points not in range(least, most + 1):
        raise InvalidProblem("points", f"points must be a whole number from {least} to {most}.")
    if problem.has_fixed_duration:
        raise InvalidProblem(
            "duration", "A front runs over durations: leave duration out or give a range."
        )
    with one_thread(), progress_bar("Finding the front", tell, progress) as tell:
        return _Search(problem, points, clock, only_news(tell)).front()


class _Search:
    """Computation of one front."""

    def __init__(self, problem: Problem, n: int, clock: Clock, tell: Tell) -> None:
        self.clock, self.began = clock, clock()
        self.problem, self.n, self.tell = problem, n, tell
        self.nodes: list[FrontNode] = []
        self.solves = 0
        self.least: FrontNode
        self.fastest_run = self.run([])
        self.tried: set[bytes] = set()
        self.cut_short = False

    def front(self) -> Front:
        """The front. Raises the errors of `pareto`."""
        self.tell(CandidatesFound(self.n))
        spline, found = self.fastest()
        problem = self.problem
        first = max(spline.duration, problem.duration_min or 0.0)
        # solved first, so that it is known even if the deadline passes before the other end is
        self.solve(first, [spline])
        # solved as by `optimize`: with the same durations, without the knowledge of the front
        self.least = (
            self.add(self.run([]), problem.duration_max or math.inf)
            if found is None
            else self.keep(found)
        )
        if (answer := self.least.answer) is not None:
            best = Improved(self.least.energy, answer.duration, answer.lower_bound, answer.goal.q)
            self.tell(best)
        while (
            len(self.nodes) < self.n
            and self.left() > 0
            and (k := next_interval(self.nodes)) is not None
        ):
            left, right = self.nodes[k : k + 2]
            if len(self.nodes) == self.n - 1 and self.refine_last():
                break
            if switches(left, right) and self.try_switch(left, right):
                continue
            known = [node.spline for node in (left, right) if node.spline is not None]
            self.solve(math.sqrt(left.duration * right.duration), known)
        # a dominated answer counts, too: solved to its end, it might not be dominated
        solved = all(
            node.answer.status == "optimal" for node in self.nodes if node.answer is not None
        )
        complete = self.left() > 0 and not self.cut_short and solved
        return self.result(min(spline.duration, self.nodes[0].duration), complete)

    def fastest(self) -> tuple[Spline, Solution | None]:
        """The fastest motion, and the answer of least energy if it was needed to find the former.

        If no candidate has a motion from the starts of the search for the fastest motion, the
        motion of least energy is a further start. Raises the errors of `optimize`.
        """
        self.fastest_run.prepare()
        found, answer = fastest(self.fastest_run.state), None
        self.note_end(self.fastest_run)
        if found is None:
            run = self.run([])
            try:
                answer = run.solution()
                found = fastest(run.state, [answer.trajectory.spline])
            finally:
                self.note_end(run)
                self.solves += run.state.solves
            if found is None:
                return answer.trajectory.spline, answer
        if found.duration > (self.problem.duration_max or math.inf):
            raise found.too_slow
        return found.spline, answer

    def note_end(self, run: Run) -> None:
        """Record whether the deadline ended a search for a fastest motion, which has a share of the
        time.
        """
        self.cut_short |= run.state.deadline.passed

    def left(self) -> float:
        """Time left [s], without the time to encode the answers so far."""
        report = sum(
            report_time(self.problem, node.answer) for node in self.nodes if node.answer is not None
        )
        return self.began + self.problem.deadline - report - self.clock()

    def run(
        self, known: list[Spline], least: float | None = None, most: float | None = None
    ) -> Run:
        """A search between two durations [s], with its share of the time left."""
        problem = self.problem
        share = 1 / max(self.n - len(self.nodes), 1)
        if len(self.nodes) < PARETO.least_points:
            share = max(share, PARETO.share_of_end)
        return Run(
            replace(
                problem,
                deadline=max(share * self.left(), PARETO.least_time),
                duration_min=problem.duration_min if least is None else least,
                duration_max=problem.duration_max if most is None else most,
            ),
            known,
            self.clock,
        )

    def solve(self, duration: float, known: list[Spline]) -> FrontNode:
        """Solve for one duration [s]."""
        return self.add(self.run(known, duration, duration), duration)

    def add(self, run: Run, duration: float) -> FrontNode:
        """Run a search and keep its result; `duration` [s] is its place in the front without a
        motion.
        """
        try:
            return self.keep(run.solution())
        except (DeadlineExceeded, DurationTooShort, NoTrajectory) as error:
            # a search has a share of the time: the front may have time left and lack this answer
            self.cut_short |= isinstance(error, DeadlineExceeded)
            return self.insert(FrontNode(duration, None, reason=str(error)))
        finally:
            self.solves += run.state.solves

    def keep(self, answer: Solution) -> FrontNode:
        """Node of an answer."""
        return self.insert(
            FrontNode(answer.duration, answer, answer.energy.of(self.problem.objective))
        )

    def insert(self, node: FrontNode) -> FrontNode:
        """Insert a node by its duration."""
        self.nodes.append(node)
        self.nodes.sort(key=lambda node: (node.duration, node.energy))
        self.tell_tried(node)
        return node

    def tell_tried(self, node: FrontNode) -> None:
        """Tell the outcome of the last duration."""
        index, answer = len(self.nodes) - 1, node.answer
        if answer is None:
            self.tell(CandidateTried(index, "failed", None, None))
        else:
            self.tell(CandidateTried(index, "solved", answer.lower_bound, node.energy))
            self.tell(Improved(node.energy, node.duration, q_goal=answer.goal.q))

    def try_switch(self, left: FrontNode, right: FrontNode) -> bool:
        """Solve for the fastest duration of the right candidate, and just below.

        Returns:
            False if this duration is not between the two nodes.
        """
        assert right.answer is not None
        q_start, q_goal = right.answer.start.q, right.answer.goal.q
        key = q_start.tobytes() + q_goal.tobytes()
        if key in self.tried:
            return False
        self.tried.add(key)
        run = self.run([])
        try:
            run.prepare()
        except DeadlineExceeded:
            self.cut_short = True
            return False
        candidate = between(run.state.prepared, run.state.candidates, q_start, q_goal)
        spline = fastest_of(run.state, candidate)
        self.note_end(run)
        self.solves += run.state.solves
        if spline is None or not distinct(left.duration, spline.duration):
            return False
        durations = [spline.duration * (1 - share) for share in PARETO.before_jump]
        if distinct(spline.duration, right.duration):
            self.solve(spline.duration, [spline])
        for duration in durations:
            if len(self.nodes) == self.n or not distinct(left.duration, duration):
                break
            if switches(self.solve(duration, [] if left.spline is None else [left.spline]), right):
                break
        return True

    def refine_last(self) -> bool:
        """Search the end of least energy again from the motion of least energy, if it is another
        node.
        """
        least_energy = min(self.nodes, key=lambda node: node.energy)
        if (
            not self.beats_least(least_energy)
            or least_energy is self.nodes[-1]
            or least_energy.spline is None
        ):
            return False
        most = self.problem.duration_max or math.inf
        self.add(self.run([least_energy.spline], least=self.nodes[0].duration), most)
        return True

    def beats_least(self, node: FrontNode) -> bool:
        """Whether a node needs less energy than the answer of `optimize`, by more than the scatter
        of solves.
        """
        scatter = PARETO.same_energy * abs(self.least.energy)
        return self.least.answer is None or node.energy < self.least.energy - scatter

    def same_as_least(self, node: FrontNode) -> bool:
        """Whether a node needs less energy than the answer of `optimize`, within the scatter of
        solves.
        """
        return (
            node is not self.least
            and node.energy <= self.least.energy
            and not self.beats_least(node)
        )

    def result(self, shortest: float, complete: bool) -> Front:
        """The front without dominated nodes."""
        points, dropped, least = list[Solution](), list[Dropped](), math.inf
        for node in self.nodes:
            if node.answer is None:
                dropped.append(Dropped(node.duration, None, node.reason))
            elif self.same_as_least(node):
                reason = (
                    "the same least energy as that of the last point, within the accuracy of "
                    "the solver"
                )
                dropped.append(Dropped(node.duration, node.energy, reason))
            elif points and (node.duration, node.energy) == (points[-1].duration, least):
                continue  # the same motion found twice
            elif node.energy >= least:
                reason = (
                    f"dominated: the motion of {points[-1].duration:.4f} s is no slower and "
                    "needs no more energy"
                )
                dropped.append(Dropped(node.duration, node.energy, reason))
            else:
                points.append(node.answer)
                least = node.energy
        if not points:
            reports = [each.report() for each in self.fastest_run.state.candidates]
            raise DeadlineExceeded(reports)
        solves = self.solves + self.fastest_run.state.solves
        return Front(
            status="optimal" if complete else "feasible",
            shortest=shortest,
            points=points,
            dropped=[each for each in dropped if math.isfinite(each.duration)],
            solver=FrontSolver(wall_time=self.clock() - self.began, nlp_solves=solves),
        )
