"""The search for the round of least energy in its own time: the moves of its least chain are optimised to the end and
certified, as `optimize` does it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from models.robot import Array
from optimizer.deadline import Clock, Deadline, DeadlinePassed, watch
from optimizer.energy.dwell import dwell_energy, holding_power
from optimizer.energy.plant import Plant
from optimizer.exceptions import DeadlineExceeded, JoulepathError, NoTrajectory
from optimizer.methods.method import SolveStatus
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.arm import Arm
from optimizer.problem.cycle import Cycle
from optimizer.problem.problem import Problem
from optimizer.problem.work_round import WorkRound
from optimizer.search.attempts import settled, solve
from optimizer.search.run import Run
from optimizer.sequence.layers import Layer, layers_of
from optimizer.sequence.lazy_search import SHARE_OF_A_LEG, LazySearch
from optimizer.sequence.legs import Leg
from optimizer.solution import CandidateStatus, Solution

# share of the deadline that the search leaves to the motions of its answer, and least time for one of these [s]
RESERVED, LEAST_TIME = 0.3, 1e-3
# J: a chain is no better than another one by less
SAME = 1e-9
# rad: a motion whose control points are farther from the limits is not held back by them
NEAR_LIMIT = 1e-3


class RoundSearch(LazySearch):
    """One search, with the certified motions that it has found."""

    def __init__(self, asked: WorkRound, clock: Clock) -> None:
        self.asked, self.clock = asked, clock
        self.end = Deadline.after(asked.deadline, clock)
        self.solutions: dict[tuple[int, int, int], Solution] = {}
        # searches that have a first motion, to go on with
        self._runs: dict[tuple[int, int, int], Run] = {}
        try:
            with watch(self.end):
                layers = layers_of(asked)
                stops = [*layers, *(layers[:1] if asked.closed else [])]
                legs = [self._leg(k, stops[k], stops[k + 1]) for k in range(len(stops) - 1)]
        except DeadlinePassed:
            raise DeadlineExceeded([]) from None
        super().__init__(legs, asked.closed, self.end.earlier_by(RESERVED * asked.deadline))

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
            nodes = self.explore()
            fresh = [each for each in self.pairs(nodes) if each not in self.solutions]
            if not fresh:
                return nodes
            for each in fresh:
                self.finish(*each)

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

    def solve_in(self, k: int, s: int, g: int, duration: float) -> Solution:
        """The certified motion of a pair in a given duration [s]. Raises the errors of `optimize`."""
        leg = self.legs[k]
        if self.end.passed:
            raise DeadlineExceeded([])
        problem = self._problem(self.asked.arms[k], leg.start.q[s], leg.goal.q[g], self.end.left)
        fixed = replace(problem, duration_min=duration, duration_max=duration)
        return Run(fixed, clock=self.clock).solution()

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


def holding_powers(arm: Arm, layer: Layer) -> Array:
    """Power (n,) [W] that holding the arm on its motors draws in each configuration of a layer."""
    still = np.zeros((len(layer.ends), arm.robot.nq))
    tau = Plant(arm).torques(np.array([end.q for end in layer.ends]), still, still)
    return np.asarray(holding_power(arm, tau)[layer.end])


def _dwell(arm: Arm, cycle: Cycle, layer: Layer) -> Array:
    """Energy (n,) [J] of dwelling in each configuration of a layer."""
    return np.array([dwell_energy(cycle, arm, float(power), 0.0) for power in holding_powers(arm, layer)])
