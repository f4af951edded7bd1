"""Baselines along a planned path, where the usual ones collide or break other limits.

- `waypoints`: from waypoint to waypoint of a planned path, straight in joints, with a rest at each
- `blended`: along the same path without a rest, its corners rounded

A plain program of a robot takes either way around an obstacle. Both are as fast as speed,
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
from joulepath.optimizer.deadline import DeadlinePassed, watch
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
from joulepath.optimizer.search.candidates import Candidate
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


WAYPOINTS = WaypointSettings()


def waypoint_baselines(
    state: SearchState, best: Candidate, table: Sequence[Baseline]
) -> list[Baseline]:
    """The baselines along a planned path, if they are sought and too few others keep every limit.

    Args:
        state: state of the search.
        best: solved candidate, between whose ends the path is planned.
        table: its other baselines.
    """
    held = {each.name for each in table if each.within_limits}
    through = state.problem.tool_path is not None or state.problem.passes
    if not state.seeks_baselines or through or len(held) >= WAYPOINTS.enough:
        return []
    try:
        with watch(state.deadline):
            motions = _motions(state, best, "straight" in held)
            return [_baseline(state, best, *each) for each in motions.items()]
    except DeadlinePassed:
        return []


def _motions(
    state: SearchState, best: Candidate, has_straight: bool
) -> dict[BaselineName, SampledMotion]:
    """The motions along a planned path whose durations the problem allows.

    Without a waypoint between the ends, `waypoints` is `straight`, if there is one.
    """
    prepared, deadline = state.prepared, state.deadline
    limits = prepared.problem.arm.active_limits
    planned = prepared.surroundings.planned_paths(
        best.q_start,
        best.q_goal,
        deadline.within(WAYPOINTS.time_share * deadline.left),
        effort=WAYPOINTS.effort,
    )
    paths = planned.ending_at(best.q_goal)
    if not paths:
        return {}
    legs = [straight(limits, a, b) for a, b in pairwise(paths[0])]
    found: dict[BaselineName, SampledMotion] = {}
    if len(legs) > 1 or not has_straight:
        found["waypoints"] = in_a_row(legs)
    smooth = smooth_path(prepared, paths[0])
    if smooth is not None:
        found["blended"] = _samples_of(without_rest(smooth.control_points, limits.rates))
    slowed = {name: _slowed(prepared, motion, best.duration) for name, motion in found.items()}
    return {name: motion for name, motion in slowed.items() if state.allows(motion.duration)}


def _baseline(
    state: SearchState, best: Candidate, name: BaselineName, motion: SampledMotion
) -> Baseline:
    prepared, problem = state.prepared, state.problem
    assert best.energy is not None
    tau = prepared.torques(motion.q, motion.v, motion.a)
    held = standing(problem.arm, best.q_goal, prepared.torques)
    (broken,) = prepared.broken_on_the_way([motion.q], [motion.v])
    return compared(problem, name, motion, tau, held, best.energy, prepared.potential, broken)


def in_a_row(legs: Sequence[SampledMotion]) -> SampledMotion:
    """One motion of several, each of which begins where and when the one before ends."""
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
    """A motion from rest to rest along control points, fast in every knot span.

    Each span is stretched or shortened until some rate within it is at its limit. The curve stays
    within the convex hulls of successive control points, whatever its knots are.

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


def _samples_of(spline: Spline) -> SampledMotion:
    tau, weights = lobatto_nodes(np.unique(spline.knots) / spline.duration)
    t = tau * spline.duration
    return SampledMotion(t, weights * spline.duration, *sample(spline, t), *peak_rates(spline))


def _slowed(prepared: PreparedProblem, motion: SampledMotion, least: float) -> SampledMotion:
    """The motion, slowed down to a duration [s] if it is shorter, and to the limits on speeds of
    points of the arm."""
    factor = max(least / motion.duration, 1.0) if motion.duration > 0 else 1.0
    if prepared.path is not None:
        ratios = prepared.path.ratios(motion.q, motion.v)
        of_speed = prepared.path.ratios(motion.q, np.zeros_like(motion.v)) == 0
        factor = max(factor, float(np.where(of_speed, ratios, 0.0).max()))
    return motion.scaled_to(factor * motion.duration) if factor > 1 else motion
