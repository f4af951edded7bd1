"""Poses of arms with fewer than six joints: reachable ones are solved, others are refused."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from joulepath import (
    Arm,
    ConeOrientedPose,
    Cycle,
    NoConfigurationFound,
    OrientationNotHeld,
    PathInfeasible,
    Pose,
    Problem,
    Stop,
    ToolPath,
    UnreachablePose,
    inverse_kinematics,
    optimize,
    plan_cycle,
)
from joulepath.optimizer.kinematics.tcp import tcp_pose
from tests.models.own_arm.arms import robot
from tests.optimizer.few_joints import DESK, description_of
from tests.optimizer.moves import AMPLE
from tests.selection import long_but

HOME = np.array([0.2, -0.4, 0.9, 0.5, 0.3])
THERE = np.array([-0.9, 0.3, 0.6, 0.8, -0.7])
# the axis of the last joint, which turns the tool about it, and a perpendicular one
ROLL = np.array([1.0, 0.0, 0.0])
ACROSS = np.array([0.0, 0.0, 1.0])
# m and rad: residual of a pose, and difference of a configuration found again
ACCURACY = 1e-9
FOUND = 1e-6


@pytest.fixture(scope="module")
def arm() -> Arm:
    return Arm(robot=robot(description_of(DESK)))


def short(count: int) -> Arm:
    return Arm(robot=robot(description_of(DESK[:count])))


def error(arm: Arm, pose: ConeOrientedPose, q: np.ndarray) -> float:
    T = tcp_pose(arm, q)
    tilt = np.linalg.norm(np.cross(T[:3, :3] @ pose.axis, pose.direction))
    off = T[:3, :3] @ pose.axis @ pose.direction < 0
    apart = np.linalg.norm(T[:3, 3] - pose.position)
    return float(max(apart, 0.0 if pose.half_angle else tilt + off))


@pytest.mark.parametrize("axis", [ROLL, ACROSS])
def test_position_and_axis_with_five_joints(arm: Arm, axis: np.ndarray) -> None:
    """Every configuration reaches the pose; the configuration behind the pose is among them."""
    for q in (HOME, THERE):
        pose = ConeOrientedPose.about(Pose(tcp_pose(arm, q)), axis)
        found = inverse_kinematics(arm, pose, windings=False)
        assert max(error(arm, pose, each.q) for each in found) < ACCURACY
        turned = np.array([each.q - q for each in found])
        # the last joint alone turns the tool about its own axis
        held = turned[:, :4] if axis is ROLL else turned
        assert np.abs(held).max(axis=1).min() < FOUND
        assert {each.free for each in found} == {("joint_4",) if axis is ROLL else ()}
        assert not found.complete


def test_position_alone_frees_what_the_joints_can_do(arm: Arm) -> None:
    for count, freedom in ((3, 0), (4, 3), (5, 4)):
        each = short(count)
        pose = ConeOrientedPose(tcp_pose(each, HOME[:count])[:3, 3])
        found = inverse_kinematics(each, pose)
        assert max(error(each, pose, one.q) for one in found) < ACCURACY
        assert min(len(one.free) for one in found) >= freedom
        assert all(one.q.min() >= -2.9 and one.q.max() <= 2.9 for one in found)


def test_a_path_out_of_the_plane_of_the_joints_names_what_is_possible(arm: Arm) -> None:
    """Sideways, the arm would have to turn its tool about the vertical."""
    start = tcp_pose(arm, HOME)
    for direction, is_followed in (
        ([np.cos(HOME[0]), np.sin(HOME[0]), 0.0], True),
        ([0, 1, 0], False),
    ):
        goal = start.copy()
        goal[:3, 3] -= 0.05 * np.array(direction)
        problem = Problem(arm=arm, start=HOME, goal=Pose(goal), tool_path=ToolPath())
        if is_followed:
            assert optimize(problem, progress=False).certificate.valid
        else:
            with pytest.raises(PathInfeasible, match="fewer than six joints"):
                optimize(problem, progress=False)


def test_a_full_pose_that_the_arm_holds(arm: Arm) -> None:
    """The position is rounded, as on the display of a palletiser or desk arm."""
    T = tcp_pose(arm, THERE)
    T[:3, 3] = T[:3, 3].round(7)
    found = inverse_kinematics(arm, Pose(T))
    assert min(np.abs(each.q - THERE).max() for each in found) < 1e-4
    assert not found.complete
    answer = optimize(Problem(arm=arm, start=HOME, goal=Pose(T)))
    assert answer.certificate.valid and 0 < answer.lower_bound <= answer.energy.electrical.total


def test_a_full_pose_that_no_joints_hold(arm: Arm) -> None:
    T = tcp_pose(arm, THERE)
    turned = Pose.from_rpy(T[:3, 3], [1.0, 0.4, 2.0])
    for ask in (
        lambda: inverse_kinematics(arm, turned),
        lambda: optimize(Problem(arm=arm, start=HOME, goal=turned)),
    ):
        with pytest.raises(OrientationNotHeld, match='"orientation": "free"') as caught:
            ask()
        assert caught.value.joints == 5 and isinstance(caught.value, NoConfigurationFound)


@pytest.mark.parametrize("target", [Pose, lambda T: ConeOrientedPose(T[:3, 3])])
def test_beyond_the_arm(arm: Arm, target: type[Pose]) -> None:
    T = np.eye(4)
    T[:3, 3] = [2.0, 0.0, 0.0]
    with pytest.raises(UnreachablePose, match="beyond the stretched arm"):
        inverse_kinematics(arm, target(T))


def test_a_position_within_the_length_that_is_not_reached(arm: Arm) -> None:
    """On the first axis, nearer than the links allow with so little room in the joints."""
    with pytest.raises(NoConfigurationFound, match="No arm configuration"):
        inverse_kinematics(short(2), ConeOrientedPose([0.05, 0.05, 0.05]))


@pytest.mark.parametrize(
    ("kind", "count"),
    long_but(
        [("free", 1), ("about", 3), ("free", 5)],
        product(("free", "about"), range(1, 6)),
    ),
)
def test_motions_to_poses_are_certified_with_a_bound(kind: str, count: int) -> None:
    arm = short(count)
    T = tcp_pose(arm, THERE[:count])
    axis = ConeOrientedPose.about(Pose(T), ROLL)
    goal = axis if kind == "about" else ConeOrientedPose(T[:3, 3])
    answer = optimize(Problem(arm=arm, start=HOME[:count], goal=goal))
    assert answer.certificate.valid and error(arm, goal, answer.goal.q) < FOUND
    assert 0 < answer.lower_bound <= answer.energy.electrical.total


@pytest.mark.parametrize("kind", long_but(["pose"], ["free", "about", "pose"]))
def test_a_cycle_through_poses(arm: Arm, kind: str) -> None:
    there, home = (Pose(tcp_pose(arm, q)) for q in (THERE, 0.5 * (HOME + THERE)))
    targets = {
        "free": [ConeOrientedPose(each.T[:3, 3]) for each in (there, home)],
        "about": [ConeOrientedPose.about(each, ROLL) for each in (there, home)],
        "pose": [there, home],
    }[kind]
    stops = [Stop(name=f"stop_{k}", target=each) for k, each in enumerate(targets)]
    found = plan_cycle(Cycle(arm=arm, start=HOME, stops=stops, windings=False, deadline=AMPLE))
    assert all(move.solution.certificate.valid for move in found.moves)
    assert 0 < found.lower_bound <= found.energies.of("electrical")
    assert found.status == "feasible" and not found.complete
