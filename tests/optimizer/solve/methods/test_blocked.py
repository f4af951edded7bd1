"""Obstacles on the own path of a method: a motion around them, or a result with the collision."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.spatial import KDTree

from joulepath import (
    Box,
    NoCollisionFreeTrajectory,
    Obstacle,
    Problem,
    Scene,
    Sphere,
    optimize,
)
from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.motion import bspline, quintic
from joulepath.optimizer.motion.spline import least_time_scale, retimed, spline_of
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.solve.methods import METHODS, planned_paths, solver_for
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from joulepath.optimizer.solve.methods.planned_paths import (
    PLANNED_PATHS,
    plan,
    smooth_path,
    to_goal,
)
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import (
    MotionOrigin,
    SolveReason,
    SolveResult,
    SolveStatus,
)
from tests.optimizer.moves import ROBOT, problem_with
from tests.selection import long_but

START = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
GOAL = np.array([-1.8, -1.57, 1.57, -1.57, -1.57, 0.0])
DEADLINE = 60.0
# states checked by a planning without a solution; more would only take time
FEW_STATES = 2_000
# distance between a motion and its path, from the fit of a spline and from sampling [rad]
FIT_TOLERANCE = 2e-3
# relative excess over a limit, as of the certificate
LIMIT_TOLERANCE = 1e-6


def placed(x: float, y: float, z: float, yaw: float = 0.0) -> Array:
    T = np.eye(4)
    T[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    T[:3, 3] = x, y, z
    return T


# on the straight line in joint space
POST = Obstacle("post", Sphere(0.06), placed(-0.45, 0.35, 0.5))
# a wall from the base outwards, between start and goal, and beside the upper arm at the goal
WALL = Obstacle(
    "wall",
    Box(np.array([1.23, 0.02, 2.4])),
    placed(-0.8 * 0.8, 0.6 * 0.8, 0.0, np.arctan2(0.6, -0.8)),
    margin=0.0,
)


def blocked(method: MethodName, obstacle: Obstacle) -> Problem:
    return problem_with(START, GOAL, scene=Scene((obstacle,)), method=method, deadline=DEADLINE)


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:
    compile_kernel(ROBOT)


def planned_path(prepared: PreparedProblem) -> Array:
    """The shortest planned path (k, nq) [rad] from START to GOAL."""
    method = solver_for(SolveContext.of(prepared, START, GOAL, Deadline.after(DEADLINE)))
    return to_goal(method, plan(method))[0]


@pytest.mark.parametrize(
    ("method", "states"),
    long_but(
        [(method, FEW_STATES) for method in ("time_scaling", "polynomial_ga")],
        product(METHODS, (FEW_STATES, PLANNED_PATHS.most_states)),
    ),
)
def test_the_error_names_the_colliding_pair(
    method: MethodName, states: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    limited = replace(PLANNED_PATHS, most_states=states)
    monkeypatch.setattr(planned_paths, "PLANNED_PATHS", limited)
    problem = blocked(method, WALL)
    with pytest.raises(NoCollisionFreeTrajectory) as caught:
        optimize(problem)
    assert WALL.name in caught.value.pair and caught.value.depth > 0
    assert all(WALL.name in candidate.reason for candidate in caught.value.candidates)
    result = solver_for(
        SolveContext.of(PreparedProblem.of(problem), START, GOAL, Deadline.after(DEADLINE))
    ).solve()
    assert result.status is SolveStatus.FAILED and result.spline is None
    assert result.collision is not None and WALL.name in result.collision.pair


@pytest.mark.parametrize("method", long_but(("bspline", "uniform_scaling"), METHODS))
def test_every_method_passes_the_post(method: MethodName) -> None:
    solution = optimize(blocked(method, POST))
    assert solution.certificate.valid
    assert (
        solution.certificate.clearance is not None
        and solution.certificate.clearance.min_clearance >= 0
    )
    origins = {
        "time_scaling": MotionOrigin.ALONG_PLANNED_PATH,
        "uniform_scaling": MotionOrigin.ALONG_PLANNED_PATH,
        "polynomial_ga": MotionOrigin.FROM_PLANNED_PATH,
    }
    reason, expected = solution.candidates[0].reason, origins.get(method)
    for origin in (MotionOrigin.ALONG_PLANNED_PATH, MotionOrigin.FROM_PLANNED_PATH):
        assert reason.endswith(origin.value) == (origin is expected)


@pytest.mark.parametrize("limits", [{}, {"duration_min": 2.0, "duration_max": 2.0}])
def test_a_path_from_which_no_solve_leads_has_a_motion_along_it(
    limits: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The answer needs no more energy than the time scaling along the path."""
    failed = SolveResult(SolveStatus.FAILED, SolveReason.NO_COLLISION_FREE_MOTION)
    monkeypatch.setattr(FreeSpline, "along_path", lambda *_: failed)
    monkeypatch.setattr(FreeSpline, "solve", lambda method: method.from_planned_paths(failed))
    monkeypatch.setattr(FreeSpline, "solve_from", lambda *_: failed)
    methods: list[MethodName] = ["time_scaling", "bspline"]
    along, found = (optimize(replace(blocked(each, POST), **limits)) for each in methods)
    assert found.certificate.valid
    assert found.energy.electrical.total <= along.energy.electrical.total * (1 + LIMIT_TOLERANCE)


@pytest.mark.parametrize("method", ["time_scaling", "uniform_scaling"])
def test_a_followed_path_is_the_smooth_one(method: MethodName) -> None:
    """The motion stays on the smooth path, within the error of its spline's fit."""
    prepared = PreparedProblem.of(blocked(method, POST))
    result = solver_for(SolveContext.of(prepared, START, GOAL, Deadline.after(DEADLINE))).solve()
    assert result.spline is not None
    smooth = smooth_path(prepared, planned_path(prepared))
    assert smooth is not None and prepared.surroundings.worst_violation(smooth) is None
    nearby = KDTree(smooth.curve(np.linspace(0.0, 1.0, 20_001)))
    assert (
        nearby.query(result.spline.curve(np.linspace(0.0, result.spline.duration, 400)))[0].max()
        < FIT_TOLERANCE
    )


def test_time_scaling_along_a_path_needs_no_more_energy_than_the_quintic_law() -> None:
    """Exact energies, compared with the quintic law along the path for all feasible durations."""
    prepared = PreparedProblem.of(blocked("time_scaling", POST))
    result = solver_for(SolveContext.of(prepared, START, GOAL, Deadline.after(DEADLINE))).solve()
    smooth = smooth_path(prepared, planned_path(prepared))
    assert result.spline is not None and smooth is not None
    space = bspline.uniform(60)
    tau = np.linspace(0.0, 1.0, 400)
    points = space.fit(smooth.curve(quintic.fraction(tau)), tau)
    unit = spline_of(space, points, 1.0)
    least = least_time_scale(unit, prepared.problem.arm.active_limits.rates)
    energies = [
        prepared.energy(retimed(unit, least * k)).electrical.total
        for k in np.linspace(1.0, 3.0, 41)
    ]
    assert prepared.energy(result.spline).electrical.total < min(energies)


@pytest.mark.parametrize("method", long_but(["time_scaling"], ["time_scaling", "uniform_scaling"]))
def test_limits_along_the_motion_hold_on_a_planned_path(method: MethodName) -> None:
    free = optimize(blocked(method, POST))
    slower = optimize(problem_with(START, GOAL, scene=Scene((POST,)), method=method, tcp_speed=0.4))
    assert (
        slower.certificate.valid
        and slower.certificate.worst_ratio["tcp_speed"] <= 1 + LIMIT_TOLERANCE
    )
    assert slower.trajectory.spline.duration > free.trajectory.spline.duration
    fixed = optimize(
        problem_with(
            START, GOAL, scene=Scene((POST,)), method=method, duration_min=2.5, duration_max=2.5
        )
    )
    assert fixed.certificate.valid and fixed.trajectory.spline.duration == 2.5
