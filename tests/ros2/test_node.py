"""The node in a ROS 2 system: real messages over the loopback interface, and a real planner in all
tests about planning.
"""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped

import joulepath
from benchmarks.service import running
from benchmarks.tasks import as_pose, flange
from joulepath import InvalidRequest, UnknownRobot
from joulepath.app.ros2.node import UNREACHABLE
from joulepath.app.ros2.planner import LocalPlanner, Plan
from joulepath.models.robot import Array
from joulepath.models.urdf import urdf_of
from joulepath.optimizer.deadline import Stopped
from tests.ros2.system import Json, System, system

ROOT = Path(__file__).parents[2]
UR5E = joulepath.load_robot("ur5e")
JOINTS = list(UR5E.joint_names)
START = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
GOAL = [0.8, -1.2, 1.3, -1.7, -1.57, 0.3]
# s: of a goal
STAMP = 7
# relative: the same computation on the same machine
SAME_ENERGY = 1e-9
# rad
ROUNDING = 1e-12
# m, rad: a pose goal is reached as the certificate demands
REACHED = 1e-6


@pytest.fixture(scope="module")
def ur5e() -> Iterator[System]:
    """A node for a ur5e with a prefix before its joint names in ROS."""
    with system(robot="ur5e", prefix="left_", deadline=60.0) as own:
        yield own


def left(names: list[str]) -> list[str]:
    return ["left_" + name for name in names]


def error_of(summary: Json) -> tuple[list[str], str]:
    """Path and message of the wrong field."""
    assert summary["state"] == "refused"
    error = summary["problem"]["errors"][0]
    return error["loc"], error["msg"]


def test_nothing_is_planned_without_a_goal_or_a_joint_state() -> None:
    with system(robot="ur5e") as own:
        planned, summary = own.plan()
        assert not planned and error_of(summary)[0] == ["goal"]
        assert error_of(own.go_to(JOINTS, GOAL))[0] == ["joint_states"]


def test_a_plan_fits_a_joint_trajectory_controller(ur5e: System) -> None:
    ur5e.stand(["gripper", *left(JOINTS)[::-1]], [0.02, *START[::-1]])
    summary = ur5e.go_to(left(JOINTS), GOAL)
    ur5e.until(lambda: ur5e.trajectories)
    trajectory = ur5e.trajectories[-1]
    first, last = trajectory.points[0], trajectory.points[-1]
    assert trajectory.joint_names == left(JOINTS)
    assert (trajectory.header.stamp.sec, trajectory.header.stamp.nanosec) == (0, 0)
    assert (first.time_from_start.sec, first.time_from_start.nanosec) == (0, 0)
    assert np.allclose(first.positions, START, rtol=0, atol=ROUNDING)
    # a controller refuses a trajectory with a final speed other than zero
    assert list(last.velocities) == [0.0] * 6
    assert np.allclose(last.positions, GOAL, rtol=0, atol=REACHED)
    times = [
        each.time_from_start.sec + each.time_from_start.nanosec * 1e-9 for each in trajectory.points
    ]
    assert np.diff(times).min() > 0 and times[-1] == pytest.approx(summary["duration"], abs=1e-8)


def test_the_summary_has_the_figures_of_the_library(ur5e: System) -> None:
    ur5e.stand(left(JOINTS), START)
    summary = ur5e.go_to(left(JOINTS), GOAL)
    ours = joulepath.optimize(
        joulepath.Problem(start=np.array(START), goal=np.array(GOAL), arm=joulepath.Arm(robot=UR5E))
    )
    energy = ours.energy.electrical.total
    assert summary["energy"] == pytest.approx(energy, rel=SAME_ENERGY)
    assert summary["lower_bound"] <= summary["energy"]
    assert max(summary["certificate"]["worst_ratio"].values()) <= 1.0
    assert min(
        each["energy"] for each in summary["alternatives"] if each["energy"]
    ) == pytest.approx(energy, rel=SAME_ENERGY)
    assert ur5e.plan()[1] == summary


@pytest.mark.parametrize(("frame", "turn"), [("left_base", 0), ("left_base_link", 1), ("", 1)])
def test_a_pose_is_reached_in_the_frame_of_its_header(ur5e: System, frame: str, turn: int) -> None:
    ur5e.stand(left(JOINTS), START)
    pose = flange(UR5E, np.array(GOAL))
    # base_link is base after half a turn about z
    half = np.diag([-1.0, -1.0, 1.0, 1.0]) if turn else np.eye(4)
    message = stamped(half @ pose, frame)
    count = len(ur5e.trajectories)
    summary = ur5e.ask(lambda: ur5e.poses.publish(message))
    assert (
        summary["state"] == "planned" and summary["goal_stamp"]["sec"] == message.header.stamp.sec
    )
    ur5e.until(lambda: len(ur5e.trajectories) > count)
    reached = flange(UR5E, np.array(ur5e.trajectories[-1].points[-1].positions))
    assert np.abs(reached - pose).max() < REACHED


def stamped(T: Array, frame: str) -> PoseStamped:
    """The message of a pose (4, 4)."""
    message, pose = PoseStamped(), as_pose(T)
    message.header.frame_id, message.header.stamp.sec = frame, STAMP
    place, turn = message.pose.position, message.pose.orientation
    place.x, place.y, place.z = pose["position"]
    turn.x, turn.y, turn.z, turn.w = pose["quaternion"]
    return message


def test_wrong_messages_are_refused_by_field_and_the_node_goes_on(ur5e: System) -> None:
    ur5e.stand(left(JOINTS), START)
    pose = stamped(flange(UR5E, np.array(GOAL)), "camera")
    where, message = error_of(ur5e.ask(lambda: ur5e.poses.publish(pose)))
    assert where == ["goal_pose", "header", "frame_id"] and "left_base" in message
    where, message = error_of(ur5e.go_to(JOINTS, GOAL))
    assert where == ["goal_joints", "name"] and "`prefix` to ''" in message
    where, message = error_of(ur5e.go_to(left(JOINTS), [*GOAL[:5], float("nan")]))
    assert where == ["goal_joints", "position"] and "wrist_3" in message
    assert error_of(ur5e.go_to(left(JOINTS), GOAL[:5]))[0] == ["goal_joints", "position"]
    assert error_of(ur5e.go_to(left([*JOINTS, JOINTS[0]]), [*GOAL, 0.0]))[0][0] == "goal_joints"
    pose.header.frame_id = "left_base"
    pose.pose.position.x = 3.0
    far = ur5e.ask(lambda: ur5e.poses.publish(pose))
    assert far["problem"]["type"] == "/problems/unreachable-pose"
    collides = ur5e.go_to(left(JOINTS), [0.0, -1.57, 3.1, -1.57, 0.0, 0.0])
    assert collides["problem"]["type"] == "/problems/goal-in-collision"
    pose.pose.orientation.w = pose.pose.orientation.x = 0.0
    pose.pose.orientation.y = pose.pose.orientation.z = 0.0
    assert ur5e.ask(lambda: ur5e.poses.publish(pose))["state"] == "refused"
    assert ur5e.go_to(left(JOINTS), GOAL)["state"] == "planned"


class Waiting:
    """A stand-in for a slow planner: every plan waits until it is stopped."""

    joints = tuple(JOINTS)

    def __init__(self) -> None:
        self.begun = threading.Semaphore(0)

    def plan(self, body: Json, is_stopped: Callable[[], bool]) -> Plan:
        self.begun.release()
        while not is_stopped():
            threading.Event().wait(0.001)
        raise Stopped


def test_a_plan_ends_by_cancel_and_by_the_next_goal() -> None:
    planner = Waiting()
    with system(planner, robot="ur5e") as own:
        own.stand(JOINTS, START)
        own.goals.publish(message := _joint_state(GOAL))
        own.until(lambda: planner.begun.acquire(blocking=False))
        second = own.ask(lambda: own.goals.publish(message))
        assert second["state"] == "cancelled"
        own.until(lambda: planner.begun.acquire(blocking=False))
        count = len(own.summaries)
        assert own.cancel()[0]
        own.until(lambda: len(own.summaries) > count)
        assert own.summaries[-1]["state"] == "cancelled"
        # nothing is left to cancel, and the node answers
        assert own.cancel()[0]


def _joint_state(q: list[float]) -> Any:
    from sensor_msgs.msg import JointState

    return JointState(name=JOINTS, position=q)


class Defective(Waiting):
    """Stands in for a planner with a defect."""

    def plan(self, body: Json, is_stopped: Callable[[], bool]) -> Plan:
        raise ZeroDivisionError("secret")


def test_a_defect_is_no_end_of_the_node_and_tells_nothing_of_the_inside() -> None:
    with system(Defective(), robot="ur5e") as own:
        own.stand(JOINTS, START)
        for _ in range(2):
            problem = own.go_to(JOINTS, GOAL)["problem"]
            assert problem["type"] == "/problems/internal-error" and "secret" not in str(problem)


def test_a_dead_service_is_told_and_the_node_goes_on() -> None:
    with system(robot="ur5e", url="http://127.0.0.1:9") as own:
        own.stand(JOINTS, START)
        for _ in range(2):
            problem = own.go_to(JOINTS, GOAL)["problem"]
            assert problem["type"] == UNREACHABLE


@pytest.mark.long
def test_a_service_computes_the_same_plan_as_the_node(ur5e: System) -> None:
    ur5e.stand(left(JOINTS), START)
    ours = ur5e.go_to(left(JOINTS), GOAL)
    ur5e.until(lambda: ur5e.trajectories)
    with (
        running(JOULEPATH_WORKERS="1") as service,
        system(
            robot="ur5e", prefix="left_", url=f"http://127.0.0.1:{service.port}", deadline=60.0
        ) as own,
    ):
        own.stand(left(JOINTS), START)
        theirs = own.go_to(left(JOINTS), GOAL)
        assert theirs["state"] == "planned", str(theirs)
        assert theirs["energy"] == pytest.approx(ours["energy"], rel=SAME_ENERGY)
        own.until(lambda: own.trajectories)
        assert own.trajectories[-1] == ur5e.trajectories[-1]
        far = own.go_to(left(JOINTS), [9.0, *GOAL[1:]])
        assert far["problem"]["type"] == "/problems/outside-limits"


def test_the_arm_in_robot_description_is_planned_for() -> None:
    with system(tip_link="flange", rated_payload=5.0, acceleration=20.0) as own:
        own.stand(JOINTS, START)
        assert error_of(own.go_to(JOINTS, GOAL))[0] == ["robot_description"]
        broken = own.ask(lambda: own.descriptions.publish(_text("<robot")))
        assert broken["state"] == "refused"
        own.descriptions.publish(_text(urdf_of("arm", UR5E.figures)))
        own.until(lambda: own.node.joints)
        assert own.go_to(JOINTS, GOAL)["state"] == "planned"


def _text(data: str) -> Any:
    from std_msgs.msg import String

    return String(data=data)


@pytest.mark.parametrize(
    ("parameters", "error"),
    [
        ({"robot": "nobody"}, UnknownRobot),
        ({"url": "http://127.0.0.1:9"}, InvalidRequest),
        ({"robot": "ur5e", "request_file": "/nowhere.yaml"}, InvalidRequest),
    ],
)
def test_wrong_parameters_are_told_at_the_start(parameters: Json, error: type[Exception]) -> None:
    with pytest.raises(error), system(**parameters):
        pass


def test_further_fields_come_from_a_file(tmp_path: Any) -> None:
    file = tmp_path / "request.yaml"
    file.write_text("payload: {mass: 3.0, com: [0, 0, 0.05]}\nduration: 3.0\n")
    with system(LocalPlanner("ur5e"), robot="ur5e", request_file=str(file)) as own:
        own.stand(JOINTS, START)
        summary = own.go_to(JOINTS, GOAL)
        assert summary.get("duration") == 3.0, summary
    file.write_text("goal: {q: [0, 0, 0, 0, 0, 0]}\n")
    with (
        pytest.raises(InvalidRequest, match="comes from messages"),
        system(robot="ur5e", request_file=str(file)),
    ):
        pass


@pytest.mark.long
def test_a_hundred_plans_in_a_row_are_the_same(ur5e: System) -> None:
    ur5e.stand(left(JOINTS), START)
    energies = [ur5e.go_to(left(JOINTS), GOAL)["energy"] for _ in range(100)]
    assert np.ptp(energies) <= SAME_ENERGY * energies[0]


@pytest.mark.long
def test_the_example_prints_the_joules_of_a_plan() -> None:
    example = ROOT / "examples" / "ros2" / "plan_to_joints.py"
    with system(robot="ur5e") as own:
        command = [sys.executable, str(example), "--ros-args", "-r", f"__ns:={own.namespace}"]
        done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
        assert done.returncode == 0, done.stderr
        # the figures of the documentation page, computed by the library
        assert done.stdout.startswith("43.2 J") and "less than straight" in done.stdout
