"""Baselines along a planned path, for problems with collisions of the usual baselines.

- `waypoints`: straight in joint space between the waypoints of a planned path, with a rest at every
  waypoint
- `blended`: along the same path without rests, with rounded corners

Simple robot programs avoid an obstacle in these two ways. Both baselines are as fast as speed,
acceleration and jerk of the joints and the speeds of TCP and elbow allow, but not faster than our
motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.planner.path_planner import Effort
from joulepath.optimizer.deadline import Deadline, DeadlinePassed, watch
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.quadrature import lobatto_nodes
from joulepath.optimizer.motion.ruckig_motion import straight
from joulepath.optimizer.motion.spline import (
    Spline,
    peak_rates,
    retimed,
    sample,
    span_peak_rates,
    time_scales,
)
from joulepath.optimizer.motion.time_scalings import SampledMotion
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.result.baseline import Baseline, BaselineName
from joulepath.optimizer.search.baselines import compared, standing
from joulepath.optimizer.search.candidates import STANDSTILL, Candidate
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods.planned_paths import smooth_path


@dataclass(frozen=True)
class WaypointSettings:
    """Settings of the baselines along a planned path."""

    enough: int = 2
    """Baselines within every limit beside which none is needed along a path."""
    effort: Effort = field(default_factory=lambda: Effort(most_states=5_000, paths=1))
    """Effort of the planning: one path around a bin takes about 1,000 states."""
    time_share: float = 0.2
    """Share of the time left that the planning may take."""
    stretches: int = 20
    """Rounds in which knot spans are stretched; the duration then changes by less than 1e-3."""
    stretch: float = 0.3
    """Power of the factor that a span needs by which it is stretched in a round."""

    same: float = 1e-6
    """Relative difference of two equal durations or energies."""


WAYPOINTS = WaypointSettings()


def waypoint_baselines(
    state: SearchState, best: Candidate, table: Sequence[Baseline]
) -> list[Baseline]:
    """Compute the baselines along a planned path, if too few other baselines keep every limit.

    Baselines with an inadmissible duration are left out. So is `waypoints` without an intermediate
    waypoint, because it equals `straight`.

    Args:
        state: state of the search.
        best: solved candidate; the path connects its ends.
        table: its other baselines.

    Returns:
        The baselines; empty if none are requested, or after the deadline.
    """
    held = {each.name for each in table if each.within_limits}
    through = state.problem.tool_path is not None or state.problem.passes
    if not state.seeks_baselines or through or len(held) >= WAYPOINTS.enough:
        return []
    assert best.energy is not None
    ends = best.q_start, best.q_goal
    try:
        with watch(state.deadline):
            found = along_waypoints(
                state.prepared, *ends, best.duration, best.energy, state.deadline
            )
    except DeadlinePassed:
        return []
    return [each for each in found if state.allows(each.duration) and not _is_among(each, table)]


def _is_among(each: Baseline, table: Sequence[Baseline]) -> bool:
    """Whether a table has the same baseline by another name."""
    own = each.duration, each.electrical
    others = np.array([(other.duration, other.electrical) for other in table]).reshape(-1, 2)
    return bool(np.isclose(others, own, rtol=WAYPOINTS.same, atol=0.0).all(axis=1).any())


def along_waypoints(
    prepared: PreparedProblem,
    q_start: Array,
    q_goal: Array,
    least: float,
    ours: float,
    deadline: Deadline,
) -> list[Baseline]:
    """Compute the baselines along a planned path between two configurations.

    Args:
        prepared: the problem.
        q_start: start, shape (nq,) [rad].
        q_goal: goal, shape (nq,) [rad].
        least: duration of our motion [s]; faster baselines are slowed down to it.
        ours: objective of our motion [J].
        deadline: end of the planning at the latest.

    Returns:
        The baselines; empty without a planned path, or without a displacement.

    Raises:
        DeadlinePassed: the watched deadline passed.
    """
    if np.abs(q_goal - q_start).max() <= STANDSTILL:
        return []
    arm = prepared.problem.arm
    limits = arm.active_limits
    planned = prepared.surroundings.planned_paths(
        q_start,
        q_goal,
        deadline.within(WAYPOINTS.time_share * deadline.left),
        effort=WAYPOINTS.effort,
    )
    paths = planned.ending_at(q_goal)
    if not paths:
        return []
    legs = [straight(limits, a, b) for a, b in pairwise(paths[0])]
    motions: dict[BaselineName, SampledMotion] = {"waypoints": in_a_row(legs)}
    smooth = smooth_path(prepared, paths[0])
    if smooth is not None:
        motions["blended"] = samples_of(without_rest(smooth.control_points, limits.rates))
    held, found = standing(arm, q_goal, prepared.torques), list[Baseline]()
    for name, given in motions.items():
        motion = slowed(prepared, given, least)
        tau = prepared.torques(motion.q, motion.v, motion.a)
        (broken,) = prepared.broken_on_the_way([motion.q], [motion.v], [motion.q])
        found.append(
            compared(prepared.problem, name, motion, tau, held, ours, prepared.potential, broken)
        )
    return found


def in_a_row(legs: Sequence[SampledMotion]) -> SampledMotion:
    """Join motions in a row; every motion begins at the end of the one before."""
    begins = np.cumsum([0.0, *(leg.duration for leg in legs)])
    joined = {
        name: np.concatenate([getattr(leg, name) for leg in legs])
        for name in ("weights", "q", "v", "a")
    }
    peaks = {
        name: np.max([getattr(leg, name) for leg in legs], axis=0)
        for name in ("peak_v", "peak_a", "peak_jerk")
    }
    t = np.concatenate([begin + leg.t for begin, leg in zip(begins, legs, strict=False)])
    return SampledMotion(t=t, **joined, **peaks)


def without_rest(points: Array, rates: Array) -> Spline:
    """Time a motion from rest to rest along control points, fast in every knot span.

    The knot spans are stretched or shortened until a rate reaches its limit in every span. The
    curve stays within the convex hulls of successive control points for any knots.

    Args:
        points: control points, shape (n, nq) [rad].
        rates: limits of speed, acceleration and jerk, shape (3, nq).
    """
    rest = bspline.REST_POINTS - 1
    points = np.pad(points, ((rest, rest), (0, 0)), mode="edge")
    spans = np.ones(len(points) - bspline.DEGREE)
    fastest: Spline | None = None
    for _ in range(WAYPOINTS.stretches):
        breaks = np.append(0.0, np.cumsum(spans))
        spline = Spline(bspline.DEGREE, bspline.clamped(breaks / breaks[-1]) * breaks[-1], points)
        factors = time_scales(np.moveaxis(span_peak_rates(spline) / rates[:, None], 1, 0))
        within = retimed(spline, float(factors.max()))
        if fastest is None or within.duration < fastest.duration:
            fastest = within
        spans *= factors**WAYPOINTS.stretch
        spans /= spans.sum()
    assert fastest is not None
    return fastest


def samples_of(spline: Spline) -> SampledMotion:
    """A motion from rest to rest as samples."""
    tau, weights = lobatto_nodes(np.unique(spline.knots) / spline.duration)
    t = tau * spline.duration
    return SampledMotion(t, weights * spline.duration, *sample(spline, t), *peak_rates(spline))


def slowed(prepared: PreparedProblem, motion: SampledMotion, least: float) -> SampledMotion:
    """The motion, slowed down to a duration [s] if it is shorter, and to the limits on speeds of
    points of the arm."""
    factor = max(least / motion.duration, 1.0) if motion.duration > 0 else 1.0
    if prepared.path is not None:
        ratios = prepared.path.ratios(motion.q, motion.v)
        of_speed = prepared.path.ratios(motion.q, np.zeros_like(motion.v)) == 0
        factor = max(factor, float(np.where(of_speed, ratios, 0.0).max()))
    return motion.scaled_to(factor * motion.duration) if factor > 1 else motion
