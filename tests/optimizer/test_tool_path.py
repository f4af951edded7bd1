"""Motions along a path of the tool: on the path by Pinocchio's kinematics, and in its order."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from joulepath import (
    AnyOf,
    Arm,
    Box,
    NoCollisionFreeTrajectory,
    NoTrajectory,
    Obstacle,
    PathInfeasible,
    Pose,
    Problem,
    Scene,
    Solution,
    ToolPath,
    load_robot,
    optimize,
)
from joulepath.optimizer.certificate import certify
from joulepath.optimizer.kinematics.tcp import tcp_pose as pose_of
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from tests.optimizer.moves import AMPLE, ROBOT, limits, tcp_pose
from tests.optimizer.tool_paths import ARM, HOME, along, moved, poses_of
from tests.refusals import refusal_of
from tests.selection import long_but

# rounding of distances [m, rad]
ROUNDING = 1e-9
QUARTER = Rotation.from_rotvec([0.0, 0.0, np.pi / 2])


LINES = {
    "down": ([0.0, 0.0, -0.1], None),
    "aside": ([0.0, 0.5, 0.0], None),
    "with a turn": ([-0.1, 0.2, 0.1], QUARTER),
    "a turn in place": ([0.0, 0.0, 0.0], QUARTER),
    "a millimetre": ([0.001, 0.0, 0.0], None),
}


@pytest.mark.parametrize("name", long_but(("with a turn",), LINES))
def test_the_tool_is_on_the_line(name: str) -> None:
    """The definition of a line is the reference, independent of the course's own measure."""
    goal = moved(*LINES[name])
    found = optimize(along(goal))
    assert found.certificate.valid and found.lower_bound <= found.energy.electrical.total
    T, (T_start, T_goal) = poses_of(found), (tcp_pose(HOME).T, goal.T)
    shift, turn = (
        T_goal[:3, 3] - T_start[:3, 3],
        Rotation.from_matrix(T_goal[:3, :3] @ T_start[:3, :3].T).as_rotvec(),
    )
    share = (T[:, :3, 3] - T_start[:3, 3]) @ shift / (shift @ shift) if shift.any() else None
    angles = (
        Rotation.from_matrix(T[:, :3, :3]) * Rotation.from_matrix(T_start[:3, :3]).inv()
    ).as_rotvec()
    if share is None:
        share = angles @ turn / (turn @ turn)
    off = np.linalg.norm(T[:, :3, 3] - T_start[:3, 3] - share[:, None] * shift, axis=1)
    assert off.max() < ToolPath().position_tolerance
    assert (
        np.linalg.norm(angles - share[:, None] * turn, axis=1).max() < ToolPath().rotation_tolerance
    )
    assert share[0] == pytest.approx(0.0, abs=1e-6) and share[-1] == pytest.approx(1.0, abs=1e-6)
    assert (np.diff(share) > -1e-6).all()


def test_a_corner_is_rounded_within_its_blend() -> None:
    corner, goal = moved([0.0, 0.2, 0.0]), moved([0.0, 0.2, -0.15])
    path = ToolPath(via=[corner], blend=0.03)
    found = optimize(along(goal, path=path))
    position, rotation = ToolCourse.of(path, tcp_pose(HOME).T, goal.T).deviation(poses_of(found))
    assert found.certificate.valid
    assert position.max() < path.position_tolerance and rotation.max() < path.rotation_tolerance
    gap = np.linalg.norm(poses_of(found)[:, :3, 3] - corner.T[:3, 3], axis=1).min()
    assert 0.001 < gap < path.blend
    own = found.energy.electrical.total
    for each in found.baselines:
        assert each.within_limits and own < each.electrical, "slow in the corner, fast beside it"


def test_an_arc_is_part_of_a_circle() -> None:
    """Three quarters of a circle of 80 mm, upright; the tool keeps its orientation."""
    radius, centre = 0.08, tcp_pose(HOME).T[:3, 3] + [0.0, 0.08, 0.0]
    via, goal = (
        moved([0.0, radius * (1 + np.sqrt(0.5)), radius * np.sqrt(0.5)]),
        moved([0.0, radius, -radius]),
    )
    found = optimize(along(goal, path=ToolPath(shape="arc", via=[via])))
    assert found.certificate.valid
    T = poses_of(found)
    away = T[:, :3, 3] - centre
    assert np.abs(np.linalg.norm(away, axis=1) - radius).max() < ToolPath().position_tolerance
    assert np.abs(away[:, 0]).max() < ToolPath().position_tolerance, "in its plane"
    angle = np.unwrap(np.arctan2(away[:, 2], -away[:, 1]))
    assert angle[-1] - angle[0] == pytest.approx(1.5 * np.pi, abs=1e-3), (
        "the long way, over the pose between"
    )
    assert (np.diff(angle) > -1e-6).all()


@pytest.mark.long
def test_a_recorded_curve_goes_through_every_pose() -> None:
    """A narrowing spiral of one and a half turns, given by 100 poses, while the tool turns by 0.6
    rad.
    """
    share = np.linspace(0.0, 1.0, 102)[1:]
    angle, radius = 3 * np.pi * share, 0.1 - 0.05 * share
    position = np.stack(
        [-0.1 * share, radius * np.sin(angle), 0.1 - radius * np.cos(angle)], axis=1
    )
    poses = [
        moved(x, Rotation.from_rotvec([0.0, 0.0, 0.6 * u]))
        for x, u in zip(position, share, strict=True)
    ]
    found = optimize(along(poses[-1], path=ToolPath(shape="curve", via=poses[:-1])))
    assert found.certificate.valid
    T = poses_of(found, 20000)
    for pose in poses:
        near = np.linalg.norm(T[:, :3, 3] - pose.T[:3, 3], axis=1).argmin()
        assert np.linalg.norm(T[near, :3, 3] - pose.T[:3, 3]) < 1.5e-4
        turned = Rotation.from_matrix(T[near, :3, :3] @ pose.T[:3, :3].T).magnitude()
        assert turned < 5e-3


def test_three_poses_on_a_line_are_no_arc() -> None:
    for aside in (0.0, 1e-9, 1e-5):
        path = ToolPath(shape="arc", via=[moved([0.0, 0.1, aside])])
        with refusal_of("path.via.0"):
            optimize(along(moved([0.0, 0.2, 0.0]), path=path))


def test_a_pose_finds_the_best_branch() -> None:
    start, goal = moved([0.0, 0.0, 0.0]), moved([0.0, 0.0, -0.1])
    found, given = optimize(along(goal, start)), optimize(along(goal))
    assert found.status == "optimal" and len(found.candidates) > 1
    assert found.energy.electrical.total <= given.energy.electrical.total * (1 + ROUNDING)


def test_the_speed_of_the_tool_is_kept() -> None:
    slow = optimize(along(moved([0.0, 0.3, 0.0]), arm=ARM.no_faster_than(0.2)))
    assert slow.certificate.valid and slow.certificate.worst_ratio["tcp_speed"] > 0.99
    assert slow.trajectory.spline.duration > 0.3 / 0.2


CORNERED = ToolPath(via=[moved([0.0, 0.2, 0.0])], blend=0.04, least_speed=0.19, ramp=0.03)


def cornered(**given: Any) -> Problem:
    """A line, a rounded corner and a line, with a nearly even TCP speed."""
    return along(
        moved([0.0, 0.2, -0.15]), **{"arm": ARM.no_faster_than(0.2), "path": CORNERED} | given
    )


def speeds_of(found: Solution, count: int = 4000) -> tuple[float, float, float]:
    """Greatest TCP speed [m/s], the least one between the ramps, and the speed at the start, from
    positions.
    """
    steps = np.linalg.norm(np.diff(poses_of(found, count)[:, :3, 3], axis=0), axis=1)
    speed, gone = steps * (count - 1) / found.trajectory.spline.duration, np.cumsum(steps)
    between = (gone > CORNERED.ramp) & (gone < gone[-1] - CORNERED.ramp)
    return float(speed.max()), float(speed[between].min()), float(speed[0])


@pytest.mark.long
def test_the_tool_is_no_slower_than_asked_between_the_ramps() -> None:
    found = optimize(cornered())
    most, least, first = speeds_of(found)
    assert (
        found.certificate.valid
        and 0.19 * (1 - 1e-6) < least < most < 0.2 * (1 + 1e-6)
        and first < 0.02
    )
    for each in found.baselines:
        assert each.saving is None and each.reason is not None and "path speed" in each.reason


def test_the_certificate_finds_a_motion_that_is_too_slow() -> None:
    free = cornered(path=replace(CORNERED, least_speed=None), arm=ARM)
    found = optimize(free)
    slowest = speeds_of(found)[1]
    for share in (0.9, 1.1):
        asked = replace(free, tool_path=replace(CORNERED, least_speed=share * slowest))
        certificate = certify(
            asked, found.trajectory.spline, found.start.q, found.goal.q, found.energy
        )
        assert certificate.worst_ratio["path_speed"] == pytest.approx(share, rel=2e-2)
        assert certificate.valid == (share < 1)


def test_a_least_speed_that_no_motion_keeps_says_so() -> None:
    fast = replace(CORNERED, least_speed=2.0)
    with pytest.raises(NoTrajectory) as refusal:
        optimize(cornered(arm=ARM, path=fast))
    (candidate,) = refusal.value.candidates
    assert "path.speed.min" in candidate.reason and "% of the path" in candidate.reason


def test_a_given_duration_is_met() -> None:
    found = optimize(along(moved([0.0, 0.3, 0.0]), duration_min=1.7, duration_max=1.7))
    assert found.trajectory.spline.duration == pytest.approx(1.7) and found.certificate.valid


def test_seven_joints_follow_a_line() -> None:
    arm = Arm(robot=load_robot("panda"), collisions=False)
    start = np.array([0.0, -0.3, 0.1, -2.0, 0.0, 1.8, 0.7])
    goal = pose_of(arm, start).copy()
    goal[:3, 3] += [0.0, 0.2, -0.1]
    found = optimize(
        Problem(arm=arm, start=start, goal=Pose(goal), tool_path=ToolPath(), deadline=AMPLE)
    )
    assert found.certificate.valid and found.certificate.worst_ratio["path_position"] < 1


def test_a_joint_range_in_the_way_is_named() -> None:
    bounds = limits(q_min=HOME - 0.3, q_max=HOME + 0.3)
    with pytest.raises(PathInfeasible) as refusal:
        optimize(along(moved([0.0, 0.4, 0.0]), arm=replace(ARM, limits=bounds)))
    assert [each.reason for each in refusal.value.attempts] == ["outside_limits"]
    assert 0 < refusal.value.attempts[0].followed < 1


def test_an_obstacle_on_the_line_is_hit() -> None:
    at = moved([0.0, 0.25, 0.0]).T[:3, 3]
    block = Obstacle("block", Box(np.array([0.05, 0.05, 0.3])), Pose.from_rotation(at, np.eye(3)).T)
    with pytest.raises(NoCollisionFreeTrajectory) as refusal:
        optimize(along(moved([0.0, 0.5, 0.0]), arm=Arm(robot=ROBOT, scene=Scene([block]))))
    assert "block" in refusal.value.pair


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"path": ToolPath(), "start": tcp_pose(HOME)}, "path"),
        ({"path": ToolPath(via=[moved([0.0, 0.2, 0.0])] * 2, blend=0.01)}, "path.via.1"),
        ({"path": ToolPath(via=[moved([0.0, 0.01, 0.0])], blend=0.05)}, "path.via.0"),
        ({"path": ToolPath(least_speed=0.1, ramp=0.15)}, "path.speed.ramp"),
        ({"path": ToolPath(least_speed=0.1), "arm": ARM.no_faster_than(0.101)}, "path.speed.min"),
        ({"start": AnyOf((HOME,))}, "start"),
    ],
    ids=[
        "no way",
        "a pose twice",
        "too near for the blend",
        "all ramps",
        "no freedom",
        "several targets",
    ],
)
def test_a_path_that_is_none_names_its_field(given: dict[str, Any], field: str) -> None:
    goal = tcp_pose(HOME) if field == "path" else moved([0.0, 0.2, 0.1])
    with refusal_of(field):
        optimize(along(goal, **given))


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"via": [moved([0.0, 0.2, 0.0])]}, "path.blend"),
        ({"blend": -1.0}, "path.blend"),
        ({"shape": "arc"}, "path.via"),
        ({"shape": "circle"}, "path.shape"),
        ({"shape": "curve", "blend": 0.01}, "path.blend"),
        ({"shape": "arc", "via": [moved([0.0, 0.2, 0.0])] * 2}, "path.via"),
        ({"position_tolerance": 1e-7}, "path.tolerance.position"),
        ({"rotation_tolerance": np.nan}, "path.tolerance.rotation"),
        ({"least_speed": 0.0}, "path.speed.min"),
        ({"least_speed": np.nan}, "path.speed.min"),
        ({"ramp": 0.0}, "path.speed.ramp"),
    ],
    ids=str,
)
def test_a_wrong_path_names_its_field(given: dict[str, Any], field: str) -> None:
    with refusal_of(field):
        ToolPath(**given)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(50))
def test_random_lines_are_followed_or_refused(seed: int) -> None:
    rng = np.random.default_rng(seed)
    q = HOME + rng.uniform(-0.8, 0.8, 6)
    T = tcp_pose(q).T.copy()
    T[:3, 3] += rng.uniform(-0.3, 0.3, 3)
    T[:3, :3] = Rotation.from_rotvec(rng.uniform(-0.5, 0.5, 3)).as_matrix() @ T[:3, :3]
    try:
        found = optimize(along(Pose(T), q))
    except PathInfeasible:
        return
    assert found.certificate.valid
    assert (
        found.certificate.worst_ratio["path_position"] <= 1
        and found.certificate.worst_ratio["path_rotation"] <= 1
    )


@pytest.mark.parametrize("duration", long_but([60.0], [20.0, 60.0, 300.0]))
def test_a_slow_motion_keeps_to_the_path(duration: float) -> None:
    """At low speeds the energy hardly depends on the timing, and the optimal timing is uneven."""
    found = optimize(
        along(moved([0.0, 0.3, -0.1]), duration_min=duration, duration_max=1.2 * duration)
    )
    assert found.certificate.valid and found.certificate.worst_ratio["path_position"] <= 1


def test_a_given_goal_is_met_in_its_own_turns() -> None:
    goal = optimize(along(moved([0.0, 0.2, 0.0]))).goal.q
    for turns in ([0, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, -1], [0, 0, 0, -1, 1, 0]):
        there = goal + 2 * np.pi * np.array(turns)
        if (np.abs(there) < 2 * np.pi).all():
            found = optimize(along(there, moved([0.0, 0.0, 0.0])))
            assert found.certificate.valid and (found.goal.q == there).all()


@pytest.mark.long
@pytest.mark.parametrize("seed", long_but([0], range(10)))
def test_the_bound_holds_for_starts_that_were_not_sampled(seed: int) -> None:
    """Seven joints: every posture at the start leads along the path to another one at its end."""
    arm, rng = Arm(robot=load_robot("panda"), collisions=False), np.random.default_rng(seed)
    q = np.array([0.0, -0.3, 0.1, -2.0, 0.0, 1.8, 0.7]) + rng.uniform(-0.3, 0.3, 7)
    T = pose_of(arm, q)
    goal = T.copy()
    goal[:3, 3] += rng.uniform(-0.15, 0.15, 3)
    path = {"arm": arm, "goal": Pose(goal), "tool_path": ToolPath()}
    found = optimize(Problem(start=Pose(T), deadline=AMPLE, **path))
    assert found.status == "feasible"
    given = optimize(Problem(start=q, deadline=AMPLE, **path))
    assert found.lower_bound <= given.energy.electrical.total
    assert found.lower_bound <= found.energy.electrical.total
