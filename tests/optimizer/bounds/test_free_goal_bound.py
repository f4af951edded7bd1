"""The lower bound for goals with a partly free orientation, against sampled goal configurations."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from joulepath import ConeOrientedPose, Payload, Problem, ToolCone
from joulepath.optimizer.bounds import free_goal_bound
from joulepath.optimizer.bounds.free_goal_bound import POSE_FAMILY, family_bound
from joulepath.optimizer.bounds.lower_bound import lower_bounds
from joulepath.optimizer.bounds.subdivide import SUBDIVISION, SearchLimits
from joulepath.optimizer.kinematics.full_turns import full_turn_alternatives
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for
from joulepath.optimizer.kinematics.orientation_tolerance import sample_orientations, within_cone
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.by_pinocchio import flange
from tests.optimizer.chains import serial_chain
from tests.optimizer.moves import GOAL, HOME, PAYLOAD, ROBOT, TILTED, problem, tcp_pose
from tests.selection import long_but

TOOL = pin.SE3(pin.rpy.rpyToMatrix(0.3, -0.2, 0.9), np.array([0.03, -0.02, 0.15])).homogeneous
CONDITIONS: dict[str, dict[str, Any]] = {
    "bare": {},
    "tool and payload": {"T_flange_tcp": TOOL, "payload": PAYLOAD},
    "tilted": {"gravity": TILTED},
}


def bound_of_samples(task: Problem, pose: ConeOrientedPose, count: int) -> float:
    """The least `lower_bounds` of any branch of many orientations, joints as near to the start as
    full turns allow.
    """
    made, kinematics = PreparedProblem.of(task), inverse_kinematics_for(ROBOT)
    start, limits = np.asarray(task.start), task.arm.active_limits
    choices = [
        full_turn_alternatives(branch.q, limits.q_min, limits.q_max)
        for R in sample_orientations(pose, count)
        for branch in kinematics.branches(
            pose.with_orientation(R).T @ np.linalg.inv(task.arm.T_flange_tcp)
        )
    ]
    q = np.array(
        [
            [
                min(turns, key=lambda angle, at=at: abs(angle - at))
                for turns, at in zip(each, start, strict=True)
            ]
            for each in choices
            if all(each)
        ]
    )
    displacement = q - start
    potential_gain = np.array([made.potential(each) for each in q]) - made.potential(start)
    return float(lower_bounds(made, displacement, potential_gain)[0].min())


@pytest.mark.long
@pytest.mark.parametrize(
    ("half_angle", "condition"),
    [
        pytest.param(half_angle, condition, marks=() if (k + n) % 6 == 0 else pytest.mark.long)
        for k, half_angle in enumerate([0.0, 0.3, np.pi])
        for n, condition in enumerate(CONDITIONS)
    ],
)
def test_the_bound_holds_for_the_whole_family(half_angle: float, condition: str) -> None:
    """The bound is below all sampled configurations at every depth, and rises with depth."""
    rng, given = np.random.default_rng(4), CONDITIONS[condition]
    for _ in range(3):
        start, goal = rng.uniform(-np.pi, np.pi, (2, 6))
        task = problem(start, GOAL, **given)
        T = tcp_pose(goal, given.get("T_flange_tcp")).T
        pose = ConeOrientedPose(T[:3, 3], [0, 0, 1], T[:3, 2], half_angle)
        values = [
            family_bound(PreparedProblem.of(task), pose, start[None], SearchLimits(rounds))
            for rounds in (0, 5, 20)
        ]
        assert values == sorted(values)
        assert values[-1] <= bound_of_samples(task, pose, 150)


@pytest.mark.parametrize("nq", long_but((2, 4, 7), (2, 3, 4, 5, 7)))
@pytest.mark.parametrize("given", [{}, {"objective": "mechanical", "duration_max": 5.0}], ids=str)
def test_the_bound_holds_for_any_chain(nq: int, given: dict[str, Any]) -> None:
    """The bound is below sampled configurations for any chain, also without inner joints."""
    robot, rng = serial_chain(nq), np.random.default_rng(nq)
    for half_angle in (0.0, 0.3, np.pi):
        start, goal = rng.uniform(-3, 3, (2, nq))
        made = PreparedProblem.of(
            problem(start, goal, robot=robot, payload=Payload(mass=0.5), **given)
        )
        T = flange(robot, goal)
        pose = ConeOrientedPose(T[:3, 3], [0, 1, 1], T[:3, :3] @ np.array([0, 1, 1]), half_angle)
        # the chain's ranges are less than a turn
        displacement = goal - start
        gain = np.array([made.potential(goal) - made.potential(start)])
        value = family_bound(made, pose, start[None], SearchLimits(5))
        assert np.isfinite(value) and value <= lower_bounds(made, displacement[None], gain)[0][0]


def test_the_bound_tells_far_from_near() -> None:
    """The bound of a goal across the base is far higher than the bound of a near goal.

    The half turn of the first joint alone needs most of the energy.
    """
    task = problem(HOME, GOAL)
    opposite = tcp_pose(HOME).T[:3, 3] * np.array([-1, -1, 1])
    near, far = (
        family_bound(PreparedProblem.of(task), ConeOrientedPose(p), HOME[None])
        for p in (tcp_pose(HOME).T[:3, 3], opposite)
    )
    assert far > near + 30


@pytest.mark.long
@pytest.mark.parametrize(
    ("most", "alone", "rounds", "rounds_at_goal"),
    long_but(
        [(POSE_FAMILY.most_first_boxes, 2, 20, 10)],
        [
            (most, *given)
            for most in (POSE_FAMILY.most_first_boxes, 8, 1)
            for given in ((2, 20, 10), (4, 30, 30))
        ],
    ),
)
def test_many_starts_are_bounded_together(
    most: int, alone: int, rounds: int, rounds_at_goal: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The bound of many starts is at most the bound of any single start.

    There are more starts than the budget of fine boxes covers at first.
    """
    monkeypatch.setattr(free_goal_bound, "POSE_FAMILY", replace(POSE_FAMILY, most_first_boxes=most))
    rng = np.random.default_rng(6)
    made, pose = PreparedProblem.of(problem(HOME, GOAL)), ConeOrientedPose(tcp_pose(GOAL).T[:3, 3])
    starts = HOME + rng.normal(scale=0.05, size=(4, 6))
    together = family_bound(made, pose, starts, SearchLimits(rounds))
    assert (
        0
        < together
        <= min(
            family_bound(made, pose, start[None], SearchLimits(2 * rounds))
            for start in starts[:alone]
        )
    )
    assert (
        family_bound(made, pose, np.concatenate([starts, GOAL[None]]), SearchLimits(rounds_at_goal))
        == 0
    )


def test_the_rim_of_the_tools_cone_is_covered() -> None:
    cone = ToolCone([0, 0, 1], [0, 0, -1], 0.4)
    made = PreparedProblem.of(problem(HOME, GOAL, tool_cone=cone))
    assert (
        within_cone(made.arm, ConeOrientedPose(tcp_pose(GOAL).T[:3, 3])).half_angle
        == cone.half_angle
    )


@pytest.mark.long
def test_more_boxes_are_halved_where_the_bound_is_far_from_the_energy() -> None:
    """The refinement halves more boxes while the bound is far below the energy.

    Few rounds leave the bound far below; more rounds reach nine tenths. A bound near the energy
    stops the refinement early.
    """
    made = PreparedProblem.of(problem(HOME, GOAL))
    pose = ConeOrientedPose(tcp_pose(GOAL).T[:3, 3])
    few, many = (
        family_bound(made, pose, HOME[None], SearchLimits(rounds))
        for rounds in (SUBDIVISION.early_rounds, SUBDIVISION.rounds)
    )
    assert few < many
    tolerance = SUBDIVISION.tolerance
    limits = SearchLimits(enough=few / (1 - tolerance), tolerance=tolerance)
    assert family_bound(made, pose, HOME[None], limits) == few
    limits = SearchLimits(enough=many / (1 - tolerance), tolerance=tolerance)
    between = family_bound(made, pose, HOME[None], limits)
    assert between >= many * (1 - 1e-9)
