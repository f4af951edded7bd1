"""Poses in ROS's `base_link` give the same problem as the same poses in `base`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import airo_models
import numpy as np
import pinocchio as pin
import pytest
from fastapi.testclient import TestClient

from joulepath import AnyOf, Arm, ConeOrientedPose, Pose, load_robot, robot_names
from joulepath.app.api.cycle.problem import to_cycle
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.ik.task import IKRequest, to_ik_arm
from joulepath.app.convert.request import to_problem
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.models.own_arm.description import Description
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.tcp import tcp_pose
from tests.models.own_arm.arms import robot

# sin π is not 0 in floating point
EXACT = 1e-15
# lengths of a metre by sums of some ten products
CHAIN = 1e-9
HALF_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])
QUATERNION = [0.6, 0.0, 0.0, 0.8]


def third_party() -> str:
    return (Path(airo_models.__file__).parent / "arms/ur5e/ur5e.urdf").read_text()


def in_ros(position: list[float]) -> dict[str, Any]:
    """A pose in `base_link` with its TCP at `position` of `base`, turned by QUATERNION."""
    x, y, z = position
    turned = pin.Quaternion(np.array(QUATERNION)).matrix()
    back = pin.Quaternion(HALF_TURN[:3, :3] @ turned)
    return {"position": [-x, -y, z], "quaternion": back.coeffs().tolist(), "frame": "base_link"}


def in_base(position: list[float]) -> dict[str, Any]:
    return {"position": position, "quaternion": QUATERNION}


def test_base_and_base_link_of_the_ur5e_are_those_of_a_description_that_others_wrote() -> None:
    model = pin.buildModelFromXML(third_party())
    data, ours = model.createData(), load_robot("ur5e")
    for q in np.random.default_rng(4).uniform(-3, 3, (20, 6)):
        pin.framesForwardKinematics(model, data, q)
        base, base_link, tool = (
            data.oMf[model.getFrameId(name)] for name in ("base", "base_link", "tool0")
        )
        assert np.abs(base.actInv(base_link).homogeneous - ours.T_base_base_link).max() < CHAIN
        flange = tcp_pose(Arm(robot=ours), q)
        assert np.abs(base.actInv(tool).homogeneous - flange).max() < CHAIN


def test_an_own_arm_has_the_base_link_of_its_description() -> None:
    description = Description(urdf=third_party(), tip="tool0", acceleration=8.0, payload=2.0)
    rooted, based = (
        robot(description),
        robot(Description(**{**vars(description), "base": "base_link_inertia"})),
    )
    assert np.array_equal(rooted.T_base_base_link, np.eye(4))
    assert np.abs(based.T_base_base_link - HALF_TURN).max() < CHAIN


def test_only_robots_of_universal_robots_turn_it() -> None:
    turned = {
        name
        for name in robot_names()
        if not np.array_equal(load_robot(name).T_base_base_link, np.eye(4))
    }
    assert turned == {name for name in robot_names() if name.startswith("ur")}
    for name in turned:
        assert np.abs(load_robot(name).T_base_base_link - HALF_TURN).max() < EXACT


def poses_of(target: object) -> list[Array]:
    if isinstance(target, Pose):
        return [target.T]
    if isinstance(target, ConeOrientedPose):
        return [target.position, target.direction, target.axis]
    assert isinstance(target, AnyOf)
    return [T for member in target.targets for T in poses_of(member)]


@pytest.mark.parametrize(
    ("ros", "base"),
    [
        (in_ros([0.4, -0.2, 0.3]), in_base([0.4, -0.2, 0.3])),
        (
            {"position": [-0.4, 0.2, 0.3], "rotvec": [0.0, 0.0, np.pi], "frame": "base_link"},
            {"position": [0.4, -0.2, 0.3], "rotvec": [0.0, 0.0, 0.0], "frame": "base"},
        ),
        (
            {"position": [-0.4, 0.2, 0.3], "orientation": "free", "frame": "base_link"},
            {"position": [0.4, -0.2, 0.3], "orientation": "free"},
        ),
        (
            {
                "position": [-0.4, 0.2, 0.3],
                "frame": "base_link",
                "orientation": {
                    "cone": {"axis": [0, 0, 1], "direction": [1, 0, -1], "half_angle": 0.3}
                },
            },
            {
                "position": [0.4, -0.2, 0.3],
                "orientation": {
                    "cone": {"axis": [0, 0, 1], "direction": [-1, 0, -1], "half_angle": 0.3}
                },
            },
        ),
        (
            {
                "position": [-0.4, 0.2, 0.3],
                "frame": "base_link",
                "orientation": {"free_about": [0, 0, 1], "rpy": [0.3, 1.2, np.pi]},
            },
            {
                "position": [0.4, -0.2, 0.3],
                "orientation": {"free_about": [0, 0, 1], "rpy": [0.3, 1.2, 0.0]},
            },
        ),
    ],
    ids=["quaternion", "rotvec", "free", "cone", "free about"],
)
def test_a_target_in_either_frame_is_the_same(ros: dict[str, Any], base: dict[str, Any]) -> None:
    first, second = (
        to_problem(
            OptimizeRequest.model_validate({"start": {"q": [0.0] * 6}, "goal": goal}), 10.0
        ).goal
        for goal in ({"any_of": [{"pose": ros}]}, {"any_of": [{"pose": base}]})
    )
    for mine, other in zip(poses_of(first), poses_of(second), strict=True):
        assert np.abs(mine - other).max() < 4 * EXACT


def test_obstacles_path_tool_cone_and_lines_follow_their_frames() -> None:
    shape = {"name": "post", "shape": "sphere", "radius": 0.1}
    cone = {"axis": [0, 0, 1], "half_angle": 0.5}
    via = [0.3, 0.1, 0.4]
    request = {"start": {"q": [0.0] * 6}, "goal": {"pose": in_base([0.4, -0.2, 0.3])}}
    ros, base = (
        to_problem(OptimizeRequest.model_validate(request | each), 10.0)
        for each in (
            {
                "scene": {
                    "frame": "base_link",
                    "obstacles": [shape | {"pose": _bare(in_ros(via))}],
                },
                "path": {"via": [in_ros(via)], "blend": 0.01},
                "tool_cone": cone | {"direction": [1, 2, 3], "frame": "base_link"},
            },
            {
                "scene": {"obstacles": [shape | {"pose": in_base(via)}]},
                "path": {"via": [in_base(via)], "blend": 0.01},
                "tool_cone": cone | {"direction": [-1, -2, 3]},
            },
        )
    )
    assert (
        ros.tool_path is not None
        and base.tool_path is not None
        and ros.arm.tool_cone
        and base.arm.tool_cone
    )
    pairs = (
        (ros.arm.scene.obstacles[0].T_base_shape, base.arm.scene.obstacles[0].T_base_shape),
        (ros.tool_path.via[0].T, base.tool_path.via[0].T),
        (ros.arm.tool_cone.direction, base.arm.tool_cone.direction),
    )
    for mine, other in pairs:
        assert np.abs(mine - other).max() < 4 * EXACT

    cell = {
        "pose": in_base(via),
        "scene": {"frame": "base_link", "obstacles": [shape | {"pose": _bare(in_ros(via))}]},
    }
    arm = to_ik_arm(IKRequest.model_validate(cell), load_robot("ur5e"))
    assert (
        np.abs(arm.scene.obstacles[0].T_base_shape - base.arm.scene.obstacles[0].T_base_shape).max()
        < 4 * EXACT
    )

    stops = [
        {
            "target": {"pose": in_ros(via)},
            "approach": {"direction": [1, 2, 3], "frame": "base_link", "distance": 0.1},
        },
        {
            "target": {"pose": in_base(via)},
            "approach": {"direction": [-1, -2, 3], "frame": "base", "distance": 0.1},
        },
    ]
    stopping = to_cycle(
        CycleRequest.model_validate({"start": {"q": [0.0] * 6}, "stops": stops}), 10.0
    ).stops
    first, second = (stop.approach for stop in stopping)
    assert first is not None and second is not None
    assert first.frame == second.frame == "base"
    assert np.abs(first.direction - second.direction).max() < 4 * EXACT


def _bare(pose: dict[str, Any]) -> dict[str, Any]:
    """The pose without its frame: an obstacle has the frame of the scene."""
    return {name: value for name, value in pose.items() if name != "frame"}


def test_the_service_finds_the_same_configurations(client: TestClient) -> None:
    found = [
        client.post("/ik", json={"pose": pose}).json()["solutions"]
        for pose in (in_ros([0.4, -0.2, 0.3]), in_base([0.4, -0.2, 0.3]))
    ]
    assert len(found[0]) == len(found[1]) > 0
    for mine, other in zip(*found, strict=True):
        assert np.abs(np.array(mine["q"]) - other["q"]).max() < CHAIN
    path = {"t": [0.0], "guess": found[0][0]["q"]}
    ways = [
        path | {"points": [[-0.4, 0.2, 0.3]], "frame": "base_link"},
        path | {"points": [[0.4, -0.2, 0.3]]},
        path | {"poses": [in_ros([0.4, -0.2, 0.3])]},
    ]
    first, *others = (client.post("/ik/path", json=way).json()["trajectory"]["q"] for way in ways)
    for each in others:
        assert np.abs(np.array(first) - each).max() < 1e-5  # within the tolerance of a point, 1e-6


@pytest.mark.parametrize("where", ["goal.pose", "scene", "tool_cone"])
def test_another_frame_is_refused_by_name(client: TestClient, where: str) -> None:
    goal = {"pose": in_base([0.4, -0.2, 0.3])}
    body: dict[str, Any] = {"start": {"q": [0.0] * 6}, "goal": goal, "scene": {}}
    body["tool_cone"] = {"axis": [0, 0, 1], "direction": [0, 0, 1], "half_angle": 0.5}
    part = body
    for name in where.split("."):
        part = part[name]
    part["frame"] = "world"
    answer = client.post("/optimize", json=body)
    assert answer.status_code == 422
    assert any(
        error["loc"][-1] == "frame" and "base_link" in error["msg"]
        for error in answer.json()["errors"]
    )
