"""Clearance constraints: distance of motions to obstacles, cost, and gradients."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath import Box, Obstacle, Problem, Scene, Solution, Sphere, ToolCone, optimize
from joulepath.optimizer.collision.clearance_constraint import (
    CLEARANCE_CONSTRAINT,
    ClearanceConstraint,
)
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.deadline import NEVER
from joulepath.optimizer.kinematics.forward import joint_placements
from joulepath.optimizer.kinematics.path_constraints import PathConstraints
from joulepath.optimizer.motion.spline import sample
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from joulepath.optimizer.solve.methods.limit_repair import LIMIT_REPAIR
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from joulepath.optimizer.solve.nlp.working_set_qp import WORKING_SET
from tests.optimizer.moves import ROBOT, fixed, problem_with
from tests.optimizer.placement.cells import at

HOME = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
GOAL = np.array([1.8, -1.1, 1.9, -2.4, -1.57, 0.4])
# point of the flange on the motion from HOME to GOAL without obstacles [m]
WAYPOINT = np.array([0.0, -0.57, 0.27])
# tolerance of replayed distances [m]
REPLAY = 1e-4
# step of joint positions in differences of distances, smooth in this range [rad]
EPS = 1e-6
# relative tolerance of gradients
GRADIENT_TOLERANCE = 1e-4
# least used share of an active limit, due to the margins of the solver
USED = 0.999
# the same after peaks between the path points were repaired by one and a half times their excess
USED_AFTER_REPAIR = 0.997
# ratio of a clearance with exact values above
COUNTED_SHARE = (
    1
    - (CLEARANCE_CONSTRAINT.gradient_distance - CLEARANCE_CONSTRAINT.reserve)
    / CLEARANCE_CONSTRAINT.ratio_range
)
# relative tolerance of energies of one motion solved twice
SAME_ENERGY = 1e-3


def low_post(margin: float = 0.0) -> Obstacle:
    shape = Box(np.array([0.08, 0.08, 0.25]))
    return Obstacle("post", shape, at(WAYPOINT[0], WAYPOINT[1], 0.125), margin)


POST = Scene((low_post(),))
Fields = dict[str, Any]


def solved(*obstacles: Obstacle, **given: Any) -> Solution:
    return optimize(problem_with(HOME, GOAL, windings=False, scene=Scene(obstacles), **given))


def least_distance(solution: Solution, *obstacles: Obstacle) -> float:
    model = CollisionModel(problem_with(HOME, GOAL, scene=Scene(obstacles)).arm)
    q = sample(solution.trajectory.spline, np.arange(0.0, solution.duration, REPLAY))[0]
    return model.least_distance(q, np.inf)


def test_a_post_in_the_way_is_passed() -> None:
    free = solved()
    assert least_distance(free, low_post()) < 0
    around = solved(low_post())
    assert (
        around.certificate.clearance is not None and around.certificate.clearance.min_clearance >= 0
    )
    assert "post" in around.certificate.clearance.pair
    assert least_distance(around, low_post()) >= around.certificate.clearance.min_clearance
    assert around.energy.electrical.total > free.energy.electrical.total


def test_what_is_far_away_changes_nothing() -> None:
    ball = Obstacle("ball", Sphere(0.1), at(-0.5, 0.8, 1.2))
    with_ball, without = (
        solved(ball).energy.electrical.total,
        solved(collisions=False).energy.electrical.total,
    )
    assert with_ball == pytest.approx(without, rel=SAME_ENERGY)


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({}, SolveReason.PROMISES_NO_LESS),
        ({"objective": "mechanical"} | fixed(2.0), SolveReason.COLLIDES_AND_COSTS_MORE),
    ],  # no promise is made of work
    ids=["electrical", "mechanical"],
)
def test_a_colliding_motion_that_needs_more_energy_than_a_known_one_is_pruned(
    given: Fields, reason: SolveReason
) -> None:
    task, empty = (
        PreparedProblem.of(problem_with(HOME, GOAL, scene=scene, **given))
        for scene in (POST, Scene())
    )

    def attempt(on: PreparedProblem, incumbent_cost: float) -> SolveResult:
        context = SolveContext.of(on, HOME, GOAL, NEVER)
        return FreeSpline(replace(context, incumbent_cost=incumbent_cost)).solve()

    through = attempt(empty, np.inf).spline
    assert through is not None
    free = empty.cost_of(through)
    assert attempt(task, np.inf).status is attempt(task, 1.2 * free).status is SolveStatus.SOLVED
    pruned = attempt(task, 0.95 * free)
    assert (pruned.status, pruned.reason, pruned.spline) == (SolveStatus.PRUNED, reason, None)


def every_pair(model: CollisionModel) -> PathConstraints:
    return PathConstraints(
        joint_placements(ROBOT.model), [ClearanceConstraint(model, np.arange(len(model.pairs)))]
    )


def test_gradients_of_the_shares_are_those_of_finite_differences() -> None:
    problem = problem_with(
        HOME, GOAL, scene=Scene((low_post(), Obstacle("ball", Sphere(0.1), at(0.3, -0.3, 0.4))))
    )
    path = every_pair(CollisionModel(problem.arm))
    q = np.linspace(HOME, GOAL, 25)
    v = np.zeros_like(q)
    found = path.linearised(q, v)
    near = (found.value > COUNTED_SHARE) & (
        found.value < 1 + 0.01 / CLEARANCE_CONSTRAINT.ratio_range
    )
    assert near.sum() > 10
    for j in range(6):
        d = EPS * np.eye(6)[j]
        by_q = (path.linearised(q + d, v).value - path.linearised(q - d, v).value) / (2 * EPS)
        np.testing.assert_allclose(
            found.by_q[near][:, j],
            by_q[near],
            atol=GRADIENT_TOLERANCE / CLEARANCE_CONSTRAINT.ratio_range,
        )


def test_a_share_is_one_a_reserve_beyond_the_margin() -> None:
    model = CollisionModel(problem_with(HOME, GOAL, scene=Scene((low_post(),))).arm)
    q = np.linspace(HOME, GOAL, 100)
    expected = (
        1
        - (model.signed_distances(q)[0] - CLEARANCE_CONSTRAINT.reserve)
        / CLEARANCE_CONSTRAINT.ratio_range
    )
    path, v = every_pair(model), np.zeros_like(q)
    for shares, counted, low in (
        (path.linearised(q, v).value, COUNTED_SHARE, WORKING_SET.near_path),
        (path.ratios(q, v), CLEARANCE_CONSTRAINT.exact_ratio, 1 - LIMIT_REPAIR.tightening),
    ):
        near = expected > counted
        assert 2 < near.sum() < near.size
        np.testing.assert_allclose(shares[near], expected[near])
        # the others have a lower bound alone, too low to become active
        assert (shares[~near] < low).all() and (shares >= expected - 1e-12).all()


@pytest.mark.parametrize("given", [{"tcp_speed": 0.5}, {"elbow_speed": 0.2}])
def test_a_limited_speed_is_used_and_held(given: dict[str, float]) -> None:
    free, limited = solved(), solved(**given)
    (name,) = given
    assert USED < limited.certificate.worst_ratio[name] <= 1
    assert limited.energy.electrical.total > free.energy.electrical.total


def test_a_wide_cone_changes_nothing_and_a_narrow_one_binds() -> None:
    # at both ends the tool points straight down: the three parallel joints add up to the same
    goal = np.array([1.8, -0.6, 2.2, -3.17, -1.57, 0.4])

    def upright(half_angle: float) -> Problem:
        cone = ToolCone(np.array([0.0, 0, 1]), np.array([0.0, 0, -1]), half_angle)
        return problem_with(HOME, goal, windings=False, tool_cone=cone)

    free = optimize(problem_with(HOME, goal, windings=False))
    path = PreparedProblem.of(upright(1.0)).path
    assert path is not None
    q, v, _ = sample(free.trajectory.spline, np.linspace(0, free.duration, 400))
    tilt = float(path.ratios(q, v).max())
    wide, narrow = optimize(upright(1.5 * tilt)), optimize(upright(0.4 * tilt))
    assert wide.energy.electrical.total == pytest.approx(
        free.energy.electrical.total, rel=SAME_ENERGY
    )
    assert USED_AFTER_REPAIR < narrow.certificate.worst_ratio["tool_cone"] <= 1
    assert narrow.energy.electrical.total > free.energy.electrical.total
