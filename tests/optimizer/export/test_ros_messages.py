"""ROS messages: the joint trajectory controller's own quintics between the points stay within the
tolerance.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import yaml

from joulepath import FormatUnsuitable, Move, MoveitOptions, Program, Ros2Options, Spline
from joulepath.models.robot import Array
from joulepath.optimizer.export import quintic_points as points_module
from joulepath.optimizer.export.quintic_points import QUINTICS
from joulepath.optimizer.export.ros_messages import to_moveit, to_ros2
from tests.optimizer.export.programs import cycle_with_payload
from tests.optimizer.export.read_back.joint_trajectories import deviations, followed
from tests.optimizer.export.read_back.random_motions import arm_of, one_move

# fields of the messages, as in their definitions
GOAL = {
    "trajectory",
    "multi_dof_trajectory",
    "path_tolerance",
    "component_path_tolerance",
    "goal_tolerance",
    "component_goal_tolerance",
    "goal_time_tolerance",
}


def check(program: Program, trajectory: dict[str, Any]) -> tuple[float, float]:
    found = deviations(program, followed(trajectory))
    assert found[0] <= QUINTICS.position_tolerance and found[1] <= QUINTICS.velocity_tolerance
    return found


@pytest.mark.parametrize(
    ("robot", "seed"), [("ur5e", 0), ("fr3", 1), ("kr10_r1100", 2), ("xarm7", 3)]
)
def test_the_controller_follows_the_spline(robot: str, seed: int) -> None:
    program = one_move(robot, seed)
    file = to_ros2(program)
    goal = yaml.safe_load(file.content)
    assert goal.keys() <= GOAL
    assert [each["name"] for each in goal["goal_tolerance"]] == goal["trajectory"]["joint_names"]
    check(program, goal["trajectory"])


def test_a_cycle_rests_where_it_should_and_says_when_the_payload_changes() -> None:
    program = cycle_with_payload()
    file = to_ros2(program)
    check(program, yaml.safe_load(file.content)["trajectory"])
    begins = program.timed[1].t0
    assert any(f"{begins:.4f} s the payload becomes 1.5 kg" in note for note in file.notes)


def bent(q: Array, knots: Array, degree: int) -> Program:
    arm = arm_of("ur5e")
    return Program((Move(Spline(degree, knots, q), arm),))


def test_a_spline_that_is_no_quintic_gets_more_points() -> None:
    rng = np.random.default_rng(4)
    q = np.repeat(rng.uniform(-1, 1, (4, 6)), 3, axis=0)  # degree 9: rest at both ends
    program = bent(q, np.concatenate([np.zeros(10), [0.7, 1.1], np.full(10, 2.0)]), 9)
    trajectory = yaml.safe_load(to_ros2(program).content)["trajectory"]
    assert len(trajectory["points"]) > 4
    check(program, trajectory)


def test_a_jump_of_the_acceleration_is_followed_as_closely() -> None:
    q = np.array([[0.0], [0.0], [0.5], [1.0], [1.0]]) * np.ones(6)
    program = bent(q, np.array([0.0, 0, 0, 0.6, 1.2, 2, 2, 2]), 2)
    trajectory = yaml.safe_load(to_ros2(program).content)["trajectory"]
    check(program, trajectory)


def test_what_no_points_can_follow_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(points_module, "QUINTICS", points_module.QuinticSettings(max_points=5))
    with pytest.raises(FormatUnsuitable, match="ros2"):
        to_ros2(one_move())


@pytest.mark.parametrize("message", ["goal", "trajectory"])
def test_json_is_an_operation_of_rosbridge(message: str) -> None:
    program = one_move()
    options = Ros2Options(message, "json", "arm/jtc")  # type: ignore[arg-type]
    content = json.loads(to_ros2(program, options).content)
    if message == "goal":
        assert (
            content["op"] == "send_action_goal"
            and content["action"] == "/arm/jtc/follow_joint_trajectory"
        )
        trajectory = content["args"]["trajectory"]
    else:
        assert content["op"] == "publish" and content["topic"] == "/arm/jtc/joint_trajectory"
        trajectory = content["msg"]
    check(program, trajectory)


@pytest.mark.parametrize("encoding", ["yaml", "json"])
def test_moveit_gets_a_robot_trajectory(encoding: str) -> None:
    program = one_move()
    options = MoveitOptions(encoding)  # type: ignore[arg-type]
    content = yaml.safe_load(to_moveit(program, options).content)
    assert content.keys() == {"joint_trajectory", "multi_dof_joint_trajectory"}
    check(program, content["joint_trajectory"])


def test_the_stated_deviation_is_the_largest_found() -> None:
    program = one_move(seed=7)
    measured = check(program, yaml.safe_load(to_ros2(program).content)["trajectory"])
    stated = points_module.quintic_points(program, "ros2")
    assert (
        measured[0] <= stated.position * 1.1 + 1e-9 and measured[1] <= stated.velocity * 1.1 + 1e-9
    )


def test_a_very_short_motion_is_followed() -> None:
    spline = one_move().moves[0].spline
    start = spline.control_points[0]
    program = bent(start + 1e-5 * (spline.control_points - start), spline.knots * 1e-3, 5)
    check(program, yaml.safe_load(to_ros2(program).content)["trajectory"])


def test_a_prefix_is_that_of_all_joint_names() -> None:
    program = one_move("ur5e", 0)
    wanted = [f"left_{name}" for name in program.robot.joint_names]
    goal = yaml.safe_load(to_ros2(program, Ros2Options(prefix="left_")).content)
    assert goal["trajectory"]["joint_names"] == wanted
    assert [each["name"] for each in goal["goal_tolerance"]] == wanted
    moveit = yaml.safe_load(to_moveit(program, MoveitOptions(prefix="left_")).content)
    assert moveit["joint_trajectory"]["joint_names"] == wanted


def test_a_controller_may_have_the_name_of_its_node_in_full() -> None:
    program = one_move("ur5e", 0)
    for name in ("/left/arm_controller", "left/arm_controller"):
        file = to_ros2(program, Ros2Options(controller=name, encoding="json"))
        assert json.loads(file.content)["action"] == "/left/arm_controller/follow_joint_trajectory"
