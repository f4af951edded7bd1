"""Motions of least mechanical work with sharp corners, by the interior-point method, from motions
that are near.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.plant import SHARPER_WIDTHS
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import Spline, span_peak_rates, spline_of
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.methods.limit_repair import (
    MARGIN,
    REPAIR_MARGIN,
    WITHIN,
    repair_factors,
)
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from joulepath.optimizer.solve.nlp.interior_point import Interior, InteriorPoint

# solves, each with limits tightened where the motion before exceeds them between the points
REPAIRS = 8
# relative decrease of the work that a further step must promise
PROGRESS = 2e-4
# part of the width of its corner by which a joint's smooth power is above its power, on the mean
ROUNDED = 0.5


def sharp_motion(
    prepared: PreparedProblem, points: Array, duration: float, first: float, below: float = np.inf
) -> tuple[SolveResult, Array]:
    """The motion from control points (n, nq) [rad] over evenly spaced knots, with corners of
    `first` [W] at first.

    It lasts `duration` [s]. It may collide: then the result has the collision, but no motion.
    Returned with its control points (n, nq) [rad]. It is given up if it is not expected to need
    less than `below` [J].
    """
    limits = prepared.problem.arm.active_limits.scaled(1 - MARGIN)
    basis, nq = bspline.uniform(len(points)), points.shape[1]
    parameters = lru_cache(lambda width: prepared.parameters(mechanical=1.0, width=width))
    program = InteriorPoint(
        prepared.kernel, basis, limits, duration, parameters, prepared.frictionless_parameters
    )
    ends, bounds = points[[0, -1]], program.unbounded()
    at = program.first(ends, np.clip(points[basis.free], limits.q_min, limits.q_max), first, bounds)
    most = below + ROUNDED * SHARPER_WIDTHS[-1] * duration * nq
    for solves in range(1, REPAIRS + 1):
        at = program.minimised(ends, at, SHARPER_WIDTHS[-1], bounds, PROGRESS, most)
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
        spans, torque = (
            span_peak_rates(spline) / prepared.problem.arm.active_limits.rates[:, None],
            np.ones(nq),
        )
        if (spans <= WITHIN).all():
            factors = repair_factors(prepared, spline, (np.zeros(nq), np.zeros(nq)))
            if factors is None:
                return _checked(prepared, spline, at, solves), points
            torque = factors.tau_max
        bounds = program.tightened(
            bounds, 1 / np.where(spans > WITHIN, spans + REPAIR_MARGIN, 1.0), torque
        )
    return SolveResult(
        SolveStatus.FAILED, SolveReason.LIMITS_BETWEEN_NODES, at.iterations, REPAIRS
    ), points


def _checked(prepared: PreparedProblem, spline: Spline, at: Interior, solves: int) -> SolveResult:
    """The result of a motion within the limits."""
    collision = prepared.surroundings.worst_violation(spline)
    effort = at.iterations, solves
    if collision is not None:
        return SolveResult(
            SolveStatus.FAILED, SolveReason.MOTION_COLLIDES, *effort, collision=collision
        )
    return SolveResult(SolveStatus.SOLVED, SolveReason.CONVERGED, *effort, spline, at.stationarity)
