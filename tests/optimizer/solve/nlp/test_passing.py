"""Passes of an NLP: all iterates keep the passes, and the curvature is exact."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.passing import deviations
from joulepath.optimizer.motion.spline import spline_of
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.nlp.coordinates import Coordinates
from joulepath.optimizer.solve.nlp.nonlinear_program import NonlinearProgram
from joulepath.optimizer.solve.nlp.passing import Passes
from joulepath.optimizer.solve.nlp.sqp import solve
from joulepath.optimizer.solve.nlp.sqp_state import SqpStatus
from tests.optimizer.moves import GOAL, ROBOT, START, problem
from tests.optimizer.solve.nlp.second_differences import assert_curvature, without_dry_friction

ROUNDING = 1e-12
# relative tolerance of second differences with steps of 1e-3
DIFFERENCE_TOLERANCE = 2e-3
PASSES = np.array(
    [START + 0.4 * (GOAL - START) + [0.1, -0.2, 0.1, 0, 0.1, 0], START + 0.7 * (GOAL - START)]
)


def program(count: int = 20) -> NonlinearProgram:
    prepared = PreparedProblem.of(problem())
    coordinates = Coordinates.joints(START, GOAL, ROBOT.limits)
    space = bspline.uniform(count)
    return NonlinearProgram(
        prepared.kernel,
        space,
        prepared.objective_parameters,
        coordinates,
        0.01,
        600.0,
        passes=PASSES,
    )


def straight(own: NonlinearProgram) -> Array:
    points = START + np.outer(own.basis.quintic, GOAL - START)
    return points[own.basis.free]


def test_a_curve_is_put_on_its_passes_by_a_small_change() -> None:
    own = program()
    passes = Passes(own, PASSES)
    free, at = passes.put(straight(own))
    motion = spline_of(own.basis, own.joint_points(free), 1.0)
    assert np.abs(motion.curve(at.times) - PASSES).max() < ROUNDING
    assert (np.diff(at.times) > 0).all()
    again, still = passes.put(free, at)
    assert np.abs(again - free).max() < ROUNDING and np.abs(still.times - at.times).max() < 1e-6


def test_steps_in_the_null_space_keep_the_passes_to_second_order() -> None:
    own, rng = program(), np.random.default_rng(0)
    passes = Passes(own, PASSES)
    free, at = passes.put(straight(own))
    kept = at.null_space(free.size)
    assert kept.shape == (free.size, free.size - len(PASSES) * 5)
    step = (kept @ rng.normal(size=kept.shape[1])).reshape(free.shape)
    missed = []
    for size in (1e-2, 1e-3):
        motion = spline_of(own.basis, own.joint_points(free + size * step), 1.0)
        missed.append(deviations(motion.curve, PASSES).max())
    assert missed[1] < 0.02 * missed[0]
    across = rng.normal(size=free.shape)
    motion = spline_of(own.basis, own.joint_points(free + 1e-3 * across), 1.0)
    assert deviations(motion.curve, PASSES).max() > 100 * missed[1]


def test_the_curvature_is_that_of_the_cost_along_the_curves_that_pass() -> None:
    own = without_dry_friction(program())
    passes = Passes(own, PASSES)
    free, at = passes.put(straight(own))
    kept = at.null_space(free.size)
    steps = kept @ np.random.default_rng(1).normal(size=(kept.shape[1], 5))
    steps = (steps / np.linalg.norm(steps, axis=0)).T.reshape(-1, *free.shape)

    def drifted(gradient: Array, drift: Array) -> float:
        return float(gradient.ravel() @ (kept @ (kept.T @ drift.ravel())))

    assert_curvature(
        own,
        free,
        at,
        lambda moved: passes.put(moved, at)[0],
        drifted,
        list(steps),
        DIFFERENCE_TOLERANCE,
    )


def test_the_solver_ends_on_the_passes_and_slides_along_them() -> None:
    own = program()
    start, at = Passes(own, PASSES).put(straight(own))
    found = solve(own, straight(own), 2.0)
    assert found.status is SqpStatus.SOLVED and found.feasible
    motion = spline_of(own.basis, own.joint_points(found.free), found.duration)
    assert deviations(motion.curve, PASSES).max() < ROUNDING
    assert found.cost < own.value(start, 2.0)[0]
    fixed = Passes(own, PASSES).put(found.free)[1].times
    assert np.abs(fixed - at.times).max() > 1e-3
