"""Certified motions of single pairs of configurations of a cycle."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from joulepath.optimizer.certificate import certify
from joulepath.optimizer.cycle.known_motions import KnownMotion, KnownMotions, known_motions
from joulepath.optimizer.cycle.lazy_search import Pair
from joulepath.optimizer.cycle.legs import Leg
from joulepath.optimizer.cycle.move_problem import problem_of
from joulepath.optimizer.cycle.passing_leg import PassingLeg, Route
from joulepath.optimizer.deadline import Clock, Deadline
from joulepath.optimizer.exceptions import DeadlineExceeded, NoTrajectory
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.stops import PlannedMove
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.search.run import Run


@dataclass(frozen=True)
class PairSolverSettings:
    """Settings of the solver of single pairs."""

    kept_share: float = 0.08
    """Share of the deadline kept to certify a simpler cycle of less energy."""


PAIR_SOLVER = PairSolverSettings()


class PairSolver:
    """Solves and certifies the motion of a pair as `optimize` does.

    Solutions are kept in `solutions`, and the motions of optimal ones in the `KnownMotions` of the
    context.

    Args:
        cycle: the cycle.
        moves: its moves, or all moves of a cycle with a free order.
        legs: leg of every move.
        clock: function that returns the time [s].
        end: deadline of the cycle.
    """

    def __init__(
        self,
        cycle: Cycle,
        moves: Sequence[PlannedMove],
        legs: Sequence[Leg],
        clock: Clock,
        end: Deadline,
    ) -> None:
        self.cycle, self.moves, self.legs, self.clock, self.end = cycle, moves, legs, clock, end
        self.solutions: dict[Pair, Solution] = {}
        self.known_motions: KnownMotions = known_motions()
        # motions with a rest at every pass of a pair, along one of its routes
        self._stopping: dict[Pair, tuple[Route, Spline]] = {}

    def problem(self, pair: Pair, time: float) -> Problem:
        """Problem of a pair with a deadline of `time` [s]."""
        k, s, g = pair
        leg = self.legs[k]
        problem = problem_of(self.cycle, self.moves[k], leg.start.q[s], leg.goal.q[g], time)
        return replace(problem, passes=leg.passes(s, g))

    def run(self, k: int, problem: Problem, known: Sequence[Spline] = ()) -> Run:
        """Search for a motion of leg `k`, from known motions."""
        run = Run(problem, known, self.clock, models=self.legs[k].prepared.models)
        trace = self.legs[k].trace_of(problem)
        if trace is not None:
            run.state.prepared.followed.keep(trace)
        return run

    def confirms(self, k: int, s: int, g: int, spline: Spline) -> bool:
        """Whether the certificate confirms a motion of a pair."""
        leg, problem = self.legs[k], self.problem((k, s, g), self.cycle.deadline)
        return certify(
            problem, spline, leg.start.q[s], leg.goal.q[g], leg.prepared.energy(spline)
        ).valid

    def certified(self, k: int, s: int, g: int, motion: Spline) -> Solution:
        """Solution with a given motion of a pair.

        Raises:
            NoTrajectory: the certificate does not confirm the motion.
            DeadlineExceeded: no time is left.
        """
        return self.run(k, self.problem((k, s, g), self.end.left)).as_it_is(motion)

    def solve_in(
        self, k: int, s: int, g: int, duration: float, guesses: Sequence[Spline] = ()
    ) -> Solution:
        """Certified motion of a pair in a given duration.

        Args:
            k: number of the leg.
            s: node at the start.
            g: node at the goal.
            duration: duration of the motion [s].
            guesses: known motions, of any duration, to start from.

        Raises:
            JoulepathError: the errors of `optimize`.
        """
        pair = k, s, g
        kept = PAIR_SOLVER.kept_share * self.cycle.deadline
        problem = self.problem(pair, self.end_of_leg(k, kept).left)
        fixed = replace(problem, duration_min=duration, duration_max=duration)
        own, known = self.solutions.get(pair), [*self.guesses(*pair), *guesses]
        if own is not None and self.moves[k].tool_path is not None:
            # a path followed nearly as fast as possible is not found again without a guess
            known.append(own.trajectory.spline)
        key = self.known_motions.key("finished", fixed, known)
        return self._recalled(k, key, fixed) or self._kept(
            key, self.run(k, fixed, known).solution()
        )

    def finish(self, pair: Pair, end: Deadline, run: Run | None) -> Solution:
        """Optimise the motion of a pair to convergence, certify it and store the solution.

        Args:
            pair: leg, start node and goal node.
            end: deadline of the motion.
            run: search with a first motion; None to start a new one.

        Raises:
            NoTrajectory: there is no motion.
        """
        k, problem, known = pair[0], self.problem(pair, end.left), self.guesses(*pair)
        key = self.known_motions.key("finished", problem, known)
        found = self._recalled(k, key, problem)
        if found is None and run is None:
            found = self._kept(key, self.run(k, problem, known).solution())
        elif found is None and run is not None:
            run.state.end = end
            if run.state.cut_short and known:
                # its share of the search's time was too short
                run.state.cut_short = False
                run.warm_start(known[0])
            found = self._kept(key, run.search())
        assert found is not None
        self.solutions[pair] = found
        return found

    def _kept(self, key: str, found: Solution) -> Solution:
        """The solution; an optimal motion is stored for the same question."""
        if found.status == "optimal":
            self.known_motions.keep(
                key, KnownMotion(found.trajectory.spline, found.solver.stationarity)
            )
        return found

    def _recalled(self, k: int, key: str, problem: Problem) -> Solution | None:
        """Solution with a known motion; None if none is known, or it is not certified."""
        known = self.known_motions.recall(key)
        if known is None:
            return None
        try:
            return self.run(k, problem).as_it_is(known.spline, known.stationarity, is_optimal=True)
        except NoTrajectory:
            self.known_motions.forget(key)
            return None

    def end_of_leg(self, k: int, kept: float = 0.0) -> Deadline:
        """Deadline of the motion of a leg, with `kept` time [s] left after it.

        Raises:
            DeadlineExceeded: no time is left.
        """
        end = self.end.earlier_by(kept)
        if end.passed:
            raise DeadlineExceeded([])
        return self.share_of_leg(k, end) if isinstance(self.legs[k], PassingLeg) else end

    def share_of_leg(self, k: int, end: Deadline) -> Deadline:
        """Share of the time until `end` for leg `k`, which may use up all of its time.

        Every later leg with passes gets the same share, and all other legs together one more.
        """
        return end.within(
            end.left / (1 + sum(isinstance(leg, PassingLeg) for leg in self.legs[k:]))
        )

    def keep_stopping_motion(self, pair: Pair, route: Route, motion: Spline) -> None:
        """Store a motion of a pair with a rest at every pass of a route."""
        self._stopping[pair] = route, motion

    def stopping_route(self, pair: Pair) -> Route | None:
        """Route of the stored motion with a rest at every pass; None if there is none."""
        return self._stopping[pair][0] if pair in self._stopping else None

    def guesses(self, k: int, s: int, g: int) -> list[Spline]:
        """Stored motion with a rest at every pass, if it takes the present route of the pair."""
        leg = self.legs[k]
        if not isinstance(leg, PassingLeg) or (k, s, g) not in self._stopping:
            return []
        route, spline = self._stopping[k, s, g]
        return [spline] if leg.route(s, g) == route else []

    def solve_as_stopping(self, k: int, s: int, g: int, better: bool) -> Solution:
        """Solution of a pair by its stored motion with a rest at every pass.

        Args:
            k: number of the leg.
            s: node at the start.
            g: node at the goal.
            better: whether to look for a passing motion of the same duration first.

        Raises:
            JoulepathError: the errors of `optimize`.
        """
        leg = self.legs[k]
        assert isinstance(leg, PassingLeg)
        route, motion = self._stopping[k, s, g]
        leg.set_route(s, g, route)
        if better:
            with suppress(DeadlineExceeded):
                return self.solve_in(k, s, g, motion.duration)
        return self.certified(k, s, g, motion)
