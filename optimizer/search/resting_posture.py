"""Motions with a rest in a posture of little holding power, as initial guesses.

If a motion may last much longer than its joints need, it can go to a posture that the motors hold
with little power, rest there, and go on to the goal. The first solve starts from the straight line
and ends in a local minimum near it. With equal start and goal, the gradient is even zero for a
motion that stays at the start.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.motion import bspline, quintic
from joulepath.optimizer.motion.bspline import Basis
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.search.attempts import improve
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.finishing_time import time_to_finish
from joulepath.optimizer.search.seeds import of_quintics
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.solve_result import SolveResult


@dataclass(frozen=True)
class RestSettings:
    """Settings of the search for a posture to rest in."""

    least_ratio: float = 3.0
    """Least ratio of the time to the shortest duration of the joints; with less, the way to another
    posture takes most of the time."""
    least_saving: float = 0.02
    """Least share of the energy that a rest must promise to save before ways are estimated."""
    sampled: int = 384
    """Number of random postures."""
    spreads: tuple[float, float] = (0.2, 1.6)
    """Least and greatest standard deviation of a posture from the straight line [rad]."""
    estimated: int = 16
    """Number of postures whose energy is estimated at a time."""
    rounds: int = 6
    """Rounds of random steps from the best posture, each half as far as the one before."""
    step: float = 0.5
    """Standard deviation of the first steps [rad]."""
    slowness: float = 1.4
    """Duration of a way, in multiples of the shortest duration of a quintic."""
    way_points: int = 9
    """Control points of a way in the guess."""
    seed: int = 0
    """Seed of the random postures."""


REST = RestSettings()


def rest_on_the_way(state: SearchState, candidate: Candidate) -> None:
    """Improve a candidate with much time from a motion with a rest at little power.

    Args:
        state: state of the search.
        candidate: the solved candidate.
    """
    problem = state.problem
    if (
        problem.objective != "electrical"
        or problem.tool_path is not None
        or problem.passes
        or not state.method.free_control_points
        or state.deadline.passed
    ):
        return
    time = candidate.spline.duration if problem.dwell is None else problem.duration_max
    assert time is not None and candidate.energy is not None
    if time > candidate.spline.duration:
        # a longer motion takes longer to certify, and replaces one that is ready in time
        needed = time_to_finish(problem, time, len(state.candidates))
        if state.end.left < needed:
            state.cut_short = True
            return
    rests = _Rests(state.prepared, candidate.q_start, candidate.q_goal, time)
    posture = rests.below(candidate.energy)
    if posture is not None:
        improve(state, candidate, partial(_solve_with_rest, rests, posture))


def _solve_with_rest(rests: _Rests, posture: Array, solver: Method) -> SolveResult:
    space, points = rests.motion(posture)
    return solver.solve_control_points(space, points, rests.time)


@dataclass(frozen=True)
class _Rests:
    """Motions from q_start to q_goal (nq,) [rad] in a time [s] with a rest in another posture."""

    prepared: PreparedProblem
    q_start: Array
    q_goal: Array
    time: float

    def below(self, energy: float) -> Array | None:
        """The posture (nq,) [rad] whose motion needs least; None if none needs less than an energy
        [J].
        """
        limits, base = self.prepared.arm.active_limits, self.prepared.arm.base_power
        most = (1 - REST.least_saving) * energy
        direct = self._ways(self.q_goal[None]).max()
        if self.time < REST.least_ratio * direct or base * self.time > most:
            return None
        rng = np.random.default_rng(REST.seed)
        shape = REST.sampled, limits.q_min.size
        between = self.q_start + rng.random((shape[0], 1)) * (self.q_goal - self.q_start)
        low, high = np.log(REST.spreads)
        spread = np.exp(rng.uniform(low, high, (shape[0], 1)))
        q = np.clip(between + spread * rng.normal(size=shape), limits.q_min, limits.q_max)
        q = q[self._ways(q).sum(axis=0) < self.time]
        moving = self._ways(q).sum(axis=0)
        least = base * moving + self.prepared.holding_power(q) * (self.time - moving)
        if least.min(initial=np.inf) > most:
            return None
        q = q[np.argsort(least)[: REST.estimated]]
        best, posture = np.inf, q[0]
        for k in range(REST.rounds + 1):
            estimated = self._energies(q)
            if estimated.min() < best:
                best, posture = float(estimated.min()), q[estimated.argmin()]
            step = REST.step / 2**k * rng.normal(size=(REST.estimated, shape[1]))
            step *= rng.random(step.shape) < 0.5
            q = np.clip(posture + step, limits.q_min, limits.q_max)
        return posture if best < energy else None

    def _ways(self, q: Array) -> Array:
        """Durations (2, k) [s] of the ways from the start to postures q (k, nq) [rad] and on."""
        limits = self.prepared.arm.active_limits
        displacement = np.abs(np.stack([q - self.q_start, self.q_goal - q]))[:, :, None]
        ratio = quintic.PEAKS[:, None] * displacement / limits.rates
        shortest = (ratio ** (1 / np.arange(1, 4)[:, None])).max(axis=(2, 3))
        return np.asarray(np.maximum(REST.slowness * shortest, DURATIONS.least))

    def _energies(self, q: Array) -> Array:
        """Energies (k,) [J] of motions with a rest at q (k, nq) [rad]; infinite if they exceed a
        torque limit or the time.
        """
        ways = self._ways(q)
        energy = self.prepared.holding_power(q) * (self.time - ways.sum(axis=0))
        energy[ways.sum(axis=0) > self.time] = np.inf
        start, goal = np.broadcast_to(self.q_start, q.shape), np.broadcast_to(self.q_goal, q.shape)
        for begin, end, T in ((start, q, ways[0]), (q, goal, ways[1])):
            moving, torque_ratio = of_quintics(self.prepared, begin, end, T)
            energy += np.where(torque_ratio > 1, np.inf, moving)
        return np.asarray(energy)

    def motion(self, q: Array) -> tuple[Basis, Array]:
        """Spline space and control points (n, nq) [rad] of the motion with a rest at q."""
        first, last = self._ways(q[None])[:, 0] / self.time
        knots = np.concatenate(
            [np.linspace(0, first, REST.way_points), np.linspace(1 - last, 1, REST.way_points)]
        )
        space = bspline.graded(knots[1:-1], 1)
        x = bspline.greville(space.knots)
        points = self.q_start + np.outer(
            quintic.fraction(np.clip(x / first, 0, 1)), q - self.q_start
        )
        points += np.outer(quintic.fraction(np.clip((x - 1) / last + 1, 0, 1)), self.q_goal - q)
        points[: bspline.REST_POINTS], points[-bspline.REST_POINTS :] = self.q_start, self.q_goal
        return space, points
