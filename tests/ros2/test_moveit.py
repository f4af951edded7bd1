"""MoveIt's service and planning scene, over the loopback interface; needs moveit_msgs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import joulepath
from benchmarks.tasks import flange
from tests.ros2.system import System, system

moveit = pytest.importorskip("moveit_msgs.msg", reason="moveit_msgs has no wheel: build it")
from geometry_msgs.msg import Point, Pose, Quaternion  # noqa: E402
from moveit_msgs.srv import GetMotionPlan  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from shape_msgs.msg import Mesh, MeshTriangle, SolidPrimitive  # noqa: E402

from joulepath.app.ros2.motion_plan import SUCCESS  # noqa: E402

UR5E = joulepath.load_robot("ur5e")
JOINTS = ["left_" + name for name in UR5E.joint_names]
START = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
GOAL = [0.8, -1.2, 1.3, -1.7, -1.57, 0.3]
# rad
ROUNDING = 1e-12
# m: a pose goal is reached as the certificate demands
REACHED = 1e-6
# codes of moveit_msgs/msg/MoveItErrorCodes
NO_IK = -31
INVALID_GOAL = -16
GOAL_COLLIDES = -12


@pytest.fixture(scope="module")
def ur5e() -> Iterator[System]:
    """A node for a ur5e at the start, with a prefix before its joint names in ROS."""
    with system(robot="ur5e", prefix="left_", deadline=60.0) as own:
        own.scenes = own.client.create_publisher(  # type: ignore[attr-defined]
            moveit.PlanningScene, f"{own.namespace}/planning_scene", 10
        )
        own.moves = own.client.create_client(  # type: ignore[attr-defined]
            GetMotionPlan, f"{own.namespace}/joulepath/plan_kinematic_path"
        )
        own.until(own.moves.service_is_ready)  # type: ignore[attr-defined]
        own.until(own.scenes.get_subscription_count)  # type: ignore[attr-defined]
        own.stand(JOINTS, START)
        yield own


def asked(own: Any, **fields: Any) -> Any:
    """The response to a request."""
    future = own.moves.call_async(
        GetMotionPlan.Request(motion_plan_request=moveit.MotionPlanRequest(**fields))
    )
    own.until(future.done)
    return future.result().motion_plan_response


def at_joints(q: list[float]) -> list[Any]:
    each = zip(JOINTS, q, strict=True)
    return [
        moveit.Constraints(
            joint_constraints=[moveit.JointConstraint(joint_name=n, position=x) for n, x in each]
        )
    ]


def at_pose(x: float, y: float, z: float, link: str = "left_tool0") -> list[Any]:
    place = moveit.PositionConstraint(link_name=link)
    place.header.frame_id = "left_base_link"
    place.constraint_region.primitive_poses = [Pose(position=Point(x=x, y=y, z=z))]
    place.constraint_region.primitives = [SolidPrimitive(type=2, dimensions=[0.001])]
    turn = moveit.OrientationConstraint(
        link_name=link, orientation=Quaternion(x=1.0, y=0.0, z=0.0, w=0.0)
    )
    turn.header.frame_id = "left_base_link"
    return [moveit.Constraints(position_constraints=[place], orientation_constraints=[turn])]


def send(own: Any, *objects: Any, whole: bool = False, names: list[str]) -> list[Any]:
    """The obstacles after a scene; waits until they have these names."""
    message = moveit.PlanningScene(is_diff=not whole)
    message.world.collision_objects = list(objects)
    own.scenes.publish(message)
    scene = own.node.scene

    def obstacles() -> list[Any]:
        return scene.added_to(None).get("obstacles", [])

    own.until(lambda: [each["name"] for each in obstacles()] == names)
    return obstacles()


def thing(name: str, at: tuple[float, float, float], **fields: Any) -> Any:
    x, y, z = at
    own = moveit.CollisionObject(id=name, pose=Pose(position=Point(x=x, y=y, z=z)), **fields)
    own.header.frame_id = "left_base_link"
    return own


def test_a_plan_to_joints(ur5e: System) -> None:
    answer = asked(ur5e, group_name="arm", goal_constraints=at_joints(GOAL))
    assert answer.error_code.val == SUCCESS and answer.group_name == "arm"
    trajectory = answer.trajectory.joint_trajectory
    assert trajectory.joint_names == JOINTS
    assert trajectory.points[0].positions == pytest.approx(START, abs=ROUNDING)
    assert trajectory.points[-1].positions == pytest.approx(GOAL, abs=ROUNDING)
    assert answer.trajectory_start.joint_state.name == JOINTS
    assert not ur5e.trajectories, "a controller would run it"


def test_slower_and_from_elsewhere(ur5e: System) -> None:
    start = moveit.RobotState(joint_state=JointState(name=JOINTS, position=GOAL))
    fast, slow = (
        asked(
            ur5e,
            start_state=start,
            goal_constraints=at_joints(START),
            max_velocity_scaling_factor=factor,
            allowed_planning_time=30.0,
        ).trajectory.joint_trajectory.points
        for factor in (1.0, 0.1)
    )
    assert fast[0].positions == pytest.approx(GOAL, abs=ROUNDING)
    speed = max(np.abs(each.velocities).max() for each in slow)
    assert speed <= 0.1 * np.pi * (1 + 1e-6) < max(np.abs(each.velocities).max() for each in fast)


def test_a_plan_to_a_pose(ur5e: System) -> None:
    answer = asked(ur5e, goal_constraints=at_pose(-0.4, -0.2, 0.3))
    assert answer.error_code.val == SUCCESS, answer.error_code.message
    end = np.array(answer.trajectory.joint_trajectory.points[-1].positions)
    # base_link is base after half a turn
    assert flange(UR5E, end)[:3, 3] == pytest.approx([0.4, 0.2, 0.3], abs=REACHED)


@pytest.mark.parametrize(
    ("goal", "code"),
    [
        ([], INVALID_GOAL),
        (at_joints(GOAL) * 2, INVALID_GOAL),
        (at_pose(-0.4, -0.2, 0.3, "left_wrist_3_link"), INVALID_GOAL),
        (at_pose(3.0, 0.0, 0.3), NO_IK),
    ],
)
def test_what_cannot_be_planned(ur5e: System, goal: list[Any], code: int) -> None:
    answer = asked(ur5e, goal_constraints=goal)
    assert answer.error_code.val == code and answer.error_code.message
    path = moveit.Constraints(
        joint_constraints=[moveit.JointConstraint(joint_name=JOINTS[0], position=0.0)]
    )
    held = asked(ur5e, goal_constraints=at_joints(GOAL), path_constraints=path)
    assert held.error_code.val == INVALID_GOAL and "path" in held.error_code.message


def test_the_planning_scene(ur5e: System) -> None:
    """Objects are added, extended, moved and removed, and plans avoid them."""
    quarter = Quaternion(z=np.sqrt(0.5), w=np.sqrt(0.5))
    corners = [Point(), Point(x=1.0), Point(y=1.0), Point(z=1.0)]
    faces = [
        MeshTriangle(vertex_indices=each) for each in ([0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3])
    ]
    table = thing(
        "table",
        (0.0, 0.0, -0.2),
        primitives=[SolidPrimitive(type=1, dimensions=[0.4, 0.3, 0.1])],
        primitive_poses=[Pose(position=Point(x=1.0))],
    )
    table.pose.orientation = quarter
    (found,) = send(ur5e, table, whole=True, names=["table"])
    assert found["size"] == [0.4, 0.3, 0.1]
    assert found["pose"]["position"] == pytest.approx([0.0, 1.0, -0.2], abs=ROUNDING)
    post = thing(
        "table",
        (0.0, 0.0, -0.2),
        operation=moveit.CollisionObject.APPEND,
        primitives=[SolidPrimitive(type=3, dimensions=[0.5, 0.05])],
        primitive_poses=[Pose()],
        meshes=[Mesh(vertices=corners, triangles=faces)],
        mesh_poses=[Pose(position=Point(x=5.0))],
    )
    found = send(ur5e, post, names=["table", "table.1", "table.2"])
    assert (found[1]["length"], found[1]["radius"]) == (0.5, 0.05)
    moved = thing("table", (0.0, 9.0, 0.0), operation=moveit.CollisionObject.MOVE)
    moved = send(
        ur5e,
        moved,
        ball := thing(
            "ball",
            (-0.4, -0.2, 0.3),
            primitives=[SolidPrimitive(type=2, dimensions=[0.1])],
            primitive_poses=[Pose()],
        ),
        names=["table", "table.1", "table.2", "ball"],
    )
    assert moved[0]["pose"]["position"] == pytest.approx([1.0, 9.0, 0.0], abs=ROUNDING)
    answer = asked(ur5e, goal_constraints=at_pose(-0.4, -0.2, 0.3))
    assert answer.error_code.val == GOAL_COLLIDES, answer.error_code.message
    ball.operation = moveit.CollisionObject.REMOVE
    send(ur5e, ball, names=["table", "table.1", "table.2"])
    answer = asked(ur5e, goal_constraints=at_pose(-0.4, -0.2, 0.3))
    assert answer.error_code.val == SUCCESS, answer.error_code.message
    send(ur5e, whole=True, names=[])


CONE = {"primitives": [SolidPrimitive(type=4, dimensions=[0.1, 0.1])]}
OPEN = {"meshes": [Mesh(vertices=[Point()], triangles=[MeshTriangle(vertex_indices=[0, 1, 2])])]}


@pytest.mark.parametrize(
    ("fields", "frame", "field"),
    [
        (CONE, "left_base_link", "primitives"),
        (OPEN, "left_base_link", "meshes"),
        ({"mesh_poses": [Pose()]}, "left_base_link", "cone"),
        ({}, "camera", "frame_id"),
    ],
)
def test_a_scene_that_plans_could_not_avoid(
    ur5e: System, fields: Any, frame: str, field: str
) -> None:
    """No motion is planned until a whole scene arrives."""
    own = thing("cone", (5.0, 0.0, 0.0), **fields)
    own.header.frame_id = frame
    message = moveit.PlanningScene(is_diff=True)
    message.world.collision_objects = [own]
    summary = ur5e.ask(lambda: ur5e.scenes.publish(message))  # type: ignore[attr-defined]
    assert summary["problem"]["errors"][0]["loc"][-1] == field
    refused = asked(ur5e, goal_constraints=at_joints(GOAL))
    assert refused.error_code.val == INVALID_GOAL and refused.error_code.message
    ur5e.scenes.publish(moveit.PlanningScene())  # type: ignore[attr-defined]
    ur5e.until(lambda: asked(ur5e, goal_constraints=at_joints(GOAL)).error_code.val == SUCCESS)
