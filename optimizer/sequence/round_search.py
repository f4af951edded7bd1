"""The search for the round of least energy: bounds of all legs first, then a motion where the least chain goes.

All legs weigh their proven bounds. The least chain through them is found, its legs are solved and weigh what was found,
and so on until every leg of the least chain is solved: then no chain has a bound below it. After Dellin and Srinivasa,
"A unifying formalism for shortest path problems with expensive edge evaluations" (2016). The moves of this chain are
optimised to the end and certified, as `optimize` does it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from models.robot import Array
from optimizer.deadline import Clock, Deadline, DeadlinePassed, watch
from optimizer.energy.dwell import dwell_energy, holding_power
from optimizer.exceptions import DeadlineExceeded, JoulepathError, NoSequence, NoTrajectory
from optimizer.methods.method import SolveStatus
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.arm import Arm
from optimizer.problem.cycle import Cycle
from optimizer.problem.problem import Problem
from optimizer.problem.work_round import WorkRound
from optimizer.search.attempts import settled, solve
from optimizer.search.run import Run
from optimizer.sequence.chains import LeastChain
from optimizer.sequence.layers import Layer, layers_of
from optimizer.sequence.legs import Leg
from optimizer.solution import CandidateStatus, Solution

# share of the deadline that the search leaves to the motions of its answer, and least time for one of these [s]
RESERVED, LEAST_TIME = 0.3, 1e-3
# share of the search's time left that one leg may take: among obstacles, one without a way would take all of it
SHARE_OF_A_LEG = 1 / 8
# J: a chain is no better than another one by less
SAME = 1e-9
# rad: a motion whose control points are farther from the limits is not held back by them
NEAR_LIMIT = 1e-3


class RoundSearch:
    """One search, with the legs and the certified motions that it has found."""

    def __init__(self, asked: WorkRound, clock: Clock) -> None:
        self.asked, self.clock = asked, clock
        self.end = Deadline.after(asked.deadline, clock)
        self.search_end = self.end.earlier_by(RESERVED * asked.deadline)
        self.solutions: dict[tuple[int, int, int], Solution] = {}
        # searches that have a first motion, to go on with
        self._runs: dict[tuple[int, int, int], Run] = {}
        # a leg without a motion that is not proven to have none, or one for which the time was too short
        self.failed = self.cut_short = False
        try:
            with watch(self.end):
                layers = layers_of(asked)
                stops = [*layers, *(layers[:1] if asked.closed else [])]
                self.legs = [self._leg(k, stops[k], stops[k + 1]) for k in range(len(stops) - 1)]
        except DeadlinePassed:
            raise DeadlineExceeded([]) from None
        self._chain = LeastChain([leg.cost for leg in self.legs], asked.closed)

    def _leg(self, k: int, start: Layer, goal: Layer) -> Leg:
        asked = self.asked
        problem = self._problem(asked.arms[k], start.q[0], goal.q[0], asked.deadline)
        cycle = asked.dwell(k) if k < len(asked.stops) else None
        dwell = np.zeros(len(goal.q)) if cycle is None else _dwell(asked.arms[k + 1], cycle, goal)
        return Leg.of(PreparedProblem.of(problem), start, goal, dwell)

    def run(self) -> list[int]:
        """The nodes of the chain of least energy, whose motions are all in `solutions`.

        Raises NoSequence, or DeadlineExceeded if the deadline passes before any chain is solved.
        """
        while True:
            nodes = self._explore()
            fresh = [each for each in self.pairs(nodes) if each not in self.solutions]
            if not fresh:
                return nodes
            for each in fresh:
                self.finish(*each)

    def pairs(self, nodes: list[int]) -> Iterator[tuple[int, int, int]]:
        """Leg, start node and goal node of each move of a chain."""
        return ((k, nodes[k], nodes[k + 1]) for k in range(len(self.legs)))

    def cost(self, nodes: list[int]) -> float:
        """Energy [J] of a chain as far as it is known, dwells included."""
        return float(sum(self.legs[k].cost[s, g] for k, s, g in self.pairs(nodes)))

    def _explore(self) -> list[int]:
        """The nodes of the least chain, all of its legs solved; once the time is up, of the least solved one."""
        while True:
            _, nodes = self._chain.find()
            if not nodes:
                raise self._no_sequence()
            open_ = [(k, s, g) for k, s, g in self.pairs(nodes) if not self.legs[k].known(s, g)]
            if not open_:
                return nodes
            for each in open_:
                if self.search_end.passed:
                    self.cut_short = True
                    return self._least_solved() or nodes
                self.try_kind(*each)

    def try_kind(self, k: int, s: int, g: int) -> None:
        """Solve a pair for its kind; where a joint's range is in its way, the pair farthest from the limits, too."""
        leg = self.legs[k]
        kind = int(leg.kind[s, g])
        energy = self._try(k, s, g)
        centre_s, centre_g = leg.pair[kind].tolist()
        if energy is not None and (s, g) != (centre_s, centre_g) and self._is_at_a_limit(k, s, g):
            if np.isfinite(energy):
                leg.set_pair(s, g, energy)
            energy = self._try(k, centre_s, centre_g)
        if energy is not None:
            leg.set_kind(kind, energy)

    def _try(self, k: int, s: int, g: int) -> float | None:
        """Energy [J] of a first motion of a pair, whose run is kept; inf if none is found in its share of the time.

        None once the time is up.
        """
        leg = self.legs[k]
        time = SHARE_OF_A_LEG * self.search_end.left
        run = Run(self._problem(self.asked.arms[k], leg.start.q[s], leg.goal.q[g], time), clock=self.clock)
        try:
            run.prepare()
        except DeadlineExceeded:
            return self._late()
        except JoulepathError:
            return np.inf
        incumbent, (candidate,) = run.incumbent, run.incumbent.candidates
        if candidate.status is CandidateStatus.INFEASIBLE:
            return np.inf
        candidate.attempt = result = solve(incumbent, candidate)
        if result.status is SolveStatus.OUT_OF_TIME:
            return self._late()
        self.failed |= result.spline is None
        if settled(incumbent, candidate, result, result.reason) is None:
            return np.inf
        self._runs[k, s, g] = run
        incumbent.end = self.end
        assert candidate.energy is not None
        return candidate.energy

    def _late(self) -> float | None:
        """What a leg for which the time was too short is worth: without its share of it, no other is tried."""
        self.cut_short = True
        return None if self.search_end.passed else np.inf

    def _is_at_a_limit(self, k: int, s: int, g: int) -> bool:
        """Whether the motion of a pair comes to the end of a joint's range, or there is none: then another pair of its
        kind may need less."""
        run = self._runs.get((k, s, g))
        if run is None:
            return True
        limits = self.asked.arms[k].active_limits
        points = run.incumbent.candidates[0].spline.control_points
        return bool((points < limits.q_min + NEAR_LIMIT).any() or (points > limits.q_max - NEAR_LIMIT).any())

    def finish(self, k: int, s: int, g: int) -> None:
        """Optimise the motion of a pair to the end, and certify it. Raises DeadlineExceeded if no time is left."""
        leg, before = self.legs[k], float(self.legs[k].cost[s, g])
        if self.end.passed:
            raise DeadlineExceeded([])
        run = self._runs.pop((k, s, g), None)
        try:
            if run is None:
                problem = self._problem(self.asked.arms[k], leg.start.q[s], leg.goal.q[g], self.end.left)
                found = Run(problem, clock=self.clock).solution()
            else:
                found = run.search()
        except NoTrajectory:
            self.failed = True
            leg.set_pair(s, g, np.inf)
            return
        self.solutions[k, s, g] = found
        leg.set_pair(s, g, found.energy.electrical.total)
        self._chain.lower(max(before - float(leg.cost[s, g]), 0.0) + SAME)

    def _least_solved(self) -> list[int]:
        """The least chain of pairs that are all solved; no nodes if there is none."""
        costs = []
        for leg in self.legs:
            known = np.isin(leg.kind, list(leg.solved))
            for pair in leg.exact:
                known[pair] = True
            costs.append(np.where(known, leg.cost, np.inf))
        return LeastChain(costs, self.asked.closed).find()[1]

    def _problem(self, arm: Arm, q_start: Array, q_goal: Array, time: float) -> Problem:
        asked = self.asked
        return Problem(
            arm=arm,
            start=q_start,
            goal=q_goal,
            method=asked.method,
            windings=False,
            sample_period=asked.sample_period,
            deadline=max(time, LEAST_TIME),
        )

    def _no_sequence(self) -> NoSequence:
        """The error for no chain; it names the first stop that none comes to."""
        reached = np.zeros(len(self.legs[0].start.q))
        for leg in self.legs:
            after = (reached[:, None] + leg.cost).min(axis=0)
            if not np.isfinite(after).any():
                break
            reached = after
        labels = [
            [layer.ends[k].label for k in sorted(set(layer.end[nodes].tolist()))]
            for layer, nodes in ((leg.start, np.isfinite(reached)), (leg.goal, np.ones(len(leg.goal.q), dtype=bool)))
        ]
        return NoSequence(leg.goal.name, *labels)


def _dwell(arm: Arm, cycle: Cycle, layer: Layer) -> Array:
    """Energy (n,) [J] of dwelling in each configuration of a layer."""
    still = np.zeros((len(layer.ends), arm.robot.nq))
    prepared = PreparedProblem.of(Problem(arm=arm, start=layer.q[0], goal=layer.q[0]))
    tau = prepared.torques(np.array([end.q for end in layer.ends]), still, still)
    return np.array([dwell_energy(cycle, arm, float(power), 0.0) for power in holding_power(arm, tau)])[layer.end]
