"""Rests of little power on the way, as starts for motions with much time.

If a motion may last far longer than its joints need, it may go to a posture that the motors hold at
little power, rest there, and go on to the goal. The first solve starts from the straight line, and
follows the slope of the holding power: it ends in the nearest valley. Between equal ends the
shortest motion of a dwell even has no slope that leads away from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.motion import bspline, quintic
from joulepath.optimizer.motion.bspline import Basis
from joulepath.optimizer.motion.quadrature import quadrature
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.search.attempts import improve
from joulepath.optimizer.search.candidates import Candidate
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
    panels: int = 4
    """Panels of the quadrature over a way."""
    points: int = 3
    """Points of the quadrature in a panel."""
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

    def below(self, energy: float, settings: RestSettings = REST) -> Array | None:
        """The posture (nq,) [rad] whose motion needs least; None if none needs less than an energy
        [J].
        """
        limits, base = self.prepared.arm.active_limits, self.prepared.arm.base_power
        most = (1 - settings.least_saving) * energy
        direct = self._ways(self.q_goal[None]).max()
        if self.time < settings.least_ratio * direct or base * self.time > most:
            return None
        rng = np.random.default_rng(settings.seed)
        shape = settings.sampled, limits.q_min.size
        between = self.q_start + rng.random((shape[0], 1)) * (self.q_goal - self.q_start)
        low, high = np.log(settings.spreads)
        spread = np.exp(rng.uniform(low, high, (shape[0], 1)))
        q = np.clip(between + spread * rng.normal(size=shape), limits.q_min, limits.q_max)
        q = q[self._ways(q).sum(axis=0) < self.time]
        moving = self._ways(q).sum(axis=0)
        least = base * moving + self.prepared.holding_power(q) * (self.time - moving)
        if least.min(initial=np.inf) > most:
            return None
        q = q[np.argsort(least)[: settings.estimated]]
        best, posture = np.inf, q[0]
        for k in range(settings.rounds + 1):
            estimated = self._energies(q)
            if estimated.min() < best:
                best, posture = float(estimated.min()), q[estimated.argmin()]
            step = settings.step / 2**k * rng.normal(size=(settings.estimated, shape[1]))
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
        for begin, end, T in ((self.q_start, q, ways[0]), (q, self.q_goal, ways[1])):
            energy += self._way(begin, end, T)
        return np.asarray(energy)

    def _way(self, begin: Array, end: Array, T: Array) -> Array:
        """Energies (k,) [J] of quintics from begin to end in T (k,) [s]."""
        panels = np.linspace(0.0, 1.0, REST.panels + 1)
        x, weights = quadrature(panels, REST.points)
        at, rate, acceleration = quintic.derivatives(x)[:, :, None]
        begin, end = np.broadcast_arrays(begin, end)
        displacement, T = (end - begin)[:, None], T[:, None, None]
        q = begin[:, None] + displacement * at
        y = np.concatenate([q, displacement * rate / T, displacement * acceleration / T**2], axis=2)
        cost, tau = self.prepared.kernel.values(
            y.reshape(-1, y.shape[2]), self.prepared.objective_parameters
        )
        energy = T[:, 0, 0] * (cost.reshape(len(end), -1) @ weights)
        ratio = np.abs(tau / self.prepared.arm.active_limits.tau_max).max(axis=1)
        return np.where(ratio.reshape(len(end), -1).max(axis=1) > 1, np.inf, energy)

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
