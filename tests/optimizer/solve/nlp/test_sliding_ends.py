"""Sliding ends of an NLP: poses of the iterates, curvature of the curves, and solves."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from joulepath import Arm, Problem, load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.held_pose import HeldPose
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.nlp.coordinates import Coordinates
from joulepath.optimizer.solve.nlp.nonlinear_program import NonlinearProgram
from joulepath.optimizer.solve.nlp.sliding_ends import Slide, SlidingEnds
from joulepath.optimizer.solve.nlp.sqp import _Solver, solve
from joulepath.optimizer.solve.nlp.sqp_state import SqpStatus
from tests.optimizer.solve.nlp.second_differences import assert_curvature, without_dry_friction

PANDA = load_robot("panda")
START = np.array([0.3, -0.6, 0.2, -2.0, 0.3, 1.8, 0.4])
GOAL = np.array([-0.5, 0.2, -0.3, -1.4, -0.4, 1.6, 0.9])
# tolerance of poses [m, rad]
POSE_TOLERANCE = 1e-9
# relative tolerance of second differences with steps of 1e-3
DIFFERENCE_TOLERANCE = 5e-3


def curve(q: Array) -> HeldPose:
    return HeldPose.of(Arm(robot=PANDA), q)


@cache
def program(start: bool = True, goal: bool = True) -> NonlinearProgram:
    prepared = PreparedProblem.of(Problem(arm=Arm(robot=PANDA), start=START, goal=GOAL))
    return NonlinearProgram(
        prepared.kernel,
        bspline.uniform(13),
        prepared.objective_parameters,
        Coordinates.joints(START, GOAL, PANDA.limits),
        0.01,
        600.0,
        start_curve=curve(START) if start else None,
        goal_curve=curve(GOAL) if goal else None,
    )


def straight(own: NonlinearProgram) -> Array:
    return own.free_points(START + np.outer(own.basis.quintic, GOAL - START))


def put(own: NonlinearProgram, free: Array, near: Slide | None = None) -> tuple[Array, Slide]:
    found = SlidingEnds(own).put(free, near)
    assert found is not None
    return found


def missed(points: Array) -> float:
    """Largest difference of a pose of the ends from the pose asked for."""
    arm = Arm(robot=PANDA)
    ends = zip(points[[0, -1]], (START, GOAL), strict=True)
    return max(float(np.abs(tcp_pose(arm, q) - tcp_pose(arm, asked)).max()) for q, asked in ends)


def test_points_and_free_points_are_inverse() -> None:
    for start, goal in ((True, True), (True, False), (False, True), (False, False)):
        own = program(start, goal)
        points = np.random.default_rng(3).normal(size=(own.basis.n, 7))
        points[:3], points[-3:] = START, GOAL
        free = own.free_points(points)
        assert len(free) == own.free_count == own.basis.n - 6 + start + goal
        assert (own.points(free) == points).all()
        matrix = own.basis.at_nodes[0]
        assert own.free_columns(matrix).shape[-1] == own.free_count


def test_steps_in_the_null_space_keep_the_poses_to_second_order() -> None:
    own, rng = program(), np.random.default_rng(0)
    free, at = put(own, straight(own))
    kept = at.null_space(free.size)
    assert kept.shape == (free.size, free.size - 12)
    assert (kept.T @ kept).toarray() == pytest.approx(np.eye(kept.shape[1]))
    step = (kept @ rng.normal(size=kept.shape[1])).reshape(free.shape)
    errors = [missed(own.points(free + size * step)) for size in (1e-2, 1e-3)]
    assert errors[1] < 0.02 * errors[0]
    back, _ = put(own, free + 0.1 * step, at)
    assert missed(own.points(back)) < POSE_TOLERANCE


def test_the_curvature_is_that_of_the_cost_along_the_curves() -> None:
    """The curvature equals second differences of the cost along the curves.

    The steps move the ends alone: steps of other points would hide the curvature of the curves.
    """
    own = without_dry_friction(program())
    free, at = put(own, straight(own))
    steps = [np.zeros_like(free) for _ in range(3)]
    for step, lengths in zip(steps, ([1.0, 0.0], [0.0, 1.0], [0.6, -0.8]), strict=True):
        for row, tangent, length in zip(at.rows, at.tangents, lengths, strict=True):
            step[row] = length * tangent

    def drifted(gradient: Array, drift: Array) -> float:
        # displacement of the ends along their curves when they are put back
        ends = zip(at.rows, at.shares, at.tangents, strict=True)
        return sum(
            float(share @ gradient @ tangent) * float(drift[row] @ tangent)
            for row, share, tangent in ends
        )

    assert_curvature(
        own, free, at, lambda moved: put(own, moved, at)[0], drifted, steps, DIFFERENCE_TOLERANCE
    )


@pytest.mark.parametrize(("start", "goal"), [(False, True), (True, False), (True, True)])
def test_the_solver_slides_the_ends_and_needs_less(start: bool, goal: bool) -> None:
    own, fixed = program(start, goal), program(False, False)
    least = solve(fixed, straight(fixed), 2.0)
    found = solve(own, straight(own), 2.0)
    assert found.status is SqpStatus.SOLVED and found.feasible
    points = own.points(found.free)
    assert missed(points) < POSE_TOLERANCE
    assert found.cost < least.cost
    moved = np.abs(points[[0, -1]] - [START, GOAL]).max(axis=1) > 1e-3
    assert moved.tolist() == [start, goal]


def test_a_step_that_keeps_its_promise_is_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    progress = 1e-3
    own = [program(True, True), program(True, False), program(False, True)]
    found = [solve(each, straight(each), 2.0, progress=progress) for each in own]
    monkeypatch.setattr(_Solver, "_kept", lambda *_: False)
    longer = [solve(each, straight(each), 2.0, progress=progress) for each in own]
    assert sum(each.iterations for each in found) < sum(each.iterations for each in longer)
    for early, late in zip(found, longer, strict=True):
        assert early.status is SqpStatus.SOLVED and early.feasible
        assert early.cost == pytest.approx(late.cost, rel=progress)


def test_a_guess_far_from_its_curve_is_refused() -> None:
    unreachable = curve(GOAL)
    unreachable.T[:3, 3] *= 5.0
    own = replace(program(False, True), goal_curve=unreachable)
    with pytest.raises(ValueError, match="not near its curve"):
        solve(own, straight(own), 2.0)
