"""Which samples of self-motions are solved: those from which the ends may slide to motions of least
energy.

The energy of every pair is estimated from the rest-to-rest quintic on the straight line, of a few
durations. Where the estimate is least along the self-motions, a motion begins. An estimate is some
tenth too high; for pairs of one problem it is so by nearly the same ratio.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import pairwise

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.dynamics.dwell import brake_power, holding_times
from joulepath.optimizer.motion import quintic
from joulepath.optimizer.motion.quadrature import quadrature
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS, Problem
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Candidate, Reason
from joulepath.optimizer.search.ends import EndConfiguration
from joulepath.optimizer.solve.methods.method import above

# durations of the quintic, in multiples of the shortest one, and the panels and points of its
# quadrature
TIME_SCALES, PANELS, POINTS = (1.15, 1.5, 2.2), 4, 3
# the same of a rough estimate
ROUGH_SCALE, ROUGH_PANELS = 1.3, 2
# pairs whose energies are estimated: those of least lower bound
MOST_ESTIMATED = 384
# seeds need at most this ratio of the least estimate, and so many of them are solved at a time
NEAR, MOST_SEEDS = 1.12, 4
# of mechanical work, the best motions do but a part of what the straight line does, and some a much
# smaller one
NEAR_IN_WORK, MOST_SEEDS_FOR_WORK = 2.5, 12


def activate_seeds(prepared: PreparedProblem, candidates: Sequence[Candidate]) -> bool:
    """Activate the deferred candidates where the estimated energy is least; false if none is
    deferred.
    """
    known = [
        each for each in candidates if each.deferred and each.status is CandidateStatus.UNVISITED
    ]
    if not known:
        return False
    if len(known) > MOST_ESTIMATED:
        # many bounds may be the same: zero, where the way down pays for everything. The others keep
        # their order, in which neighbours are next to each other
        by_bound = np.lexsort(
            ([each.shortest for each in known], [each.lower_bound for each in known])
        )
        known = [known[k] for k in np.sort(by_bound[:MOST_ESTIMATED]).tolist()]
    energy = estimates(prepared, known)
    least = _least(known, energy)
    order = [k for k in np.argsort(energy, kind="stable").tolist() if least[k]]
    near, count = how_near(prepared.problem)
    most = above(float(energy[order[0]]), near)
    chosen = [k for k in order if energy[k] <= most][:count]
    for k in chosen:
        known[k].deferred = False
        known[k].settle(CandidateStatus.UNVISITED, Reason.NOT_REACHED)
    return True


def estimates(prepared: PreparedProblem, candidates: Sequence[Candidate]) -> Array:
    """Objectives (n,) [J] of quintics between the ends of candidates: see `estimates_between`."""
    q_start, q_goal = (
        np.array([getattr(each, name) for each in candidates]) for name in ("q_start", "q_goal")
    )
    return estimates_between(
        prepared, q_start, q_goal, np.array([each.shortest for each in candidates])
    )


def expected(prepared: PreparedProblem, candidates: Sequence[Candidate]) -> Array:
    """Objectives (n,) [J] that are expected of candidates: half-way from the lower bound to the
    estimate.
    """
    return (estimates(prepared, candidates) + [each.lower_bound for each in candidates]) / 2


def estimates_between(
    prepared: PreparedProblem, q_start: Array, q_goal: Array, shortest: Array, rough: bool = False
) -> Array:
    """Objectives (n,) [J] of quintics on straight lines between configurations (n, nq) [rad], of
    the best of a few durations by the `shortest` ones (n,) [s], raised where a torque is too high;
    `rough`: of one duration, and half the instants."""
    (at, rate, acceleration), weights = _quintic(ROUGH_PANELS if rough else PANELS)
    way, count = (q_goal - q_start)[:, None], len(q_start)
    best, q = np.full(count, np.inf), q_start[:, None] + way * at
    for durations in _durations(
        prepared.problem, shortest, (ROUGH_SCALE,) if rough else TIME_SCALES
    ):
        T = durations[:, None, None]
        y = np.concatenate([q, way * rate / T, way * acceleration / T**2], axis=2)
        cost, tau = prepared.kernel.values(y.reshape(-1, y.shape[2]), prepared.objective_parameters)
        beyond = (
            np.abs(tau / prepared.arm.active_limits.tau_max)
            .max(axis=1)
            .reshape(count, -1)
            .max(axis=1)
        )
        energy = durations * (cost.reshape(count, -1) @ weights)
        energy += np.abs(energy) * np.maximum(beyond - 1, 0.0)
        best = np.minimum(best, energy + _waiting(prepared, q_goal, durations))
    return best


def _waiting(prepared: PreparedProblem, q_goal: Array, durations: Array) -> Array:
    """Energies (n,) [J] of waiting at goals (n, nq) [rad] until the cycle ends, after motions of
    durations (n,) [s].
    """
    problem = prepared.problem
    if problem.dwell is None or _is_work(problem):
        return np.zeros(len(durations))
    by_motors, by_brakes = np.array([holding_times(problem.dwell, T) for T in durations.tolist()]).T
    return np.asarray(
        prepared.holding_power(q_goal) * by_motors
        + brake_power(problem.dwell, prepared.arm) * by_brakes
    )


def _durations(problem: Problem, shortest: Array, scales: Sequence[float]) -> list[Array]:
    """The durations (n,) [s] that are tried, at these multiples of the shortest ones, within those
    that are allowed; for work and in a cycle the longest one, too."""
    least = DURATIONS.least if problem.duration_min is None else problem.duration_min
    most = DURATIONS.longest if problem.duration_max is None else problem.duration_max
    if problem.dwell is not None:
        most = min(most, problem.dwell.time)
    if least == most:
        return [np.full_like(shortest, most)]
    tried = [np.clip(scale * shortest, least, most) for scale in scales]
    return (
        [*tried, np.full_like(shortest, most)]
        if _is_work(problem) or problem.dwell is not None
        else tried
    )


def how_near(problem: Problem) -> tuple[float, int]:
    """At most this ratio of the least estimate do seeds need, and so many are solved at a time."""
    return (NEAR_IN_WORK, MOST_SEEDS_FOR_WORK) if _is_work(problem) else (NEAR, MOST_SEEDS)


def _is_work(problem: Problem) -> bool:
    return problem.objective == "mechanical"


@cache
def _quintic(panels: int) -> tuple[Array, Array]:
    """Fraction of the way and its first two derivatives by the fraction of time (3, k, 1), and
    weights (k,).
    """
    x, weights = quadrature(np.linspace(0.0, 1.0, panels + 1), POINTS)
    return quintic.derivatives(x)[:, :, None], weights


def _least(candidates: Sequence[Candidate], energy: Array) -> Mask:
    """Which candidates (n,) need no more than their neighbours: the next samples of the same
    self-motions.
    """
    starts, goals = (
        {id(getattr(each, name)): getattr(each, name) for each in candidates}
        for name in ("start", "goal")
    )
    row, column = ({key: k for k, key in enumerate(ends)} for ends in (starts, goals))
    table = np.full((len(starts), len(goals)), np.inf)
    places = np.array([(row[id(each.start)], column[id(each.goal)]) for each in candidates])
    table[tuple(places.T)] = energy
    least = (
        _least_along(table, list(starts.values())) & _least_along(table.T, list(goals.values())).T
    )
    return np.asarray(least[tuple(places.T)])


def _least_along(table: Array, ends: Sequence[EndConfiguration]) -> Mask:
    """Where a table of energies (n, m) is least among neighbours along its first axis, which are
    samples `ends`.
    """
    least = np.ones(table.shape, dtype=bool)
    same = np.array(
        [a.self_motion is b.self_motion is not None for a, b in pairwise(ends)], dtype=bool
    )
    falls = table[1:] < table[:-1]
    least[:-1] &= ~(falls & same[:, None])
    least[1:] &= falls | ~same[:, None]
    return least
