"""Choice of samples of self-motions as seeds, from which the ends slide to motions of least energy.

The energy of every pair is estimated from the rest-to-rest quintic on the straight line, for a few
durations. Pairs of locally least estimate along the self-motions are seeds. An estimate is about a
tenth too high, by nearly the same ratio for all pairs of a problem.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.dynamics.dwell import brake_power, holding_times
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.motion import quintic
from joulepath.optimizer.motion.quadrature import quadrature
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS, Problem
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.sampled_ends import activate_first
from joulepath.optimizer.solve.methods.method import above


@dataclass(frozen=True)
class EstimateSettings:
    """Settings of estimates of the energy."""

    time_scales: tuple[float, ...] = (1.15, 1.5, 2.2)
    """Durations of the quintic, in multiples of the shortest duration."""
    panels: int = 4
    """Panels of the quadrature."""
    points: int = 3
    """Points of the quadrature in a panel."""


@dataclass(frozen=True)
class SeedSettings:
    """Settings of the choice of seeds."""

    most_estimated: int = 384
    """Largest number of pairs whose energy is estimated, in order of their lower bounds."""
    ratio: float = 1.12
    """Largest ratio of a seed's estimate to the least estimate."""
    count: int = 4
    """Largest number of seeds solved at a time."""
    work_ratio: float = 2.5
    """`ratio` for mechanical work: the best motions do far less work than the straight line."""
    work_count: int = 12
    """`count` for mechanical work."""


ESTIMATE = EstimateSettings()
ROUGH_ESTIMATE = EstimateSettings(time_scales=(1.3,), panels=2)
SEEDS = SeedSettings()


def activate_seeds(prepared: PreparedProblem, candidates: Sequence[Candidate]) -> bool:
    """Activate the deferred candidates of locally least estimated energy.

    Returns:
        Whether any candidate was deferred.
    """
    known = _deferred(candidates)
    if not known:
        return False
    if len(known) > SEEDS.most_estimated:
        # many bounds may be zero, if the fall pays for everything: then durations decide. The
        # chosen pairs keep their order, in which neighbours on a curve are next to each other
        by_bound = np.lexsort(
            ([each.shortest for each in known], [each.lower_bound for each in known])
        )
        known = [known[k] for k in np.sort(by_bound[: SEEDS.most_estimated]).tolist()]
    energy = estimates(prepared, known)
    is_least = _local_minima(known, energy)
    order = [k for k in np.argsort(energy, kind="stable").tolist() if is_least[k]]
    ratio, count = seed_limits(prepared.problem)
    most = above(float(energy[order[0]]), ratio)
    chosen = [k for k in order if energy[k] <= most][:count]
    for k in chosen:
        known[k].activate()
    return True


def activate_on_path(prepared: PreparedProblem, candidates: Sequence[Candidate]) -> bool:
    """Activate the deferred starts of a tool path of least estimated energy, few of each branch.

    Returns:
        Whether any candidate was deferred.
    """
    known = _deferred(candidates)
    if not known:
        return False
    return activate_first([known[k] for k in np.argsort(estimates_on_path(prepared, known))])


def _deferred(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The candidates that are deferred and were not visited yet."""
    return [
        each for each in candidates if each.deferred and each.status is CandidateStatus.UNVISITED
    ]


def locally_least(candidates: Sequence[Candidate], energy: Array) -> list[Candidate]:
    """Candidates of locally least energies (n,) along their self-motions, the least first."""
    is_least = _local_minima(candidates, energy)
    return [candidates[k] for k in np.argsort(energy, kind="stable").tolist() if is_least[k]]


def estimates(prepared: PreparedProblem, candidates: Sequence[Candidate]) -> Array:
    """Estimated objectives of candidates, shape (n,) [J]; see `estimates_between`."""
    q_start, q_goal = (
        np.array([getattr(each, name) for each in candidates]) for name in ("q_start", "q_goal")
    )
    return estimates_between(
        prepared, q_start, q_goal, np.array([each.shortest for each in candidates])
    )


def expected(prepared: PreparedProblem, candidates: Sequence[Candidate]) -> Array:
    """Expected objectives of candidates, shape (n,) [J]: the mean of lower bound and estimate."""
    return (estimates(prepared, candidates) + [each.lower_bound for each in candidates]) / 2


def estimates_between(
    prepared: PreparedProblem, q_start: Array, q_goal: Array, shortest: Array, rough: bool = False
) -> Array:
    """Objectives of quintics on straight lines between configurations, shape (n,) [J].

    Of a few durations the best counts. Where a torque is too high, the objective is raised.

    Args:
        prepared: problem of the motions.
        q_start: start configurations, shape (n, nq) [rad].
        q_goal: goal configurations, shape (n, nq) [rad].
        shortest: shortest durations, shape (n,) [s].
        rough: whether a single duration and half the instants suffice.
    """
    settings = ROUGH_ESTIMATE if rough else ESTIMATE
    quintics = partial(of_quintics, prepared, q_start, q_goal, settings=settings)
    return _best_of_durations(prepared, quintics, q_goal, shortest, settings)


def estimates_on_path(prepared: PreparedProblem, candidates: Sequence[Candidate]) -> Array:
    """Estimated objectives of motions along a tool path, shape (n,) [J].

    The motions are quintics on the curves of the joints that lead the tool along the path. Straight
    lines between the ends, and the lower bounds of free ends, say little about these motions.

    Args:
        prepared: problem of the motions.
        candidates: candidates with known traces.
    """
    (at, rate, acceleration), _ = _quintic(ESTIMATE)
    limits, lines = prepared.arm.active_limits, list[Array]()
    for each in candidates:
        trace = prepared.followed.known_trace(each.q_start)
        assert trace is not None
        curve = CubicSpline(trace.at, trace.q)
        lines.append(np.stack([curve(at[:, 0], order) for order in range(3)]))
    q, slope, bend = np.stack(lines, axis=1)
    speed = np.abs(slope * rate) / limits.v_max
    pull = np.abs(bend * rate**2 + slope * acceleration) / limits.a_max
    shortest = np.maximum(speed, np.sqrt(pull)).max(axis=(1, 2))
    motions = partial(_on_lines, prepared, (q, slope, bend), settings=ESTIMATE)
    q_goal = np.array([each.q_goal for each in candidates])
    return _best_of_durations(prepared, motions, q_goal, shortest, ESTIMATE)


def _best_of_durations(
    prepared: PreparedProblem,
    objectives: Callable[..., tuple[Array, Array]],
    q_goal: Array,
    shortest: Array,
    settings: EstimateSettings,
) -> Array:
    """Least objectives (n,) [J] over a few durations, raised where a torque is too high.

    Args:
        prepared: problem of the motions.
        objectives: objectives and ratios of torques for the durations `durations` (n,) [s].
        q_goal: goal configurations, shape (n, nq) [rad].
        shortest: shortest durations, shape (n,) [s].
        settings: settings of the estimate.
    """
    best = np.full(len(q_goal), np.inf)
    for durations in _durations(prepared.problem, shortest, settings.time_scales):
        energy, torque_ratio = objectives(durations=durations)
        energy += np.abs(energy) * np.maximum(torque_ratio - 1, 0.0)
        best = np.minimum(best, energy + _waiting(prepared, q_goal, durations))
    return best


def of_quintics(
    prepared: PreparedProblem,
    q_start: Array,
    q_goal: Array,
    durations: Array,
    settings: EstimateSettings = ESTIMATE,
) -> tuple[Array, Array]:
    """Objectives (n,) [J] of quintics from q_start to q_goal (n, nq) [rad] in durations (n,) [s],
    and their largest ratios (n,) of a torque to its limit.
    """
    (at, _, _), _ = _quintic(settings)
    displacement = (q_goal - q_start)[:, None]
    q = q_start[:, None] + displacement * at
    slope = np.broadcast_to(displacement, q.shape)
    return _on_lines(prepared, (q, slope, np.zeros_like(q)), durations, settings)


def _on_lines(
    prepared: PreparedProblem,
    lines: tuple[Array, Array, Array],
    durations: Array,
    settings: EstimateSettings,
) -> tuple[Array, Array]:
    """The same as `of_quintics` on curves: configurations and first two derivatives (n, k, nq) by
    the fraction, at the fractions of the quintic.
    """
    (_, rate, acceleration), weights = _quintic(settings)
    (q, slope, bend), T, count = lines, durations[:, None, None], len(durations)
    y = np.concatenate(
        [q, slope * rate / T, (bend * rate**2 + slope * acceleration) / T**2], axis=2
    )
    cost, tau = prepared.kernel.values(y.reshape(-1, y.shape[2]), prepared.objective_parameters)
    ratio = np.abs(tau / prepared.arm.active_limits.tau_max).max(axis=1)
    energy = durations * (cost.reshape(count, -1) @ weights)
    return np.asarray(energy), np.asarray(ratio.reshape(count, -1).max(axis=1))


def _waiting(prepared: PreparedProblem, q_goal: Array, durations: Array) -> Array:
    """Energies of waiting at goals until the cycle ends, shape (n,) [J].

    Args:
        prepared: problem of the motions.
        q_goal: goal configurations, shape (n, nq) [rad].
        durations: durations of the motions, shape (n,) [s].
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
    """Durations for which energies are estimated, each of shape (n,) [s], within the allowed
    interval.

    For mechanical work and with a dwell, the longest duration is among them.

    Args:
        problem: the problem.
        shortest: shortest durations, shape (n,) [s].
        scales: multiples of the shortest durations.
    """
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


def seed_limits(problem: Problem) -> tuple[float, int]:
    """Largest ratio of a seed's estimate to the least, and number of seeds solved at a time."""
    if _is_work(problem):
        return SEEDS.work_ratio, SEEDS.work_count
    return SEEDS.ratio, SEEDS.count


def _is_work(problem: Problem) -> bool:
    return problem.objective == "mechanical"


@cache
def _quintic(settings: EstimateSettings) -> tuple[Array, Array]:
    """The quintic s(x) and its first two derivatives (3, k, 1), and quadrature weights (k,)."""
    x, weights = quadrature(np.linspace(0.0, 1.0, settings.panels + 1), settings.points)
    return quintic.derivatives(x)[:, :, None], weights


def _local_minima(candidates: Sequence[Candidate], energy: Array) -> Mask:
    """Whether a candidate (n,) needs no more energy than its neighbours.

    Neighbours are the next samples of the same self-motions.
    """
    starts = list(dict.fromkeys(each.start for each in candidates))
    goals = list(dict.fromkeys(each.goal for each in candidates))
    row, column = ({end: k for k, end in enumerate(ends)} for ends in (starts, goals))
    table = np.full((len(starts), len(goals)), np.inf)
    cells = np.array([(row[each.start], column[each.goal]) for each in candidates])
    table[tuple(cells.T)] = energy
    is_least = _local_minima_along(table, starts) & _local_minima_along(table.T, goals).T
    return np.asarray(is_least[tuple(cells.T)])


def _local_minima_along(table: Array, ends: Sequence[EndConfiguration]) -> Mask:
    """Local minima of a table of energies (n, m) along its first axis, the samples `ends` (n,)."""
    least = np.ones(table.shape, dtype=bool)
    same = np.array(
        [a.self_motion is b.self_motion is not None for a, b in pairwise(ends)], dtype=bool
    )
    falls = table[1:] < table[:-1]
    least[:-1] &= ~(falls & same[:, None])
    least[1:] &= falls | ~same[:, None]
    return least
