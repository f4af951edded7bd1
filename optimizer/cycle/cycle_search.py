"""The search for the cycle of least energy in its own time, which certifies its moves as `optimize`
does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import accumulate, chain

import numpy as np

from joulepath.optimizer.certificate import certify
from joulepath.optimizer.cycle.chains import LeastChain
from joulepath.optimizer.cycle.known_motions import KnownMotion, known_motions
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.cycle.lazy_search import SAME, SHARE_OF_A_LEG, LazySearch
from joulepath.optimizer.cycle.legs import Leg, check_size
from joulepath.optimizer.cycle.move_problem import problem_of
from joulepath.optimizer.cycle.passing_leg import LIKELY, PassingLeg, Route
from joulepath.optimizer.cycle.rests import dwell_costs
from joulepath.optimizer.cycle.ways import layers_of
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, watch
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError, NoTrajectory
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.stops import PlannedMove
from joulepath.optimizer.progress import CandidatesFound, CandidateTried, Improved, Tell, nobody
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.search.attempts import settled, solve
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.solve.methods.solve_result import SolveStatus

# shares of the deadline that the search leaves to the motions of its answer, and these to certify a
# simpler cycle that needs less
RESERVED, KEPT = 0.3, 0.08
# routes through passes that are tried for a pair at most, and while none has a motion
MOST_ROUTES, MOST_FAILED = 3, 10
# stops beyond which the proof that no chain is better is worth less than its time: a pair that is
# not solved weighs so much more than its bound then, of the 17 % more that motions need in the
# median
MANY_STOPS, LIKELY_MORE = 40, 0.1
# mean times of a first motion that one may take in any case
MANY_TIMES = 4


class CycleSearch(LazySearch):
    """One search over `moves`, with the certified motions that it has found.

    `tell` gets what is found: the candidates are the kinds of all legs.
    """

    def __init__(
        self,
        asked: Cycle,
        clock: Clock,
        moves: Sequence[PlannedMove] | None = None,
        tell: Tell = nobody,
    ) -> None:
        self.asked, self.clock = asked, clock
        self.moves = asked.moves if moves is None else moves
        self.end = Deadline.after(asked.deadline, clock)
        self.solutions: dict[tuple[int, int, int], Solution] = {}
        # searches that have a first motion, to go on with
        self._runs: dict[tuple[int, int, int], Run] = {}
        # times [s] that first motions took
        self._spent = list[float]()
        # one problem of each arm, whose models its other problems share
        self._prepared: dict[int, PreparedProblem] = {}
        self._known_motions = known_motions()
        try:
            with watch(self.end):
                layers = layers_of(asked)
                check_size(self.moves, layers)
                legs = [self._leg(move, layers) for move in self.moves]
        except DeadlinePassed:
            raise DeadlineExceeded([]) from None
        self._is_rough = (
            asked.rough or len(asked.stops) > MANY_STOPS
        ) and asked.objective == "electrical"
        for leg in legs:
            if self._is_rough and not isinstance(leg, PassingLeg):
                leg.weigh_more(LIKELY_MORE)
        # motions that rest at the passes of a pair, along one of its routes
        self.stopping: dict[tuple[int, int, int], tuple[Route, Spline]] = {}
        # whether a route has a bound below the motion found of its pair
        self.routes_left = False
        super().__init__(legs, asked.closed, self.end.earlier_by(RESERVED * asked.deadline))
        self._tell = tell
        self._first = [0, *accumulate(len(leg.pair) for leg in legs)]
        tell(CandidatesFound(self._first[-1]))
        known = all(leg.closed for leg in legs) and tell is not nobody
        self._proven = (
            LeastChain([leg.least_costs for leg in legs], asked.closed).find()[0] if known else None
        )

    def _leg(self, move: PlannedMove, layers: Mapping[str, Layer]) -> Leg:
        start, *between, goal = (layers[place] for place in (move.start, *move.through, move.goal))
        problem = problem_of(self.asked, move, start.q[0], goal.q[0], self.asked.deadline)
        known = self._prepared.get(id(move.arm))
        prepared = PreparedProblem.of(problem) if known is None else known.sharing(problem)
        self._prepared[id(move.arm)] = prepared
        dwells = dwell_costs(self.asked, move, goal)
        if between:
            return PassingLeg.through(prepared, [start, *between, goal], dwells)
        return (Leg.of if move.tool_path is None else Leg.of_way)(prepared, start, goal, dwells)

    def run(self) -> list[int]:
        """The nodes of the chain of least energy, whose motions are all in `solutions`.

        Once the time is up, of the chains whose motions are. Raises NoSequence, or DeadlineExceeded
        if there are none.
        """
        while True:
            try:
                nodes = self.explore()
                if not self._finish(nodes):
                    return nodes
            except DeadlineExceeded:
                self.cut_short = True
                if nodes := self.least_through(self.solutions):
                    return nodes
                raise

    def _finish(self, nodes: list[int]) -> bool:
        """Finish the moves of a chain; whether some were not in `solutions`. Raises
        DeadlineExceeded.
        """
        # what has no motion yet may take all the time that is left, the others a share of it in a
        # long cycle
        fresh = sorted(
            (each for each in self.pairs(nodes) if each not in self.solutions),
            key=self._runs.__contains__,
        )
        for done, each in enumerate(fresh):
            shared = self._is_rough and each in self._runs
            self.finish(*each, share=1 / (len(fresh) - done) if shared else 1.0)
        return bool(fresh)

    def attempt(self, k: int, s: int, g: int) -> float | None:
        """Objective [J] of a first motion of a pair, whose run is kept; inf if none is found, None
        if too late.
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
                    self._first[k] + kind,
                    "solved" if solved else "failed",
                    float(self.legs[k].bound[kind]),
                    energy if solved else None,
                )
            )
        return energy

    def chain_tried(self, nodes: list[int]) -> None:
        """Tells the cycle of this chain, if all of it is solved and it takes a time that is asked
        for.
        """
        if self._tell is nobody:
            return
        energy, motions = self.cost(nodes), [self.motion(*each) for each in self.pairs(nodes)]
        # of a leg that another pair of its kind was solved for, the duration is not known yet
        durations = [motion.duration for motion in motions if motion is not None]
        complete = len(durations) == len(motions)
        own = sum(durations) + self.asked.dwelling if complete else None
        if np.isfinite(energy) and (
            self.asked.any_time or (own is not None and self.asked.nearest_duration(own) == own)
        ):
            self._tell(Improved(energy, own, self._proven))

    def _attempt_routes(self, leg: PassingLeg, k: int, s: int, g: int) -> float | None:
        """The least of `_attempt` over the likeliest routes of a pair, first the one along which a
        motion is known.
        """
        key, best, kept = (k, s, g), None, None
        first = [(-np.inf, self.stopping[key][0])] if key in self.stopping else []
        others = (each for each in leg.best_routes(s, g) if not first or each[1] != first[0][1])
        for tried, (bound, route) in enumerate(chain(first, others)):
            known = np.inf if best is None else best
            if np.isfinite(known) and bound >= known:
                break
            if (
                tried >= (MOST_ROUTES if np.isfinite(known) else MOST_FAILED)
                or LIKELY * bound >= known
            ):
                self.routes_left = True
                break
            leg.routes[s, g] = route
            energy = self._attempt(*key)
            if energy is None:
                self.routes_left = True
                break
            if best is None or energy < best:
                best, kept = energy, (route, self._runs.pop(key, None))
            if self.search_end.passed:
                self.routes_left = True
                break
        if kept is not None:
            leg.routes[s, g] = kept[0]
            if kept[1] is not None:
                self._runs[key] = kept[1]
        return best

    def _attempt(self, k: int, s: int, g: int) -> float | None:
        first = isinstance(self.legs[k], PassingLeg) and not self.legs[k].solved
        # near the end of the search, a share of what is left is less than any motion takes
        left, usual = self.search_end.left, MANY_TIMES * float(np.mean(self._spent or [0.0]))
        time = (
            self._shared(k, self.search_end).left
            if first
            else max(SHARE_OF_A_LEG * left, min(usual, left))
        )
        run = self._run(k, self._problem_of(k, s, g, time))
        try:
            run.prepare()
            for spline in self._known(k, s, g):
                run.warm_start(spline)
        except DeadlineExceeded:
            return self.late()
        except JoulepathError:
            return np.inf
        state, (candidate,) = run.state, run.state.candidates
        if candidate.status is CandidateStatus.INFEASIBLE:
            return np.inf
        if candidate.energy is None:
            motions, key = self._known_motions, self._known_motions.key("tried", run.problem)
            known = motions.recall(key)
            candidate.attempt = result = solve(state, candidate) if known is None else known.result
            if result.spline is not None and not state.cut_short:
                motions.keep(key, KnownMotion(result.spline, result.stationarity))
            if result.status is SolveStatus.OUT_OF_TIME:
                return self.late()
            self.failed |= result.spline is None
            if settled(state, candidate, result, result.message) is None:
                self.causes[k] = result.message
                return np.inf
        self._runs[k, s, g] = run
        self._spent.append(self.clock() - run.began)
        state.end = self.end
        assert candidate.energy is not None
        return candidate.energy

    @property
    def leaves_better(self) -> bool:
        """Whether some chain has a bound below the best one, where legs weigh more than their
        bounds: through passes, and in a rough cycle or one of many stops."""
        if self.routes_left or not (self.asked.passes or self._is_rough):
            return self.routes_left
        return self.leaves_chains

    def motion(self, k: int, s: int, g: int) -> Spline | None:
        """The first motion of a pair; None if there is none."""
        run = self._runs.get((k, s, g))
        return None if run is None else run.state.candidates[0].spline

    def confirms(self, k: int, s: int, g: int, spline: Spline) -> bool:
        """Whether the certificate confirms a motion of a pair."""
        leg = self.legs[k]
        problem = self._problem_of(k, s, g, self.asked.deadline)
        return certify(
            problem, spline, leg.start.q[s], leg.goal.q[g], leg.prepared.energy(spline)
        ).valid

    def solve_in(
        self, k: int, s: int, g: int, duration: float, begin: Sequence[Spline] = ()
    ) -> Solution:
        """The certified motion of a pair in a given duration [s], from known motions if there are
        any to `begin` with.

        Raises the errors of `optimize`.
        """
        problem = self._problem_of(k, s, g, self._end_of(k, KEPT * self.asked.deadline).left)
        fixed = replace(problem, duration_min=duration, duration_max=duration)
        own, known = self.solutions.get((k, s, g)), [*self._known(k, s, g), *begin]
        if own is not None and self.moves[k].tool_path is not None:
            # a path that is followed as fast as it can be is not followed so fast again without a
            # guess
            known.append(own.trajectory.spline)
        key = self._known_motions.key("finished", fixed, known)
        return self._recalled(k, key, fixed) or self._kept(
            key, self._run(k, fixed, known).solution()
        )

    def finish(self, k: int, s: int, g: int, share: float = 1.0) -> None:
        """Optimise the motion of a pair to the end, in this share of the time that is left, and
        certify it.

        Raises DeadlineExceeded if no time is left.
        """
        leg, before = self.legs[k], float(self.legs[k].cost[s, g])
        end = self._end_of(k, 0.0 if self.asked.any_time else KEPT * self.asked.deadline)
        if share < 1:
            end = end.within(share * end.left)
        problem, known = self._problem_of(k, s, g, end.left), self._known(k, s, g)
        run = self._runs.pop((k, s, g), None)
        key = self._known_motions.key("finished", problem, known)
        try:
            if (recalled := self._recalled(k, key, problem)) is not None:
                found = recalled
            elif run is None:
                found = self._kept(key, self._run(k, problem, known).solution())
            else:
                run.state.end = end
                if run.state.cut_short and known:
                    # its share of the search's time was too short
                    run.state.cut_short = False
                    run.warm_start(known[0])
                found = self._kept(key, run.search())
        except NoTrajectory:
            self.failed = True
            leg.set_pair(s, g, np.inf)
            return
        self.solutions[k, s, g] = found
        leg.set_pair(s, g, found.energy.of(self.asked.objective))
        self._chain.lower(max(before - float(leg.cost[s, g]), 0.0) + SAME)

    def _kept(self, key: str, found: Solution) -> Solution:
        """A solution, whose motion is kept if no more time would make it better."""
        if found.status == "optimal":
            self._known_motions.keep(
                key, KnownMotion(found.trajectory.spline, found.solver.stationarity)
            )
        return found

    def _recalled(self, k: int, key: str, problem: Problem) -> Solution | None:
        """The solution that a known motion is; None if none is known, or it is not certified."""
        known = self._known_motions.recall(key)
        if known is None:
            return None
        try:
            return self._run(k, problem).as_it_is(known.spline, known.stationarity, is_optimal=True)
        except NoTrajectory:
            self._known_motions.forget(key)
            return None

    def _end_of(self, k: int, kept: float = 0.0) -> Deadline:
        """The deadline of the motion of a leg, with time [s] kept. Raises DeadlineExceeded if none
        is left.
        """
        end = self.end.earlier_by(kept)
        if end.passed:
            raise DeadlineExceeded([])
        return self._shared(k, end) if isinstance(self.legs[k], PassingLeg) else end

    def _shared(self, k: int, end: Deadline) -> Deadline:
        """The end of what a leg through passes may take of the time until `end`: it may take all
        that it gets.

        It leaves as much for each that comes after it, and for the other legs.
        """
        return end.within(
            end.left / (1 + sum(isinstance(leg, PassingLeg) for leg in self.legs[k:]))
        )

    def _known(self, k: int, s: int, g: int) -> list[Spline]:
        """The motion that rests at the passes of a pair, if one is known along its route."""
        leg = self.legs[k]
        if not isinstance(leg, PassingLeg) or (k, s, g) not in self.stopping:
            return []
        route, spline = self.stopping[k, s, g]
        return [spline] if leg.route(s, g) == route else []

    def as_stopping(self, k: int, s: int, g: int, better: bool) -> Solution:
        """The motion of a pair that rests at its passes; a `better` one of the same duration if
        there is one.

        Raises the errors of `optimize`.
        """
        leg = self.legs[k]
        assert isinstance(leg, PassingLeg)
        leg.routes[s, g], motion = self.stopping[k, s, g]
        if better:
            with suppress(DeadlineExceeded):
                return self.solve_in(k, s, g, motion.duration)
        return self.as_it_is(k, s, g, motion)

    def as_it_is(self, k: int, s: int, g: int, motion: Spline) -> Solution:
        """The solution that a motion of a pair is. Raises NoTrajectory if it is not certified, or
        DeadlineExceeded.
        """
        return self._run(k, self._problem_of(k, s, g, self.end.left)).as_it_is(motion)

    def _run(self, k: int, problem: Problem, known: Sequence[Spline] = ()) -> Run:
        """The search of a motion of leg `k`."""
        run = Run(problem, known, self.clock, like=self.legs[k].prepared)
        run.state.prepared.traces.update(self.legs[k].traces_of(problem))
        return run

    def _problem_of(self, k: int, s: int, g: int, time: float) -> Problem:
        """The problem of a pair, with `time` [s] for it."""
        leg = self.legs[k]
        problem = problem_of(self.asked, self.moves[k], leg.start.q[s], leg.goal.q[g], time)
        return replace(problem, passes=leg.passes(s, g))
