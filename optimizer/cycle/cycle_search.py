"""Search for the cycle of least energy in its own time, with every move certified."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate, chain

import numpy as np

from joulepath.optimizer.cycle.chains import LeastChain
from joulepath.optimizer.cycle.known_motions import KnownMotion
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.cycle.lazy_search import LAZY_SEARCH, LazySearch, Pair
from joulepath.optimizer.cycle.legs import Leg, check_size
from joulepath.optimizer.cycle.move_problem import problem_of
from joulepath.optimizer.cycle.pair_solver import PAIR_SOLVER, PairSolver
from joulepath.optimizer.cycle.passing_leg import PassingLeg
from joulepath.optimizer.cycle.rest_energy import dwell_costs
from joulepath.optimizer.cycle.stop_layers import layers_of
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, watch
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError, NoTrajectory
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import ModelsOfArms
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.stops import PlannedMove
from joulepath.optimizer.progress import (
    CandidatesFound,
    CandidateTried,
    Improved,
    Tell,
    no_listener,
)
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.search.attempts import settled, solve
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.solve.methods.solve_result import SolveStatus


@dataclass(frozen=True)
class CycleSearchSettings:
    """Settings of the search for a cycle in its own time."""

    reserved_share: float = 0.3
    """Share of the deadline left to the motions of the answer."""
    most_routes: int = 10
    """Routes through passes tried for a pair until one has a motion."""
    many_stops: int = 40
    """Number of stops above which unsolved pairs weigh more than their bounds: the proof that no
    chain is better then takes more time than it is worth."""
    unsolved_excess: float = 0.1
    """Share of the bound by which unsolved pairs weigh more then, and in cycles with free
    orientations; motions need 17 % more than their bounds in the median."""
    usual_times: float = 4.0
    """Multiple of the mean time of a first motion that every first motion may take."""


CYCLE_SEARCH = CycleSearchSettings()


class CycleSearch(LazySearch):
    """Lazy search over the moves of a cycle, with the certified motions found.

    Args:
        cycle: the cycle.
        clock: function that returns the time [s].
        moves: moves of the search; None for those of the cycle.
        tell: receives the progress; its candidates are the kinds of all legs.

    Raises:
        DeadlineExceeded: the deadline passed before the legs were ready.
        JoulepathError: the errors of `layers_of` and `check_size`.
    """

    def __init__(
        self,
        cycle: Cycle,
        clock: Clock,
        moves: Sequence[PlannedMove] | None = None,
        tell: Tell = no_listener,
    ) -> None:
        self.cycle, self.clock = cycle, clock
        self.moves = cycle.moves if moves is None else moves
        self.end = Deadline.after(cycle.deadline, clock)
        # searches with a first motion, to be continued
        self._runs: dict[Pair, Run] = {}
        # times of first motions [s]
        self._times = list[float]()
        self._models = ModelsOfArms()
        try:
            with watch(self.end):
                layers = layers_of(cycle, self._models)
                check_size(self.moves, layers)
                legs = [self._leg(move, layers) for move in self.moves]
        except DeadlinePassed:
            raise DeadlineExceeded([]) from None
        self.solver = PairSolver(cycle, self.moves, legs, clock, self.end)
        excess = cycle.unsolved_excess
        if len(cycle.stops) > CYCLE_SEARCH.many_stops:
            excess = max(excess, CYCLE_SEARCH.unsolved_excess)
        self._overestimates = excess > 0 and cycle.objective == "electrical"
        for leg in legs:
            if self._overestimates and not isinstance(leg, PassingLeg):
                leg.raise_unsolved_costs(excess)
        # whether an untried route has a bound below the motion found of its pair
        self._skipped_routes = False
        reserved = CYCLE_SEARCH.reserved_share * cycle.deadline
        super().__init__(legs, cycle.closed, self.end.earlier_by(reserved))
        self._tell = tell
        self._first_kind = [0, *accumulate(len(leg.pair) for leg in legs)]
        tell(CandidatesFound(self._first_kind[-1]))
        known = all(leg.closed for leg in legs) and tell is not no_listener
        self._proven_bound = (
            LeastChain([leg.least_costs for leg in legs], cycle.closed).find()[0] if known else None
        )

    @property
    def solutions(self) -> dict[Pair, Solution]:
        """Certified motions of the pairs that are finished."""
        return self.solver.solutions

    def _leg(self, move: PlannedMove, layers: Mapping[str, Layer]) -> Leg:
        start, *between, goal = (layers[place] for place in (move.start, *move.through, move.goal))
        problem = problem_of(self.cycle, move, start.q[0], goal.q[0], self.cycle.deadline)
        prepared = self._models.prepared(problem)
        dwells = dwell_costs(self.cycle, move, goal)
        if between:
            return PassingLeg.through(prepared, [start, *between, goal], dwells)
        return (Leg.of if move.tool_path is None else Leg.along_path)(prepared, start, goal, dwells)

    def run(self) -> list[int]:
        """Nodes of the chain of least energy, with all motions in `solutions`.

        Once the time is up, of the chains with all motions in `solutions`.

        Raises:
            NoSequence: there is no chain.
            DeadlineExceeded: the deadline passed before a chain was finished.
        """
        while True:
            try:
                nodes = self.explore()
                if not self._finish_chain(nodes):
                    return nodes
            except DeadlineExceeded:
                self.cut_short = True
                if nodes := self.least_through(self.solutions):
                    return nodes
                raise

    def _finish_chain(self, nodes: list[int]) -> bool:
        """Finish the moves of a chain; returns whether some were not finished before.

        Raises:
            DeadlineExceeded: no time is left.
        """
        # moves without a motion come first and may take all the time that is left; in a long cycle
        # the others get equal shares
        fresh = sorted(
            (pair for pair in self.pairs(nodes) if pair not in self.solutions),
            key=self._runs.__contains__,
        )
        for done, pair in enumerate(fresh):
            shared = self._overestimates and pair in self._runs
            self.finish(*pair, share=1 / (len(fresh) - done) if shared else 1.0)
        return bool(fresh)

    def attempt(self, k: int, s: int, g: int) -> float | None:
        """Objective [J] of a first motion of a pair, with its run kept.

        Returns:
            The objective; inf if no motion is found, None if the time is up.
        """
        leg = self.legs[k]
        energy = (
            self._attempt_routes(leg, k, s, g)
            if isinstance(leg, PassingLeg)
            else self._attempt(k, s, g)
        )
        if energy is not None:
            kind, solved = int(self.legs[k].kind[s, g]), bool(np.isfinite(energy))
            self._tell(
                CandidateTried(
                    self._first_kind[k] + kind,
                    "solved" if solved else "failed",
                    float(self.legs[k].bound[kind]),
                    energy if solved else None,
                )
            )
        return energy

    def chain_tried(self, nodes: list[int]) -> None:
        """Tell the cycle of a chain if it is solved and its duration is allowed."""
        if self._tell is no_listener:
            return
        energy, motions = self.cost(nodes), [self.motion(*pair) for pair in self.pairs(nodes)]
        # a pair solved by another pair of its kind has no duration yet
        durations = [motion.duration for motion in motions if motion is not None]
        complete = len(durations) == len(motions)
        own = sum(durations) + self.cycle.dwell_time if complete else None
        if np.isfinite(energy) and (
            self.cycle.has_free_duration
            or (own is not None and self.cycle.clamped_duration(own) == own)
        ):
            self._tell(Improved(energy, own, self._proven_bound))

    def _attempt_routes(self, leg: PassingLeg, k: int, s: int, g: int) -> float | None:
        """Result of `_attempt` for the first route of a pair with a motion, the likeliest first.

        The route of a known stopping motion is tried before all others.
        """
        stopping, energy = self.solver.stopping_route((k, s, g)), None
        first = [] if stopping is None else [(-np.inf, stopping)]
        others = (other for other in leg.best_routes(s, g) if other[1] != stopping)
        for tried, (bound, route) in enumerate(chain(first, others)):
            known = np.inf if energy is None else energy
            enough = np.isfinite(known) or tried == CYCLE_SEARCH.most_routes
            if enough or (tried and self.search_end.passed):
                self._skipped_routes |= bound < known
                break
            leg.set_route(s, g, route)
            energy = self._attempt(k, s, g)
            if energy is None:
                self._skipped_routes = True
                break
        return energy

    def _time_of_attempt(self, k: int) -> float:
        """Time for a first motion of leg `k` [s]."""
        first = isinstance(self.legs[k], PassingLeg) and not self.legs[k].solved
        left = self.search_end.left
        usual = CYCLE_SEARCH.usual_times * float(np.mean(self._times or [0.0]))
        if first:
            return self.solver.share_of_leg(k, self.search_end).left
        # near the end of the search, a share of what is left is less than any motion takes
        return max(LAZY_SEARCH.share_of_leg * left, min(usual, left))

    def _attempt(self, k: int, s: int, g: int) -> float | None:
        pair, solver = (k, s, g), self.solver
        run = solver.run(k, solver.problem(pair, self._time_of_attempt(k)))
        try:
            run.prepare()
            for spline in solver.guesses(k, s, g):
                run.warm_start(spline)
        except DeadlineExceeded:
            return self.out_of_time()
        except JoulepathError:
            return np.inf
        state, (candidate,) = run.state, run.state.candidates
        if candidate.status is CandidateStatus.INFEASIBLE:
            return np.inf
        if candidate.energy is None:
            motions = solver.known_motions
            key = motions.key("tried", run.problem)
            known = motions.recall(key)
            candidate.attempt = result = solve(state, candidate) if known is None else known.result
            if result.spline is not None and not state.cut_short:
                motions.keep(key, KnownMotion(result.spline, result.stationarity))
            if result.status is SolveStatus.OUT_OF_TIME:
                return self.out_of_time()
            self.failed |= result.spline is None
            if settled(state, candidate, result, result.message) is None:
                self.causes[k] = result.message
                return np.inf
        self._runs[pair] = run
        self._times.append(self.clock() - run.began)
        state.end = self.end
        assert candidate.energy is not None
        return candidate.energy

    @property
    def leaves_better(self) -> bool:
        """Whether some chain has a bound below the best one.

        This is possible where unsolved legs weigh more than their bounds: with passes, and in
        approximate or long cycles.
        """
        if self._skipped_routes or not (self.cycle.has_passes or self._overestimates):
            return self._skipped_routes
        return self.leaves_chains

    def motion(self, k: int, s: int, g: int) -> Spline | None:
        """First motion of a pair; None if there is none."""
        run = self._runs.get((k, s, g))
        return None if run is None else run.state.candidates[0].spline

    def finish(self, k: int, s: int, g: int, share: float = 1.0) -> None:
        """Optimise the motion of a pair to convergence and certify it.

        Args:
            k: number of the leg.
            s: node at the start.
            g: node at the goal.
            share: share of the time left for this motion.

        Raises:
            DeadlineExceeded: no time is left.
        """
        pair, leg, before = (k, s, g), self.legs[k], float(self.legs[k].cost[s, g])
        kept = 0.0 if self.cycle.has_free_duration else PAIR_SOLVER.kept_share * self.cycle.deadline
        end = self.solver.end_of_leg(k, kept)
        if share < 1:
            end = end.within(share * end.left)
        try:
            found = self.solver.finish(pair, end, self._runs.pop(pair, None))
        except NoTrajectory:
            self.failed = True
            leg.set_pair(s, g, np.inf)
            return
        leg.set_pair(s, g, found.energy.of(self.cycle.objective))
        rise = max(before - float(leg.cost[s, g]), 0.0)
        self.least_chain.lower(rise + LAZY_SEARCH.same_cost)
