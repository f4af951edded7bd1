"""Torques far below their limits, checked at quadrature points alone, keep the limits between."""

from __future__ import annotations

import tracemalloc
from typing import Any

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Deadline, DeadlinePassed, watch
from joulepath.optimizer.dynamics.limited_torque import limited_parts
from joulepath.optimizer.dynamics.torque_bound import TORQUE_BOUND
from joulepath.optimizer.motion import bspline, seven_segment
from joulepath.optimizer.motion.bspline import Basis
from joulepath.optimizer.motion.ruckig_motion import time_optimal_spline
from joulepath.optimizer.motion.spline import (
    Spline,
    lasting,
    peak_rates,
    retimed,
    sample,
    time_scale,
)
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.methods.limit_repair import path_excess, torque_peaks
from tests.optimizer.moves import GOAL, PAYLOAD, START, TILTED, limits, problem

# samples of a motion, finer than the certificate's grid of 1 ms
SAMPLES = 6_001
# memory for the check of a motion of a minute [byte]
MOST_MEMORY = 30e6
# relative tolerance of torques by the same kernel at other instants
ROUNDING = 1e-12
# spread of the control points about START [rad]: short motions have the steepest torques
SPREADS = (1e-3, 1e-2, 0.1, 1.0)
TASKS: list[dict[str, Any]] = [
    {},
    {"payload": PAYLOAD, "gravity": TILTED},
    {"friction": "coulomb_viscous"},
]


def spaces() -> list[Basis]:
    """Few control points, many control points, and repeated knots at switches of jerk."""
    graded = bspline.graded(seven_segment.switches(np.full(6, 1.0), 1.0, limits()), 3)
    return [bspline.uniform(13), bspline.uniform(40), graded]


def random_motion(
    prepared: PreparedProblem, space: Basis, spread: float, rng: np.random.Generator
) -> Spline:
    """A motion through random control points at the largest feasible rates."""
    points = START + spread * rng.uniform(-1, 1, (space.n, len(START)))
    points[: bspline.REST_POINTS], points[-bspline.REST_POINTS :] = points[0], points[-1]
    spline = Spline(bspline.DEGREE, space.knots, points)
    return retimed(
        spline, time_scale(peak_rates(spline) / prepared.problem.arm.active_limits.rates)
    )


def estimate(prepared: PreparedProblem, spline: Spline) -> Array:
    """Estimate (nq,) of the largest torques of a motion, for the comparison with `far_below`."""
    _, _, v, a, tau, _ = prepared.report_samples(spline)
    parts = limited_parts(prepared.arm, tau, v, a)
    return np.asarray(sum(np.abs(part).max(axis=0) for part in parts))


def test_a_motion_of_minutes_is_checked_in_little_memory_and_in_time() -> None:
    """The frames of all links at every millisecond would take 50 MB per minute."""
    prepared = PreparedProblem.of(problem(tcp_speed=0.25))
    motion = lasting(time_optimal_spline(limits(), START, GOAL), 60.0)
    tracemalloc.start()
    path_excess(prepared, motion, prepared.path, None)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < MOST_MEMORY
    with pytest.raises(DeadlinePassed), watch(Deadline.after(-1.0)):
        path_excess(prepared, motion, prepared.path, None)


@pytest.mark.parametrize("given", TASKS)
def test_what_is_far_below_the_torque_limits_is_within_them_everywhere(
    given: dict[str, Any],
) -> None:
    prepared = PreparedProblem.of(problem(START, START + 0.5, **given))
    tau_max = prepared.problem.arm.active_limits.tau_max
    rng, worst, skipped = np.random.default_rng(5), 0.0, 0
    for space in spaces():
        for spread in SPREADS * 2:
            spline = random_motion(prepared, space, spread, rng)
            estimated = estimate(prepared, spline)
            q, v, a = sample(spline, np.linspace(0.0, spline.duration, SAMPLES))
            truth = np.abs(prepared.limited_torques(q, v, a)).max(axis=0)
            worst = max(worst, float((truth / estimated).max()))
            if (estimated <= TORQUE_BOUND.far_below * tau_max).all():
                skipped += 1
                assert (truth <= tau_max).all()
            else:
                assert (torque_peaks(prepared, spline) >= truth * (1 - ROUNDING)).all()
    # with limits at the measured torques, all motions would count as far below
    assert worst <= 1 / TORQUE_BOUND.far_below
    assert skipped
