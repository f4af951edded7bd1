"""Refined solves of least mechanical work, by the interior-point method, from coarse motions.

The cost smooths the corner of each joint's |power| at zero. Refined solves have narrow corners.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.plant import SMOOTHING
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import Spline, span_peak_rates, spline_of
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.methods.limit_repair import LIMIT_REPAIR, repair_factors
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from joulepath.optimizer.solve.nlp.interior_point import InteriorPoint
from joulepath.optimizer.solve.nlp.interior_state import Interior


@dataclass(frozen=True)
class RefinedWorkSettings:
    """Settings of a refined solve of least mechanical work."""

    repairs: int = 8
    """Largest number of solves, each with the limits tightened that the motion before exceeds
    between the nodes."""

    progress: float = 2e-4
    """Relative decrease of the work below which a solve ends."""

    smoothing_share: float = 0.5
    """Mean excess of a joint's smoothed power over its power, as a share of the corner width."""


REFINED_WORK = RefinedWorkSettings()


def refine_work(
    prepared: PreparedProblem,
    points: Array,
    duration: float,
    first_width: float,
    incumbent_cost: float = np.inf,
    settings: RefinedWorkSettings = REFINED_WORK,
) -> tuple[SolveResult, Array]:
    """Solve for the motion of least work at a fixed duration, with narrow corners of power.

    Args:
        prepared: the problem.
        points: control points over evenly spaced knots, shape (n, nq) [rad].
        duration: duration of the motion [s].
        first_width: width of the corners in the first iterations [W].
        incumbent_cost: work that the motion must come below [J]; the solve ends early otherwise.
        settings: settings of the solve.

    Returns:
        The result, without a motion if the motion collides, and the control points reached, shape
        (n, nq) [rad].
    """
    limits = prepared.problem.arm.active_limits.scaled(1 - LIMIT_REPAIR.margin)
    basis, nq = bspline.uniform(len(points)), points.shape[1]
    parameters = lru_cache(lambda width: prepared.parameters(mechanical=1.0, width=width))
    program = InteriorPoint(
        prepared.kernel, basis, limits, duration, parameters, prepared.frictionless_parameters
    )
    ends, bounds = points[[0, -1]], program.unbounded()
    width, within = SMOOTHING.sharper_power_widths[-1], LIMIT_REPAIR.within
    free = np.clip(points[basis.free], limits.q_min, limits.q_max)
    at = program.first(ends, free, first_width, bounds)
    most = incumbent_cost + settings.smoothing_share * width * duration * nq
    for solves in range(1, settings.repairs + 1):
        at = program.minimised(ends, at, width, bounds, settings.progress, most)
        if at.costlier:
            return SolveResult(
                SolveStatus.PRUNED, SolveReason.PROMISES_NO_LESS, at.iterations, solves
            ), points
        points = program.points(ends, at.free)
        if not at.converged:
            return SolveResult(
                SolveStatus.FAILED, SolveReason.NOT_CONVERGED, at.iterations, solves
            ), points
        spline = spline_of(basis, points, duration)
        spans = span_peak_rates(spline) / prepared.problem.arm.active_limits.rates[:, None]
        torque = np.ones(nq)
        if (spans <= within).all():
            factors = repair_factors(prepared, spline, (np.zeros(nq), np.zeros(nq)))
            if factors is None:
                return _checked(prepared, spline, at, solves), points
            torque = factors.tau_max
        bounds = program.tightened(
            bounds, 1 / np.where(spans > within, spans + LIMIT_REPAIR.tightening, 1.0), torque
        )
    return SolveResult(
        SolveStatus.FAILED, SolveReason.LIMITS_BETWEEN_NODES, at.iterations, settings.repairs
    ), points


def _checked(prepared: PreparedProblem, spline: Spline, at: Interior, solves: int) -> SolveResult:
    """The result of a motion within the limits, checked for collisions."""
    collision = prepared.surroundings.worst_violation(spline)
    effort = at.iterations, solves
    if collision is not None:
        return SolveResult(
            SolveStatus.FAILED, SolveReason.MOTION_COLLIDES, *effort, collision=collision
        )
    return SolveResult(SolveStatus.SOLVED, SolveReason.CONVERGED, *effort, spline, at.stationarity)
