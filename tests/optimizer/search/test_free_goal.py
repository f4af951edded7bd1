"""Goals with a partly free orientation: allowed poses, answers, and the bound over all poses."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from scipy.stats import qmc

from joulepath import ConeOrientedPose, Pose
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.orientation_tolerance import (
    excess_angle,
    nearest_orientation,
    sample_orientations,
)
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.free_goal import goal_constraints
from joulepath.optimizer.solve.methods.duration_intervals import duration_intervals
from joulepath.optimizer.solve.nlp.coordinates import Coordinates, GoalConstraints
from joulepath.optimizer.solve.nlp.nonlinear_program import NonlinearProgram
from joulepath.optimizer.solve.nlp.sqp import solve
from tests.optimizer.moves import (
    GOAL,
    PAYLOAD,
    START,
    problem,
    tcp_pose,
)
from tests.optimizer.solve.nlp.second_differences import without_dry_friction

# of angles computed through rotation vectors [rad]
ROUNDING = 1e-9
TOOL = pin.SE3(pin.rpy.rpyToMatrix(0.3, -0.2, 0.9), np.array([0.03, -0.02, 0.15])).homogeneous


def angle(a: Array, b: Array) -> float:
    """Angle [rad] between two vectors, by a different formula than the code."""
    return 2 * float(
        np.arcsin(min(1.0, np.linalg.norm(a / np.linalg.norm(a) - b / np.linalg.norm(b)) / 2))
    )


def rotations(seed: int, count: int) -> list[Array]:
    rng = np.random.default_rng(seed)
    return [
        pin.exp3(rng.uniform(-np.pi, np.pi) * v / np.linalg.norm(v))
        for v in rng.normal(size=(count, 3))
    ]


def test_samples_are_of_the_halton_sequence() -> None:
    """The samples equal SciPy's Halton sequence, with the cosine of the tilt in base 2."""
    R = sample_orientations(ConeOrientedPose(np.zeros(3)), 100)
    levels = qmc.Halton(3, scramble=False).random(100)[:, 0]
    assert R[:, 2, 2] == pytest.approx(1 - 2 * levels, abs=ROUNDING)


@pytest.mark.parametrize("half_angle", [0.0, 1e-3, 0.4, 2.5, np.pi])
def test_samples_are_allowed_and_fill_what_is(half_angle: float) -> None:
    axis, direction = np.array([1.0, -2.0, 0.5]), np.array([0.2, 0.1, -1.0])
    pose = ConeOrientedPose(np.zeros(3), axis, direction, half_angle)
    samples = sample_orientations(pose, 200)
    tilts = np.array([angle(R @ axis, direction) for R in samples])
    assert tilts.max() <= half_angle + ROUNDING
    assert tilts.max() >= 0.9 * half_angle
    # the cap's area grows with 1 - cos: half of the samples lie within half of it
    level = (1 - np.cos(tilts)) / max(1 - np.cos(half_angle), 1e-12)
    assert half_angle == 0 or np.median(level) == pytest.approx(0.5, abs=0.02)
    for R in samples:
        assert excess_angle(pose, R) <= ROUNDING
        assert pin.log3(nearest_orientation(pose, R).T @ R) == pytest.approx(
            np.zeros(3), abs=ROUNDING
        )


@pytest.mark.parametrize("half_angle", [0.0, 0.4, 2.5])
def test_the_nearest_orientation_is_allowed_and_as_far_as_said(half_angle: float) -> None:
    pose = ConeOrientedPose(np.zeros(3), [0, 1, 1], [1, 0, 0], half_angle)
    for R in rotations(1, 50):
        beyond = angle(R @ np.array([0, 1, 1]), np.array([1, 0, 0])) - half_angle
        assert excess_angle(pose, R) == pytest.approx(max(0.0, beyond), abs=1e-7)
        nearest = nearest_orientation(pose, R)
        assert excess_angle(pose, nearest) <= ROUNDING
        assert np.linalg.norm(pin.log3(nearest @ R.T)) == pytest.approx(
            excess_angle(pose, R), abs=1e-7
        )


def test_opposite_axes_have_a_way_back() -> None:
    pose = ConeOrientedPose(np.zeros(3), [0, 0, 1], [0, 0, -1], 0.0)
    assert excess_angle(pose, np.eye(3)) == pytest.approx(np.pi)
    assert excess_angle(pose, nearest_orientation(pose, np.eye(3))) <= ROUNDING


@pytest.mark.parametrize(
    "pose",
    [
        ConeOrientedPose(np.zeros(3)),
        ConeOrientedPose.about(tcp_pose(GOAL), [0, 0, 1]),
        ConeOrientedPose(np.zeros(3), half_angle=0.3),
    ],
)
def test_leeway_is_the_derivative_of_forward_kinematics(pose: ConeOrientedPose) -> None:
    """The leeway is the null space of the derivative of forward kinematics.

    To first order, a step inside the leeway moves neither the TCP nor a fixed tool axis.
    """
    rng, step = np.random.default_rng(2), 1e-5
    task = PreparedProblem.of(problem(goal=GOAL, T_flange_tcp=TOOL, payload=PAYLOAD))
    allowed = goal_constraints(task, pose, GOAL, 0.5)
    level = allowed.rows[allowed.lower == allowed.upper]
    _, values, basis = np.linalg.svd(level)
    free = basis[int((values > 1e-9).sum()) :].T @ rng.normal(
        size=len(basis) - int((values > 1e-9).sum())
    )
    free *= step / np.linalg.norm(free)
    before, after = tcp_pose(GOAL - free, TOOL).T, tcp_pose(GOAL + free, TOOL).T
    # central differences, with an error of third order
    assert np.linalg.norm(after[:3, 3] - before[:3, 3]) < 1e-4 * step
    turned = np.linalg.norm((after - before)[:3, :3] @ pose.axis)
    assert (turned < 1e-4 * step) == (pose.half_angle == 0)


def test_a_programme_with_its_goal_unknown_has_true_derivatives() -> None:
    """Gradient and Hessian with a free goal agree with central differences.

    The goal is among the unknowns, and the motion ends at rest.
    """
    task = PreparedProblem.of(problem(goal=GOAL))
    space, interval = bspline.uniform(9), duration_intervals(task, GOAL)[0]
    coordinates = Coordinates.joints(START, GOAL, task.arm.active_limits)
    free_end = GoalConstraints(np.eye(6), np.full(6, -1.0), np.full(6, 1.0), 1.0)
    program = without_dry_friction(
        NonlinearProgram(
            task.kernel, space, interval.p, coordinates, 0.1, 10.0, goal_constraints=free_end
        )
    )
    rng = np.random.default_rng(3)
    free = np.linspace(START, GOAL, program.free_count) + rng.normal(
        scale=0.1, size=(program.free_count, 6)
    )
    assert (program.points(free)[-3:] == free[-1]).all()
    duration, none = 1.3, np.zeros((len(space.nodes), 6))
    line = program.derivatives(free, duration, none)
    direction, step = rng.normal(size=free.shape), 1e-5
    ends = [program.value(free + sign * step * direction, duration)[0] for sign in (1, -1)]
    slope = float(line.gradient[:-1] @ direction.ravel())
    # third derivatives times the step squared, relative to a slope of tens of joules per radian
    assert slope == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-5)
    gradients = [
        program.derivatives(free + sign * step * direction, duration, none).gradient.copy()
        for sign in (1, -1)
    ]
    bent = line.hessian[:, :-1] @ direction.ravel()
    assert bent == pytest.approx((gradients[0] - gradients[1]) / (2 * step), rel=1e-4, abs=1e-3)


def test_the_solver_keeps_to_the_leeway() -> None:
    """The solver's proposals stay on the plane, within the radius and within the joint limits.

    They need no more energy.
    """
    task = PreparedProblem.of(problem(goal=GOAL))
    space, interval = bspline.uniform(13), duration_intervals(task, GOAL)[0]
    coordinates = Coordinates.joints(START, GOAL, task.arm.active_limits)
    free = START + space.quintic[:, None] * (GOAL - START)
    held = NonlinearProgram(task.kernel, space, interval.p, coordinates, 0.1, 10.0)
    at_rest = solve(held, free[space.free], 2.0)
    T = tcp_pose(GOAL).T
    for pose in (
        ConeOrientedPose(T[:3, 3]),
        ConeOrientedPose(T[:3, 3], [0, 0, 1], T[:3, 2], 0.1),
        ConeOrientedPose.about(Pose(T), [1, 0, 0]),
    ):
        allowed = goal_constraints(task, pose, GOAL, 0.3)
        program = NonlinearProgram(
            task.kernel, space, interval.p, coordinates, 0.1, 10.0, goal_constraints=allowed
        )
        found = solve(program, np.concatenate([at_rest.free, GOAL[None]]), at_rest.duration)
        moved = found.free[-1] - GOAL
        assert found.violation < 1e-4 and found.cost < at_rest.cost
        assert np.abs(moved).max() <= 0.3 + ROUNDING and np.abs(moved).max() > 0.01
        assert (allowed.rows @ moved <= allowed.upper + 1e-8).all()
        assert (allowed.rows @ moved >= allowed.lower - 1e-8).all()
